"""Mechanism -> Derivation: the sections that ``show`` prints, in the order of a textbook.

Input: a mechanism.  Output: a frozen :class:`Derivation` of SymPy expressions, matrices and
vectors in the user's own symbols.  Invariant: what :func:`mechc_codegen.derive.kane.derive` has
derived is shown as derived (angles joined for the reader); only the generalized active forces
are formed here.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from sympy import Expr, Matrix, S
from sympy.physics.mechanics import Particle, Point, ReferenceFrame, RigidBody, dynamicsymbols
from sympy.physics.vector import Vector

from mechc_codegen.derive.differentiate import differentiate
from mechc_codegen.derive.equations import Equations
from mechc_codegen.derive.kane import derive
from mechc_codegen.description.mechanism import Mechanism, printed_name
from mechc_codegen.description.terms import velocity_of
from mechc_codegen.typeset.angle_sums import join_angles
from mechc_codegen.typeset.boxes import Box, Row, Scripts, Word, layout, name


@dataclass(frozen=True)
class Item:
    """One equation: ``left = right``, and a label."""

    left: Any
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
class Derived:
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


def derivation(mechanism: Mechanism) -> Derivation:
    """Derive ``mechanism`` and set out every step, ready for either printer."""
    derived = _derived(mechanism)
    sections = [rule(derived) for rule in SECTIONS]
    return Derivation(mechanism, _scene(mechanism), tuple(s for s in sections if s.items))


def _derived(mechanism: Mechanism) -> Derived:
    equations = differentiate(derive(mechanism))
    symbols = equations.symbols
    plain = (*symbols.q, *symbols.u, *symbols.parameters, symbols.time)
    user = (*mechanism.q, *mechanism.x, *mechanism.u, *(p.symbol for p in mechanism.parameters))
    back = dict(zip(plain, (*user, dynamicsymbols._t), strict=True))
    return Derived(mechanism, equations, back)


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


def _quantity(letter: str, of: str, *, frame: ReferenceFrame | None = None) -> Box:
    """A bold letter with its object as superscript and its reference frame before it."""
    named = Scripts(Word(letter, "bold"), sup=name(of))
    if frame is None:
        return named
    return Row((Scripts(Row(()), sup=name(frame.name)), named))


def _frames(mechanism: Mechanism) -> tuple[ReferenceFrame, ...]:
    of_bodies = [b.frame for b in mechanism.bodies if isinstance(b, RigidBody)]
    return mechanism.frames or tuple(f for f in dict.fromkeys(of_bodies) if f != mechanism.frame)


def _mass_centres(mechanism: Mechanism) -> tuple[Point, ...]:
    return tuple(map(_centre, mechanism.bodies))


def _centre(body: RigidBody | Particle) -> Point:
    return body.point if isinstance(body, Particle) else body.masscenter


def _rotations(derived: Derived) -> Section:
    frame = derived.mechanism.frame
    return Section(
        "Rotation matrices",
        f"Columns are the unit vectors of a link's frame, written in {frame.name}: multiplied by "
        "components in the link's frame they give components in the inertial frame.",
        tuple(
            Item(_quantity("R", f.name, frame=frame), frame.dcm(f))
            for f in _frames(derived.mechanism)
        ),
    )


def _angular_velocities(derived: Derived) -> Section:
    frame, rates = derived.mechanism.frame, derived.mechanism.rates
    return Section(
        "Angular velocities",
        f"Of each link's frame as seen from {frame.name}.",
        tuple(
            Item(_quantity("ω", f.name, frame=frame), f.ang_vel_in(frame).xreplace(rates))
            for f in _frames(derived.mechanism)
        ),
    )


def _kinematics(derived: Derived) -> Section:
    time, mechanism = dynamicsymbols._t, derived.mechanism
    return Section(
        "Kinematic differential equations",
        "The rates of the coordinates in terms of the speeds.",
        tuple(
            Item(q.diff(time), rate)
            for q, rate in zip(mechanism.q, mechanism.kinematics, strict=True)
        ),
    )


def _positions(title: str, mechanism: Mechanism, points: tuple[Point, ...]) -> Section:
    return Section(
        f"Positions of the {title}",
        f"From {mechanism.origin.name}, each in the frames it is written in.",
        tuple(Item(_quantity("r", p.name), p.pos_from(mechanism.origin)) for p in points),
    )


def _velocities(title: str, mechanism: Mechanism, points: tuple[Point, ...]) -> Section:
    frame = mechanism.frame
    return Section(
        f"Velocities of the {title}",
        f"As seen from {frame.name}, with the kinematic differential equations inserted.",
        tuple(
            Item(
                _quantity("v", p.name, frame=frame), velocity_of(p, frame).xreplace(mechanism.rates)
            )
            for p in points
        ),
    )


def _points(mechanism: Mechanism) -> tuple[Point, ...]:
    return tuple(p for p in mechanism.points if p not in _mass_centres(mechanism))


def _closure(derived: Derived) -> Section:
    return Section(
        "Configuration constraints",
        "The loop closes where these vanish.",
        _vanishing(derived, "constraints"),
    )


def _velocity_constraints(derived: Derived) -> Section:
    return Section(
        "Velocity constraints",
        "Time derivatives of the configuration constraints, then constraints on the speeds alone.",
        _vanishing(derived, "velocity_constraints"),
    )


def _vanishing(derived: Derived, output: str) -> tuple[Item, ...]:
    pairs = zip(derived.elements(output), derived.labels(output), strict=True)
    return tuple(Item(expression, S.Zero, label) for expression, label in pairs)


def _acceleration_constraints(derived: Derived) -> Section:
    if not derived.labels("gamma"):
        return Section("", "", ())
    jacobian = derived.matrix("constraint_jacobian", len(derived.mechanism.u))
    rates = _column([u.diff(dynamicsymbols._t) for u in derived.mechanism.u])
    return Section(
        "Constraint Jacobian",
        "Derivative of the velocity constraints by the speeds; differentiated once more they "
        "constrain the accelerations.",
        (
            Item(Word("J", "bold"), jacobian),
            Item(Word("γ", "bold"), derived.matrix("gamma", 1)),
            Item(Row((Word("J", "bold"), layout(rates))), Word("γ", "bold")),
        ),
    )


def _column(elements: list[Expr]) -> Any:
    return Matrix(len(elements), 1, elements)


def _linear_momenta(derived: Derived) -> Section:
    mechanism = derived.mechanism
    return Section(
        "Linear momenta",
        "Mass times velocity of the mass centre of each body.",
        tuple(
            Item(
                _quantity("p", body.name),
                (body.mass * velocity_of(_centre(body), mechanism.frame)).xreplace(mechanism.rates),
            )
            for body in mechanism.bodies
        ),
    )


def _angular_momenta(derived: Derived) -> Section:
    mechanism = derived.mechanism
    components = derived.matrix("angular_momenta", 3)
    return Section(
        "Angular momenta",
        f"Of each body about {mechanism.origin.name}: its spin and the moment of its linear "
        "momentum.",
        tuple(
            Item(_quantity("H", body.name), Vector([(components[k, :].T, mechanism.frame)]))
            for k, body in enumerate(mechanism.bodies)
        ),
    )


def _energies(derived: Derived) -> Section:
    (kinetic,), (potential,) = map(derived.elements, ("kinetic_energy", "potential_energy"))
    return Section(
        "Energy",
        "Kinetic energy T, and potential energy V of the loads that have one.",
        (Item(Word("T"), kinetic), Item(Word("V"), potential)),
    )


def _loads(derived: Derived) -> Section:
    return Section(
        "Loads",
        "Forces on points and torques on frames.",
        tuple(
            Item(
                _quantity("T" if isinstance(at, ReferenceFrame) else "F", at.name),
                load.xreplace(derived.mechanism.rates),
            )
            for at, load in derived.mechanism.loads
        ),
    )


def _active(derived: Derived) -> Section:
    mechanism = derived.mechanism
    return Section(
        "Generalized active forces",
        "For each speed, the loads along the partial velocities of where they act.",
        tuple(
            Item(name("F", index=name(printed_name(u))), active_force(mechanism, u))
            for u in mechanism.u
        ),
    )


def active_force(mechanism: Mechanism, speed: Expr) -> Expr:
    """Sum over the loads of load . partial velocity (angular for a torque) for one speed."""
    frame, rates, total = mechanism.frame, mechanism.rates, S.Zero
    for at, load in mechanism.loads:
        seen = at.ang_vel_in if isinstance(at, ReferenceFrame) else at.vel
        partial = seen(frame).xreplace(rates).diff(speed, frame, var_in_dcm=False)
        total += load.xreplace(rates).dot(partial)
    return join_angles(total)


def _inertia(derived: Derived) -> Section:
    names = [name(printed_name(u)) for u in derived.mechanism.u]
    return Section(
        "Generalized inertia forces",
        "For each speed, the inertia forces and torques along the partial velocities.",
        tuple(
            Item(name("F", index=index, sup=Word("*", "operator")), force)
            for index, force in zip(names, inertia_forces(derived), strict=True)
        ),
    )


def inertia_forces(derived: Derived) -> list[Expr]:
    """-(M u') plus the forcing without loads."""
    mechanism = derived.mechanism
    unloaded = derive(replace(mechanism, loads=())).outputs["forcing"].elements
    rates = [u.diff(dynamicsymbols._t) for u in mechanism.u]
    mass = derived.matrix("mass_matrix", len(rates))
    return [
        derived.shown(free) - sum((mass[row, k] * rate for k, rate in enumerate(rates)), S.Zero)
        for row, free in enumerate(unloaded)
    ]


def _mass_matrix(derived: Derived) -> Section:
    return Section(
        "Mass matrix",
        "Of the open tree, over all speeds; symmetric.",
        (Item(Word("M", "bold"), derived.matrix("mass_matrix", len(derived.mechanism.u))),),
    )


def _forcing(derived: Derived) -> Section:
    return Section(
        "Forcing",
        "Generalized active forces with what of the generalized inertia forces is free of "
        "accelerations; one row for each speed.",
        (Item(Word("F", "bold"), derived.matrix("forcing", 1)),),
    )


def _motion(derived: Derived) -> Section:
    rates = _column([u.diff(dynamicsymbols._t) for u in derived.mechanism.u])
    left: list[Box] = [Word("M", "bold"), layout(rates)]
    sentence = "Mass matrix times accelerations is the forcing."
    if derived.labels("gamma"):
        transposed = Scripts(Word("J", "bold"), sup=Word("⊤", "operator"))
        left += [Word("+", "operator"), transposed, Word("λ", "bold")]
        sentence = (
            "Together with the constraints on the accelerations they give the accelerations and "
            "the multipliers, which are the constraint forces."
        )
    return Section("Equations of motion", sentence, (Item(Row(tuple(left)), Word("F", "bold")),))


SECTIONS: tuple[Callable[[Derived], Section], ...] = (
    _rotations,
    _angular_velocities,
    _kinematics,
    lambda d: _positions("points", d.mechanism, _points(d.mechanism)),
    lambda d: _velocities("points", d.mechanism, _points(d.mechanism)),
    lambda d: _positions("mass centres", d.mechanism, _mass_centres(d.mechanism)),
    lambda d: _velocities("mass centres", d.mechanism, _mass_centres(d.mechanism)),
    _closure,
    _velocity_constraints,
    _acceleration_constraints,
    _linear_momenta,
    _angular_momenta,
    _energies,
    _loads,
    _active,
    _inertia,
    _mass_matrix,
    _forcing,
    _motion,
)
