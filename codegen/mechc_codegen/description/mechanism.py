"""The description of a scene: a mechanism in ``sympy.physics.mechanics``, validated.

Input: frames, points, bodies, loads and constraints as SymPy builds them, with the parameters
and coordinates they use.  Output: one frozen :class:`Mechanism`.  Invariant: every symbol in it
is time, a declared parameter, a declared coordinate or speed, or a coordinate's rate.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, TypeAlias

from sympy import Basic, Derivative, DiracDelta, Expr, S, Symbol, sympify
from sympy.core.function import AppliedUndef
from sympy.physics.mechanics import Particle, Point, ReferenceFrame, RigidBody, dynamicsymbols
from sympy.physics.vector import Vector

from mechc_codegen.description.constraints import Closure as Closure
from mechc_codegen.description.constraints import Constraint as Constraint
from mechc_codegen.description.constraints import Contact
from mechc_codegen.description.drawing import NO_DRAWING
from mechc_codegen.description.drawing import Drawing as Drawing
from mechc_codegen.description.given_equations import GivenEquations
from mechc_codegen.description.joints.closures import joints_and_closures
from mechc_codegen.description.joints.couplings import CoupledPair
from mechc_codegen.description.joints.tree import Joint
from mechc_codegen.description.quantity import Quantity as Quantity  # the stages find them here
from mechc_codegen.description.quantity import in_si, refuse_scaled
from mechc_codegen.description.terms import Load as Load
from mechc_codegen.description.terms import as_expression, entries_of, refuse_no_vector
from mechc_codegen.description.terms import is_rigid as is_rigid
from mechc_codegen.description.terms import printed_name as printed_name
from mechc_codegen.errors import MechanismError


@dataclass(frozen=True)
class Parameter:
    """A constant of the mechanism with its default, which may follow other parameters.

    Without a default (None) its value has to be given with every use, or, where it is ``preset``,
    when the compiled scene is loaded.  A parameter without effect is kept for its default, unless
    this is a number ``given`` with ``defaults=``, as in models.  Its bounds are within what its
    symbol is declared to be.
    """

    symbol: Symbol
    default: Expr | float | None
    quantity: Quantity
    preset: bool = False
    given: bool = False

    def __post_init__(self) -> None:
        if isinstance(self.symbol, Symbol) and isinstance(self.quantity, Quantity):
            object.__setattr__(self, "quantity", self.quantity.of_sign(self.symbol))


@dataclass(frozen=True)
class Coordinate:
    """A generalized coordinate ``q(t)`` with the scale that its tolerance refers to."""

    symbol: AppliedUndef
    quantity: Quantity


@dataclass(frozen=True)
class Speed:
    """A generalized speed ``u(t)``."""

    symbol: AppliedUndef
    quantity: Quantity


@dataclass(frozen=True)
class State:
    """A function of time that is neither coordinate nor speed and has a differential equation.

    ``rate``: of time, coordinates and their rates, speeds, states, inputs and parameters, linear or
    not.  ``start``: the initial value by default.
    """

    symbol: AppliedUndef
    rate: Expr
    quantity: Quantity
    start: float = 0.0


Notes = Callable[[Mapping[str, float]], list[tuple[str, str]]]


@dataclass(frozen=True)
class AddedInertia:
    """A load that is linear in accelerations and therefore part of the mass matrix.

    ``per_acceleration`` has for each speed the force or torque at ``place`` per unit of its rate.
    """

    place: Point | ReferenceFrame
    per_acceleration: tuple[Vector, ...]


@dataclass(frozen=True)
class Reaction:
    """A force or torque that keeps auxiliary speeds zero, a symbol or a function of time.

    ``per_unit``: the loads that it is, per unit of it.
    """

    symbol: Expr
    per_unit: tuple[Load, ...]


Bound: TypeAlias = "Expr | float | None"


@dataclass(frozen=True)
class Limits:
    """The bounds of a joint: numbers, symbols, or None where there is no bound.

    Attributes
    ----------
    position
        The joint's position, an expression of coordinates.
    lower, upper
        Its bounds, in rad or m.
    velocity, effort
        Of the magnitudes of its rate (rad/s, m/s) and of its motor's torque or force (N m, N).
    """

    position: Expr
    lower: Bound = None
    upper: Bound = None
    velocity: Bound = None
    effort: Bound = None


judging: list[Callable[..., Any]] = []  # what Mechanism.judge asks, which the runtime sets


def _plural(word: str, count: int) -> str:
    return word if count == 1 else f"{word.removesuffix('y')}ies" * word.endswith("y") or f"{word}s"


@dataclass(frozen=True)
class Mechanism:
    """A validated description of a mechanism.

    Attributes
    ----------
    frame, origin
        The inertial frame and a point fixed in it, from which positions are measured.
    coordinates, speeds
        In state order; ``y = [q, u]``, with the states, where there are any, ``y = [q, x, u]``.
    kinematics
        The coordinates' rates as expressions of coordinates, speeds and time, in the order of
        ``coordinates``.
    bodies
        ``RigidBody`` or ``Particle``; their ``potential_energy`` is the potential of the
        conservative loads.
    loads
        ``(Point, force)`` and ``(ReferenceFrame, torque)`` pairs; a load in ``dissipative`` has
        no potential.
    configuration_constraints, motion_constraints
        Holonomic constraints on the configuration; constraints on the speeds only (linear in
        them).  The time derivatives of the former are derived, not given.
    closures
        Cut joints, each with holonomic constraints that follow those of
        ``configuration_constraints``.  Unlike constraints written as expressions they do not
        become longer with the chain.  Those of ``joints`` are appended.
    joints
        The joints, as far as they are known: those of ``sympy.physics.mechanics``,
        :class:`~mechc_codegen.Joint`, and :class:`~mechc_codegen.Cut` for those that close
        loops.  A body of theirs that turns with ``frame`` and is not among ``bodies`` is
        the ground.  Joint reactions need them; motion follows from frames and points.
    gravity
        A uniform gravitational acceleration that acts on every body, and its potential; a vector
        whose components in ``frame`` are constant.
    points
        The named points whose positions and velocities can be evaluated.
    inputs
        Specified functions of time that are not states, each with its expression: of time, and, if
        no derivative of it appears, also of coordinates and speeds.  With None, and where they are
        listed without expressions, it is given at run time, if any equation contains it.
    input_units
        Units of inputs that are given at run time, as texts.
    states
        Functions of time with differential equations: activations, controllers.  Loads, rates and
        inputs may contain them, configuration constraints may not.
    auxiliary
        Auxiliary speeds: zero, and so are their rates.
    reactions
        Forces and torques that act on auxiliary speeds only; user-defined outputs may contain them.
    auxiliary_constraints
        The constraints on the speeds with the auxiliary speeds in them, if any contains one: the
        virtual motion by which a reaction is found satisfies them.
    lagrangian
        L(q, q', t), whose equations are added to those of bodies and loads; the coordinates'
        rates must then be the speeds.
    equations
        Terms that are added to those of bodies and loads, as they are given.
    potential
        The potential energy, where it is not the sum of that of the bodies.
    unknown_potentials
        Descriptions of the loads for which it is not known whether they have a potential; with any,
        no potential energy is computed.
    added_inertia
        Loads that are linear in the speeds' rates, which the mass matrix takes up; what they make
        of it must be symmetric.
    drawn
        Bodies whose energies are in L: they are in pictures only.
    limits
        Name of a joint -> its bounds, as a file has them; ``contacts`` and loads enforce those that
        are taken.
    contacts
        Stops and dry friction in every run, besides those among its events.
    outputs
        Outputs of every model besides those requested: name -> expression and unit.
    start
        Coordinates and speeds that ``run`` starts from by default (SI units).
    preference
        Of several assemblies the one with the largest value of this expression is used.
    notes
        From parameter values to ``(label, sentence)`` pairs that ``show`` prints.
    links
        Name of a link of a file -> its body ("": the ground), mass and Ixx, Ixy, Ixz, Iyy, Iyz, Izz
        about its mass centre (SI units), before links that are fixed to each other are one body.
    cut_reasons
        Name of a cut -> why it was chosen, where mechc chose it.
    """

    name: str
    title: str
    frame: ReferenceFrame
    origin: Point
    coordinates: tuple[Coordinate, ...]
    speeds: tuple[Speed, ...]
    kinematics: tuple[Expr, ...]
    parameters: tuple[Parameter, ...]
    bodies: tuple[RigidBody | Particle, ...]
    loads: tuple[Load, ...] = ()
    configuration_constraints: tuple[Constraint, ...] = ()
    motion_constraints: tuple[Constraint, ...] = ()
    points: tuple[Point, ...] = ()
    frames: tuple[ReferenceFrame, ...] = ()
    drawing: Drawing = NO_DRAWING
    start: Mapping[str, float] = field(default_factory=dict)
    preference: Expr | None = None
    notes: Notes | None = None
    skipped: tuple[str, ...] = ()
    inputs: Mapping[AppliedUndef, Expr | None] = field(default_factory=dict)
    auxiliary: tuple[AppliedUndef, ...] = ()
    lagrangian: Expr | None = None
    equations: GivenEquations | None = None
    potential: Expr | None = None
    unknown_potentials: tuple[str, ...] = ()
    added_inertia: tuple[AddedInertia, ...] = ()
    closures: tuple[Closure, ...] = ()
    gravity: Vector | None = None
    joints: tuple[Joint, ...] = ()
    states: tuple[State, ...] = ()
    reactions: tuple[Reaction, ...] = ()
    auxiliary_constraints: tuple[Expr, ...] = ()
    drawn: tuple[RigidBody | Particle, ...] = ()
    limits: Mapping[str, Limits] = field(default_factory=dict)
    contacts: tuple[Contact, ...] = ()
    outputs: Mapping[str, tuple[Expr, str]] = field(default_factory=dict)
    input_units: Mapping[AppliedUndef, str] = field(default_factory=dict)
    links: Mapping[str, tuple[str, float, tuple[float, ...]]] = field(default_factory=dict)
    cut_reasons: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        refuse_no_vector(self.gravity)
        object.__setattr__(self, "inputs", as_mapping(self.inputs))
        _take_joints(self)
        _bound_lengths(self)
        _check_lengths(self)
        _check_names(self)
        _check_units(self)
        object.__setattr__(self, "start", _start_in_si(self))
        _check_states(self)
        _check_symbols(self)
        _refuse_impulses(self)

    def __repr__(self) -> str:
        parts = {
            "coordinate": self.coordinates, "speed": self.speeds, "body": self.bodies,
            "joint": self.joints, "constraint": self.rows, "parameter": self.parameters,
        }  # fmt: skip
        counts = [f"{len(found)} {_plural(word, len(found))}" for word, found in parts.items()]
        return f"<mechc.Mechanism {self.name}: {', '.join(counts)}>"

    def judge(self, params: Mapping[Any, float] | None = None) -> Any:
        """What is to be known before a motion: see :func:`mechc.judge`."""
        return judging[-1](self, params)

    @property
    def q(self) -> tuple[AppliedUndef, ...]:
        return tuple(c.symbol for c in self.coordinates)

    @property
    def x(self) -> tuple[AppliedUndef, ...]:
        return tuple(s.symbol for s in self.states)

    @property
    def u(self) -> tuple[AppliedUndef, ...]:
        return tuple(s.symbol for s in self.speeds)

    @property
    def open_inputs(self) -> tuple[AppliedUndef, ...]:
        """The inputs that are given at run time."""
        return tuple(f for f, expression in self.inputs.items() if expression is None)

    @property
    def has_identity_kinematics(self) -> bool:
        """Whether the speeds are the coordinates' rates, without states."""
        return tuple(self.kinematics) == self.u and not self.states

    @property
    def holonomic(self) -> tuple[tuple[str, str], ...]:
        """Name and unit of every holonomic constraint."""
        written = [(c.name, c.unit) for c in self.configuration_constraints]
        return (*written, *(row for closure in self.closures for row in closure.rows))

    @property
    def aligned_axes(self) -> tuple[tuple[str, Vector, Vector], ...]:
        """Name of every cut joint, and two axes that have to point the same way there."""
        return tuple((cut.name, *axes) for cut in self.closures for axes in cut.aligned)

    @property
    def cuts(self) -> tuple[str, ...]:
        """Names of the joints that close loops: constraints hold them, they have no coordinates."""
        return tuple(joint.name for joint in self.joints if joint.is_cut)

    @property
    def rows(self) -> tuple[str, ...]:
        """Name of every row of J: holonomic constraints first."""
        holonomic = [name for name, _ in self.holonomic]
        return (*holonomic, *(c.name for c in self.motion_constraints))

    @cached_property
    def second_rates(self) -> dict[Expr, Expr]:
        """``{q'': expression}`` of coordinates, speeds and their rates."""
        time = dynamicsymbols._t
        return {
            q.diff(time, 2): rate.diff(time).xreplace(self.rates)
            for q, rate in zip(self.q, self.kinematics, strict=True)
        }

    @cached_property
    def rates(self) -> dict[Expr, Expr]:
        """The kinematic differential equations as a replacement: ``{q': expression}``.

        The auxiliary speeds and their rates, which are zero by definition, are included.
        """
        time = dynamicsymbols._t
        zero = {x: S.Zero for u in self.auxiliary for x in (u.diff(time), u)}
        rates = {q.diff(time): rate for q, rate in zip(self.q, self.kinematics, strict=True)}
        of_states = {s.symbol.diff(time): s.rate.xreplace(zero | rates) for s in self.states}
        return zero | rates | of_states


def _take_joints(mechanism: Mechanism) -> None:
    """Convert joints to one form, and append closures of the cut ones, constraints of couplings."""
    if mechanism.joints:
        joints, closures = joints_and_closures(
            mechanism.name, (mechanism.frame, mechanism.origin), mechanism.bodies, mechanism.joints
        )
        own = {closure.name for closure in closures}
        given = tuple(c for c in mechanism.closures if c.name not in own)
        object.__setattr__(mechanism, "joints", joints)
        object.__setattr__(mechanism, "closures", (*given, *closures))
        of_couplings = tuple(joint.constraint for joint in joints if isinstance(joint, CoupledPair))
        own = {constraint.name for constraint in of_couplings}
        others = tuple(c for c in mechanism.configuration_constraints if c.name not in own)
        object.__setattr__(mechanism, "configuration_constraints", (*others, *of_couplings))


def _bound_lengths(mechanism: Mechanism) -> None:
    """Bound the parameters that are lengths of rods to what a length is."""
    rods = {closure.length: closure.name for closure in mechanism.closures}
    parameters = list(mechanism.parameters)
    for k, parameter in enumerate(parameters):
        if parameter.symbol in rods:
            rod, given = rods[parameter.symbol], parameter.default
            if given is not None and as_expression(given, "length").is_nonpositive:
                raise MechanismError(
                    f"{mechanism.name}: the length {parameter.symbol} of the rod {rod} is "
                    f"positive, not {given}"
                )
            parameters[k] = replace(parameter, quantity=parameter.quantity.of_rod(rod))
    object.__setattr__(mechanism, "parameters", tuple(parameters))


def as_mapping(inputs: Any) -> dict[Any, Expr | None]:
    """Functions of time to their expressions; of one function, or several, all without."""
    if isinstance(inputs, Mapping):
        return dict(inputs)
    single = isinstance(inputs, (str, Basic)) or not isinstance(inputs, Iterable)
    several = [inputs] if single else list(inputs)
    if not all(isinstance(each, (str, Basic)) for each in several):
        raise MechanismError(
            f"inputs are given by name or symbol, {{F: expression}} or [F], not as {inputs!r}"
        )
    return dict.fromkeys(several)


def rates_of_states(states: Any) -> dict[Any, Any]:
    """State -> rate, of a mapping, :class:`State` objects, or objects that have x and rhs()."""
    if isinstance(states, Mapping):
        return dict(states)
    found: dict[Any, Any] = {}
    for one in list(states) if isinstance(states, Iterable) else [states]:
        if isinstance(one, State):
            found[one.symbol] = one.rate
        elif hasattr(one, "x") and hasattr(one, "rhs"):
            found |= zip(one.x, one.rhs(), strict=True)
        else:
            raise TypeError(
                "states are given as {state: its rate}, or as objects that have x and rhs(), such "
                f"as muscles, not as {one!r}"
            )
    return found


def _check_lengths(mechanism: Mechanism) -> None:
    if len(mechanism.kinematics) != len(mechanism.coordinates):
        raise MechanismError(
            f"{mechanism.name}: {len(mechanism.coordinates)} coordinates need as many kinematic "
            f"differential equations, {len(mechanism.kinematics)} were given"
        )
    given = mechanism.lagrangian is not None or mechanism.equations is not None
    if not mechanism.bodies and not given:
        raise MechanismError(f"{mechanism.name}: a mechanism needs at least one body")


def _check_names(mechanism: Mechanism) -> None:
    symbols = [*mechanism.q, *mechanism.x, *mechanism.u, *(p.symbol for p in mechanism.parameters)]
    symbols += mechanism.open_inputs
    _refuse_repeats("symbol", mechanism.name, [printed_name(s) for s in symbols])
    _refuse_repeats("point", mechanism.name, [p.name for p in mechanism.points])


def _check_units(mechanism: Mechanism) -> None:
    for kind in (mechanism.coordinates, mechanism.states, mechanism.speeds, mechanism.parameters):
        for each in kind:
            refuse_scaled(printed_name(each.symbol), each.quantity.unit)
    for symbol, unit in mechanism.input_units.items():
        refuse_scaled(printed_name(symbol), unit)


def _start_in_si(mechanism: Mechanism) -> Mapping[str, Any]:
    known: list[Any] = [*mechanism.coordinates, *mechanism.states, *mechanism.speeds]
    quantities = {printed_name(each.symbol): each.quantity for each in known}
    return {
        name: in_si(value, f"start: {name}", quantities[name]) if name in quantities else value
        for name, value in mechanism.start.items()
    }


def _check_states(mechanism: Mechanism) -> None:
    accelerations = {u.diff(dynamicsymbols._t) for u in mechanism.u}
    for state in mechanism.states:
        held = state.rate.atoms(Derivative) & accelerations
        if held:
            raise MechanismError(
                f"{mechanism.name}: the rate of {printed_name(state.symbol)} contains the "
                f"acceleration {min(map(str, held))}, which is not known before loads and states "
                "are: express it by the loads that cause it"
            )


def _refuse_repeats(kind: str, mechanism: str, names: list[str]) -> None:
    repeated = sorted({name for name in names if names.count(name) > 1})
    if repeated:
        raise MechanismError(
            f"{mechanism}: more than one {kind} is printed as {repeated[0]!r}; rename one of "
            "them so that results have different names"
        )


def _check_symbols(mechanism: Mechanism) -> None:
    known = {*mechanism.q, *mechanism.x, *mechanism.u, dynamicsymbols._t, *mechanism.rates}
    known |= {p.symbol for p in mechanism.parameters}
    specified = {*mechanism.inputs, *mechanism.auxiliary}
    known |= specified
    for place, expression in _expressions(mechanism):
        unknown = {
            x
            for x in _free_symbols(expression) - known
            if not (isinstance(x, Derivative) and x.expr in specified)
        }
        if unknown:
            name = printed_name(min(unknown, key=str))
            raise MechanismError(
                f"{mechanism.name}: {name!r} in {place} is neither a parameter, a coordinate nor "
                f"a speed of the mechanism; declare it, {_declaration(min(unknown, key=str))} (a "
                "Symbol and a dynamicsymbol of one name are different symbols)"
            )


def _declaration(unknown: Expr) -> str:
    name = printed_name(unknown)
    if isinstance(unknown, Symbol):
        return f"parameters=(..., mechc.Parameter({name}, 1.0, mechc.Quantity('m', '...')))"
    return f"inputs=[{name}] if it is given with a run, inputs={{{name}: expression}} if not"


def _refuse_impulses(mechanism: Mechanism) -> None:
    for place, expression in _expressions(mechanism):
        if expression.has(DiracDelta):
            raise MechanismError(
                f"{mechanism.name}: {place} has an impulse, DiracDelta, which lasts no time and "
                "which no integration of rates meets; use an event that resets the speeds"
            )


def _expressions(mechanism: Mechanism) -> Iterable[tuple[str, Expr]]:
    """The scalar expressions of the description, each with a name."""
    for q, rate in zip(mechanism.q, mechanism.kinematics, strict=True):
        yield f"the rate of {printed_name(q)}", rate
    for state in mechanism.states:
        yield f"the rate of {printed_name(state.symbol)}", state.rate
    for parameter in (p for p in mechanism.parameters if p.default is not None):
        place = f"the default of {parameter.symbol}"
        yield place, as_expression(parameter.default, place)
    if mechanism.equations is not None:
        yield from mechanism.equations.terms()
    for body in mechanism.bodies:
        yield f"the mass of {body.name}", sympify(body.mass)
        yield f"the potential energy of {body.name}", sympify(body.potential_energy)
    for constraint in (*mechanism.configuration_constraints, *mechanism.motion_constraints):
        yield f"the constraint {constraint.name}", constraint.expression
    for load_at, vector in mechanism.loads:
        yield from ((f"the load on {load_at.name}", c) for c in entries_of(vector))
    for added in mechanism.added_inertia:
        parts = (c for vector in added.per_acceleration for c in entries_of(vector))
        yield from ((f"the load on {added.place.name}", c) for c in parts)
    if mechanism.gravity is not None:
        yield from (("gravity", c) for c in entries_of(mechanism.gravity))
    for contact in mechanism.contacts:
        given = (contact.gap, contact.slip, contact.force)
        yield from (("a contact", sympify(each)) for each in given if each is not None)
    for closure in mechanism.closures:
        for axis in (*closure.axes, *(a for pair in closure.perpendicular for a in pair)):
            yield from ((f"an axis of {closure.name}", c) for c in entries_of(axis))
        if closure.length is not None:
            yield f"the length of {closure.name}", closure.length


def _free_symbols(expression: Expr) -> set[Expr]:
    """Symbols, functions of time and derivatives, without the parts of the latter."""
    stand_in = Symbol("_rate")
    derivatives = expression.atoms(Derivative)
    outside = expression.xreplace(dict.fromkeys(derivatives, stand_in))
    found: set[Expr] = outside.atoms(AppliedUndef) | outside.atoms(Symbol) | derivatives
    return found - {stand_in, dynamicsymbols._t}
