"""Mechanism -> Derivation: the sections that ``show`` prints, in the order of a textbook.

Input: a mechanism.  Output: a frozen :class:`Derivation` of SymPy expressions, matrices and
vectors in the user's own symbols.  Invariant: what :func:`mechc_codegen.derive.kane.derive` has
derived is shown as derived (angles joined for the reader); only the generalized active forces
are formed here.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Any

from sympy import Add, Derivative, Expr, Matrix, Mul, S, cos, sin
from sympy.core.function import AppliedUndef
from sympy.physics.mechanics import Particle, Point, ReferenceFrame, RigidBody, dynamicsymbols
from sympy.physics.vector import Vector

from mechc_codegen.derive.differentiate import differentiate
from mechc_codegen.derive.equations import Equations
from mechc_codegen.derive.kane import derive
from mechc_codegen.description.mechanism import Mechanism, printed_name
from mechc_codegen.description.terms import velocity_of
from mechc_codegen.typeset.formula import Formula, formula, name


@dataclass(frozen=True)
class Item:
    """One equation: ``left = right``, which is of SymPy or a formula, and a label."""

    left: Formula
    right: Any
    label: str = ""


@dataclass(frozen=True)
class Section:
    """A title, one sentence that explains, and the equations."""

    title: str
    sentence: str
    items: tuple[Item, ...]


@dataclass(frozen=True)
class Derivation:
    """Everything that ``show`` prints about a mechanism except its parameter values."""

    mechanism: Mechanism
    scene: tuple[str, ...]
    sections: tuple[Section, ...]


@dataclass(frozen=True)
class UsersEquations:
    """A mechanism with its equations in the user's symbols."""

    mechanism: Mechanism
    equations: Equations
    back: dict[Expr, Expr]

    def elements(self, output: str) -> list[Expr]:
        """The elements of a derived output."""
        return [self.shown(e) for e in self.equations.outputs[output].elements]

    def matrix(self, output: str, columns: int) -> Any:
        """A derived output as a matrix of so many columns."""
        elements = self.elements(output)
        return Matrix(len(elements) // columns, columns, elements)

    def labels(self, output: str) -> tuple[str, ...]:
        return self.equations.outputs[output].labels

    def shown(self, expression: Expr) -> Expr:
        return join_angles(expression).xreplace(self.back)


def join_angles(expression: Any) -> Any:
    """Replace cos a cos b + sin a sin b by cos(a - b), and its three relatives, everywhere.

    Only products of exactly two sines or cosines that are terms of one sum are joined; nothing is
    expanded or simplified.
    """
    if not expression.args or isinstance(expression, (AppliedUndef, Derivative)):
        return expression
    rebuilt = expression.func(*map(join_angles, expression.args))
    if not isinstance(rebuilt, Add):
        return rebuilt
    done: list[Any] = []
    waiting: dict[frozenset[Any], Any] = {}
    for term in rebuilt.args:
        halves = _halves(term)
        for one, other in (halves, halves[::-1]) if halves else ():
            if waiting.pop(frozenset((one, -other)), None) is not None:
                done.append(2 * one)
                break
        else:
            waiting[frozenset(halves or (term,))] = term
    return Add(*done, *waiting.values())


def _halves(term: Any) -> tuple[Any, Any] | None:
    """A product of two sines or cosines as the sum that it is: of a - b and of a + b."""
    turning = [f for f in Mul.make_args(term) if isinstance(f, (sin, cos))]
    if len(turning) != 2:
        return None
    first, second = sorted(turning, key=lambda f: isinstance(f, cos))
    half = term / first / second / 2
    a, b = first.args[0], second.args[0]
    if isinstance(first, cos):
        return half * cos(a - b), half * cos(a + b)
    if isinstance(second, cos):
        return half * sin(a - b), half * sin(a + b)
    return half * cos(a - b), -half * cos(a + b)


def derivation(mechanism: Mechanism) -> Derivation:
    """Derive ``mechanism`` and set out every step, ready for either printer."""
    derived = _users_equations(mechanism)
    places = {"frame": mechanism.frame.name, "origin": mechanism.origin.name}
    sections = [
        Section(title, sentence.format_map(places), tuple(rule(derived)))
        for title, sentence, rule in _CONTENTS
    ]
    return Derivation(mechanism, _scene(mechanism), tuple(s for s in sections if s.items))


def _users_equations(mechanism: Mechanism) -> UsersEquations:
    equations = differentiate(derive(mechanism))
    symbols = equations.symbols
    plain = (*symbols.q, *symbols.u, *symbols.parameters, symbols.time)
    user = (*mechanism.q, *mechanism.x, *mechanism.u, *(p.symbol for p in mechanism.parameters))
    back = dict(zip(plain, (*user, dynamicsymbols._t), strict=True))
    return UsersEquations(mechanism, equations, back)


def _scene(mechanism: Mechanism) -> tuple[str, ...]:
    bodies = ", ".join(body.name for body in mechanism.bodies)
    count = len(mechanism.coordinates)
    closure = len(mechanism.holonomic)
    motion = len(mechanism.motion_constraints)
    free = len(mechanism.speeds) - closure - motion
    sentences = [
        f"{len(mechanism.bodies)} bodies ({bodies}), {count} coordinates and "
        f"{len(mechanism.speeds)} speeds, {closure} constraints on the configuration and {motion} "
        f"on the speeds alone. Degrees of freedom, if no constraint is redundant: {max(free, 0)}.",
        f"The inertial frame is {mechanism.frame.name}; positions are measured from the point "
        f"{mechanism.origin.name}, fixed in it.",
    ]
    if mechanism.skipped:
        sentences.append(f"Not in this scene: {', '.join(mechanism.skipped)}.")
    return tuple(sentences)


def _quantity(letter: str, of: str, frame: ReferenceFrame | None = None) -> Formula:
    """A bold letter with its object as superscript and its reference frame before it."""
    seen_from = f"{{}}^{{{name(frame.name)}}}" if frame else ""
    return Formula(f"{seen_from}{name(letter, bold=True)}^{{{name(of)}}}")


def _frames(mechanism: Mechanism) -> tuple[ReferenceFrame, ...]:
    of_bodies = [b.frame for b in mechanism.bodies if isinstance(b, RigidBody)]
    return mechanism.frames or tuple(f for f in dict.fromkeys(of_bodies) if f != mechanism.frame)


def _mass_centres(mechanism: Mechanism) -> list[Point]:
    return [b.point if isinstance(b, Particle) else b.masscenter for b in mechanism.bodies]


def _points(mechanism: Mechanism) -> list[Point]:
    return [p for p in mechanism.points if p not in _mass_centres(mechanism)]


def _rotations(derived: UsersEquations) -> Iterator[Item]:
    frame = derived.mechanism.frame
    for other in _frames(derived.mechanism):
        yield Item(_quantity("R", other.name, frame), frame.dcm(other))


def _kinematics(derived: UsersEquations) -> Iterator[Item]:
    mechanism = derived.mechanism
    for q, rate in zip(mechanism.q, mechanism.kinematics, strict=True):
        yield Item(formula(q.diff(dynamicsymbols._t)), rate)


def _positions(mechanism: Mechanism, points: list[Point]) -> Iterator[Item]:
    for point in points:
        yield Item(_quantity("r", point.name), point.pos_from(mechanism.origin))


def _velocities(
    mechanism: Mechanism, letter: str, places: Iterable[Point | ReferenceFrame]
) -> Iterator[Item]:
    frame = mechanism.frame
    for place in places:
        velocity = velocity_of(place, frame).xreplace(mechanism.rates)
        yield Item(_quantity(letter, place.name, frame), velocity)


def _vanishing(derived: UsersEquations, output: str) -> Iterator[Item]:
    for expression, label in zip(derived.elements(output), derived.labels(output), strict=True):
        yield Item(Formula("0"), expression, label)


def _acceleration_constraints(derived: UsersEquations) -> Iterator[Item]:
    if derived.labels("gamma"):
        jacobian, gamma = name("J", bold=True), name("gamma", bold=True)
        yield Item(jacobian, derived.matrix("constraint_jacobian", len(derived.mechanism.u)))
        yield Item(gamma, derived.matrix("gamma", 1))
        yield Item(Formula(jacobian + formula(Matrix(_accelerations(derived)))), gamma)


def _accelerations(derived: UsersEquations) -> list[Expr]:
    return [u.diff(dynamicsymbols._t) for u in derived.mechanism.u]


def _linear_momenta(derived: UsersEquations) -> Iterator[Item]:
    mechanism = derived.mechanism
    for body, centre in zip(mechanism.bodies, _mass_centres(mechanism), strict=True):
        momentum = body.mass * velocity_of(centre, mechanism.frame)
        yield Item(_quantity("p", body.name), momentum.xreplace(mechanism.rates))


def _angular_momenta(derived: UsersEquations) -> Iterator[Item]:
    components, frame = derived.matrix("angular_momenta", 3), derived.mechanism.frame
    for k, body in enumerate(derived.mechanism.bodies):
        yield Item(_quantity("H", body.name), Vector([(components[k, :].T, frame)]))


def _energies(derived: UsersEquations) -> Iterator[Item]:
    for letter, output in (("T", "kinetic_energy"), ("V", "potential_energy")):
        (energy,) = derived.elements(output)
        yield Item(name(letter), energy)


def _loads(derived: UsersEquations) -> Iterator[Item]:
    for at, load in derived.mechanism.loads:
        letter = "T" if isinstance(at, ReferenceFrame) else "F"
        yield Item(_quantity(letter, at.name), load.xreplace(derived.mechanism.rates))


def _generalized_force(speed: Expr) -> Formula:
    return name("F", index=name(printed_name(speed)))


def active_force(mechanism: Mechanism, speed: Expr) -> Expr:
    """Sum over the loads of load . partial velocity (angular for a torque) for one speed."""
    frame, rates, total = mechanism.frame, mechanism.rates, S.Zero
    for at, load in mechanism.loads:
        partial = velocity_of(at, frame).xreplace(rates).diff(speed, frame, var_in_dcm=False)
        total += load.xreplace(rates).dot(partial)
    return join_angles(total)


def _inertia(derived: UsersEquations) -> Iterator[Item]:
    """-(M u') plus the forcing without loads."""
    mechanism = derived.mechanism
    unloaded = derive(replace(mechanism, loads=())).outputs["forcing"].elements
    accelerations = _accelerations(derived)
    mass = derived.matrix("mass_matrix", len(accelerations))
    for row, (u, free) in enumerate(zip(mechanism.u, unloaded, strict=True)):
        reaction = sum((mass[row, k] * rate for k, rate in enumerate(accelerations)), S.Zero)
        yield Item(Formula(f"{_generalized_force(u)}^{{*}}"), derived.shown(free) - reaction)


def _matrix(derived: UsersEquations, letter: str, output: str, columns: int) -> Iterator[Item]:
    yield Item(name(letter, bold=True), derived.matrix(output, columns))


def _motion(derived: UsersEquations) -> Iterator[Item]:
    left = name("M", bold=True) + formula(Matrix(_accelerations(derived)))
    if derived.labels("gamma"):
        left += rf" + \mathbf{{J}}^{{T}} {name('lambda', bold=True)}"
    yield Item(Formula(left), name("F", bold=True))


_CONTENTS: tuple[tuple[str, str, Callable[[UsersEquations], Iterable[Item]]], ...] = (
    (
        "Rotation matrices",
        "Columns are the unit vectors of a link's frame, written in {frame}: multiplied by "
        "components in the link's frame they give components in the inertial frame.",
        _rotations,
    ),
    (
        "Angular velocities",
        "Of each link's frame as seen from {frame}.",
        lambda d: _velocities(d.mechanism, "ω", _frames(d.mechanism)),
    ),
    (
        "Kinematic differential equations",
        "The rates of the coordinates in terms of the speeds.",
        _kinematics,
    ),
    (
        "Positions of the points",
        "From {origin}, each in the frames it is written in.",
        lambda d: _positions(d.mechanism, _points(d.mechanism)),
    ),
    (
        "Velocities of the points",
        "As seen from {frame}, with the kinematic differential equations inserted.",
        lambda d: _velocities(d.mechanism, "v", _points(d.mechanism)),
    ),
    (
        "Positions of the mass centres",
        "From {origin}, each in the frames it is written in.",
        lambda d: _positions(d.mechanism, _mass_centres(d.mechanism)),
    ),
    (
        "Velocities of the mass centres",
        "As seen from {frame}, with the kinematic differential equations inserted.",
        lambda d: _velocities(d.mechanism, "v", _mass_centres(d.mechanism)),
    ),
    (
        "Configuration constraints",
        "The loop closes where these vanish.",
        lambda d: _vanishing(d, "constraints"),
    ),
    (
        "Velocity constraints",
        "Time derivatives of the configuration constraints, then constraints on the speeds alone.",
        lambda d: _vanishing(d, "velocity_constraints"),
    ),
    (
        "Constraint Jacobian",
        "Derivative of the velocity constraints by the speeds; differentiated once more they "
        "constrain the accelerations.",
        _acceleration_constraints,
    ),
    ("Linear momenta", "Mass times velocity of the mass centre of each body.", _linear_momenta),
    (
        "Angular momenta",
        "Of each body about {origin}: its spin and the moment of its linear momentum.",
        _angular_momenta,
    ),
    (
        "Energy",
        "Kinetic energy T, and potential energy V of the loads that have one.",
        _energies,
    ),
    ("Loads", "Forces on points and torques on frames.", _loads),
    (
        "Generalized active forces",
        "For each speed, the loads along the partial velocities of where they act.",
        lambda d: (
            Item(_generalized_force(u), active_force(d.mechanism, u)) for u in d.mechanism.u
        ),
    ),
    (
        "Generalized inertia forces",
        "For each speed, the inertia forces and torques along the partial velocities.",
        _inertia,
    ),
    (
        "Mass matrix",
        "Of the open tree, over all speeds; symmetric.",
        lambda d: _matrix(d, "M", "mass_matrix", len(d.mechanism.u)),
    ),
    (
        "Forcing",
        "Generalized active forces, and those parts of the generalized inertia forces that hold "
        "no accelerations; one row for each speed.",
        lambda d: _matrix(d, "F", "forcing", 1),
    ),
    (
        "Equations of motion",
        "Mass matrix times accelerations, with the multipliers of the constraints if there are "
        "any, which are the constraint forces, is the forcing.",
        _motion,
    ),
)
