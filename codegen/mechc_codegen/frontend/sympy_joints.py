"""Joints of ``sympy.physics.mechanics``, and cuts -> Mechanism.

Bodies, coordinates, speeds, kinematics, points and the picture all follow from the joints.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from functools import reduce
from typing import Any

from sympy import Derivative, Expr, Symbol, sympify
from sympy.physics.mechanics import Point, ReferenceFrame, RigidBody, dynamicsymbols
from sympy.physics.vector import Vector

from mechc_codegen.convert.convert import chosen_inputs, find_symbol, number
from mechc_codegen.convert.fingerprint import Fingerprint
from mechc_codegen.convert.kinematics import coordinate_rates
from mechc_codegen.description.drawing import NO_DRAWING, muscles_in
from mechc_codegen.description.joints.couplings import CoupledPair
from mechc_codegen.description.joints.cuts import Cut
from mechc_codegen.description.joints.motors import Motor, drives_of
from mechc_codegen.description.joints.tree import (
    Body,
    Joint,
    check_joints,
    joint_of,
    joint_tree,
    refuse_unreached,
)
from mechc_codegen.description.mechanism import (
    Coordinate,
    Drawing,
    Mechanism,
    Parameter,
    Quantity,
    Speed,
    State,
    as_mapping,
    is_rigid,
    rates_of_states,
)
from mechc_codegen.description.quantity import in_si
from mechc_codegen.description.source import Key
from mechc_codegen.description.terms import printed_name, refuse_no_vector
from mechc_codegen.errors import MechanismError
from mechc_codegen.frontend.read import plain_loads, speed_of

_NOTHING = Quantity("", "")
CONSTRAINTS = ("configuration_constraints", "motion_constraints")


def from_joints(
    name: str,
    joints: Iterable[Any],
    *,
    ground: RigidBody | None = None,
    loads: Iterable[Any] = (),
    gravity: Vector | None = None,
    parameters: Mapping[Key, Any] | Iterable[Parameter] = (),
    units: Mapping[Key, str] | None = None,
    inputs: Mapping[Key, Any] | Iterable[Key] = (),
    motors: Iterable[Motor] = (),
    drawing: Drawing = NO_DRAWING,
    **more: Any,
) -> Mechanism:
    """A mechanism from joints, which define its bodies, coordinates, speeds and points.

    Parameters
    ----------
    joints
        Joints of ``sympy.physics.mechanics`` as they are, and a :class:`mechc.Cut` for every
        joint that closes a loop.  Coordinates and speeds come in their order.
    ground
        The body at rest, in whose frame and from whose mass centre everything is measured; the
        one that is the child of no joint by default.
    loads
        Forces, torques, ``(Point or frame, vector)`` pairs and actuators.
    gravity
        A uniform gravitational acceleration (m/s^2) that acts on every body.
    parameters
        Symbol or its printed name -> default value, in SI units or with one, ``"30 mm"``, or
        :class:`mechc.Parameter` objects.  Symbols that are not named have no default and need a
        value at every use.
    units
        Symbol or printed name -> unit, also of inputs and states.  Coordinates that turn are in
        rad, others in m.
    inputs
        Functions of time in loads, points and constraints that are no coordinate, speed or state
        -> expressions, as of motors.  Those without one, or with None, are found by themselves and
        given with a run: ``model.simulate(..., inputs={...})``.
    motors
        :class:`mechc.Motor` objects: what drives joints, by a motion or a torque.
    drawing
        Links, pivots and paths besides those of the joints.
    more
        Further fields of :class:`mechc.Mechanism`: ``title``, ``configuration_constraints``,
        ``motion_constraints``, ``points``, ``start``, ...; ``states`` also as {state: its rate},
        or objects that have ``x`` and ``rhs()``, such as muscles of
        ``sympy.physics.biomechanics``, which are loads too.

    Raises
    ------
    MechanismError
        If the joints do not form a tree, with cuts, on the ground; the message names the joint
        or body.
    """
    refuse_no_vector(gravity)
    given = [(joint, joint_of(joint)) for joint in joints]
    ground = ground or _ground(name, [joint for _, joint in given if not joint.is_cut])
    every = [joint.on_ground((ground,)) for _, joint in given]
    check_joints(name, every)
    states = _JointStates((old, new) for (old, _), new in zip(given, every, strict=True))
    held = {kind: tuple(more.get(kind, ())) for kind in CONSTRAINTS}
    drives = drives_of(
        motors, every, states.rates, [c.name for rows in held.values() for c in rows]
    )
    more |= {kind: (*rows, *getattr(drives, kind)) for kind, rows in held.items()}
    every += drives.rotors
    sides = dict.fromkeys(body for joint in every for body in (joint.parent, joint.child))
    bodies = [body for body in sides if body is not None]
    tree = joint_tree(every, bodies)
    refuse_unreached(name, tree)
    loads = tuple(loads)
    drawing = drawing.plus(Drawing(muscles=muscles_in(loads)))
    loads = (*plain_loads(loads), *drives.loads)
    couplings = [joint for joint in every if isinstance(joint, CoupledPair)]
    lengths = [joint.length for joint in every if isinstance(joint, Cut) and joint.length]
    given_inputs = as_mapping(inputs)
    added = _states(more.pop("states", ()))
    rates = [*filter(None, given_inputs.values()), *(s.rate for s in added)]
    expressions = [*rates, *lengths, *drives.factors]
    expressions += [c.constraint.expression for c in couplings]
    expressions += [row.expression for kind in CONSTRAINTS for row in more[kind]]
    vectors = [*(vector for _, vector in loads), *([gravity] if gravity else [])]
    leaves = leaves_of((ground.frame, ground.masscenter), bodies, vectors, expressions)
    found = constants_in(leaves)
    own = {
        *states.q,
        *states.u,
        *(s.symbol for s in added),
        *more.get("auxiliary", ()),
    }
    functions = sorted((x for x in leaves - own if not isinstance(x, Symbol)), key=str)
    units = units or {}
    listed = parameters_of(parameters, found, units, drives.quantities)
    named = _Names(states, units, listed, [*functions, *own])
    places = _JointPoints(every, bodies)
    return Mechanism(
        name=name,
        frame=ground.frame,
        origin=ground.masscenter,
        coordinates=tuple(Coordinate(q, named.quantity(q)) for q in states.q),
        speeds=tuple(Speed(u, named.quantity(u)) for u in states.u),
        kinematics=states.kinematics,
        parameters=named.parameters,
        bodies=tuple(bodies),
        loads=loads,
        gravity=gravity,
        joints=tuple(every),
        outputs={**more.pop("outputs", {}), **drives.outputs},
        **{"title": name, "points": places.points, **more},
        inputs=chosen_inputs(functions, given_inputs),
        input_units={f: named.given[f] for f in functions if f in named.given},
        states=tuple(replace(s, quantity=named.of_state(s)) for s in added),
        drawing=reduce(Drawing.plus, [*(c.drawing for c in couplings), drawing], places.drawing()),
    )


def _states(given: Any) -> tuple[State, ...]:
    """Additional states, as they are, of a mapping of rates, or of muscles."""
    listed = not isinstance(given, Mapping) and isinstance(given, Iterable)
    described = {x.symbol: x for x in given if isinstance(x, State)} if listed else {}
    return tuple(
        described.get(x) or State(x, sympify(rate), _NOTHING)
        for x, rate in rates_of_states(given).items()
    )


# -- bodies ---------------------------------------------------------------------------------------


def _ground(name: str, joints: Sequence[Joint]) -> RigidBody:
    """The root of the tree that these joints are."""
    children = {joint.child for joint in joints}
    parents: dict[Any, None] = dict.fromkeys(joint.parent for joint in joints)
    candidates = [body for body in parents if body is not None and body not in children]
    if len(candidates) == 1 and is_rigid(candidates[0]):
        return candidates[0]
    names = ", ".join(body.name for body in candidates) or "none"
    raise MechanismError(
        f"{name}: the ground is the one rigid body that is no child of a joint, but here these are "
        f"{names}; give ground=..."
    )


# -- coordinates, speeds, kinematics --------------------------------------------------------------


class _JointStates:
    """Coordinates, speeds, the coordinates' rates, and the joint of each; joints as given and as
    described."""

    def __init__(self, joints: Iterable[tuple[Any, Joint]]) -> None:
        q, u, equations = list[Any](), list[Any](), list[Expr]()
        self.of_joint, self.units = dict[Expr, str](), dict[Expr, str]()
        self.turning = set[Expr]()
        for given, joint in joints:
            speeds = [speed_of(s.expr) if isinstance(s, Derivative) else s for s in joint.speeds]
            if hasattr(given, "kdes") and speeds == list(joint.speeds):
                equations += list(given.kdes)
            else:
                rates = [x.diff(dynamicsymbols._t) for x in joint.coordinates]
                equations += [a - b for a, b in zip(rates, speeds, strict=True)]
            q += joint.coordinates
            u += speeds
            self.of_joint |= dict.fromkeys((*joint.coordinates, *speeds), joint.name)
            self.turning |= _turning(joint)
            units = getattr(given, "units", ())
            self.units |= dict(zip((*joint.coordinates, *speeds), units, strict=False))
        self.q, self.u, self.kinematics = tuple(q), tuple(u), coordinate_rates(equations, q)
        pairs = zip(self.q, self.kinematics, strict=True)
        self.rates = {q: rate for q, rate in pairs if rate in self.u}


def _turning(joint: Joint) -> set[Expr]:
    """Coordinates that turn the child relative to the parent."""
    if joint.parent_interframe is None or joint.child_interframe is None:
        return set()
    turn = joint.parent_interframe.dcm(joint.child_interframe)
    return {q for q in joint.coordinates if turn.has(q)}


# -- names, units, parameters ---------------------------------------------------------------------


class _Names:
    """Quantities of coordinates and speeds, and parameters with their units."""

    def __init__(
        self, states: _JointStates, units: Mapping[Key, str], parameters: Sequence[Parameter],
        functions: Iterable[Expr],
    ) -> None:  # fmt: skip
        known = [*dict.fromkeys((*(p.symbol for p in parameters), *functions))]
        self.states = states
        self.given = {find_symbol(key, known, "units", "symbol"): u for key, u in units.items()}
        self.parameters = tuple(
            replace(p, quantity=p.quantity.with_unit(self.given[p.symbol]))
            if p.symbol in self.given
            else p
            for p in parameters
        )
        self._rate_of = {rate: q for q, rate in states.rates.items()}

    def quantity(self, symbol: Expr) -> Quantity:
        return Quantity(self._unit(symbol), f"of the joint {self.states.of_joint[symbol]}")

    def of_state(self, state: State) -> Quantity:
        unit = self.given.get(state.symbol)
        return state.quantity if unit is None else state.quantity.with_unit(str(unit))

    def _unit(self, symbol: Expr) -> str:
        if symbol in self.given:
            return str(self.given[symbol])
        if symbol in self.states.units:
            return self.states.units[symbol]
        if symbol in self.states.q:
            return "rad" if symbol in self.states.turning else "m"
        return f"{self._unit(self._rate_of[symbol])}/s" if symbol in self._rate_of else ""


def leaves_of(
    ground: tuple[ReferenceFrame, Point],
    bodies: Iterable[Body],
    vectors: Iterable[Vector],
    expressions: Iterable[Any],
) -> set[Expr]:
    """All constants and functions of time in parts of a description."""
    text = Fingerprint(ground[0])
    text.point(ground[1])
    for body in bodies:
        text.point(body.masscenter)
        text.expression(sympify(body.mass))
        if is_rigid(body):
            text.dyadic(body.central_inertia)
    for vector in vectors:
        text.vector(vector)
    for expression in expressions:
        text.expression(sympify(expression))
    return text.leaves - {dynamicsymbols._t}


def constants_in(leaves: Iterable[Expr]) -> list[Symbol]:
    """The symbols among these, by name."""
    found = (x for x in leaves if isinstance(x, Symbol))
    return sorted(found, key=lambda s: (s.name, str(s.assumptions0)))


def parameters_of(
    given: Mapping[Key, Any] | Iterable[Parameter], found: Sequence[Symbol],
    units: Mapping[Key, str], quantities: Mapping[Symbol, Quantity],
) -> list[Parameter]:  # fmt: skip
    """The parameters given, in their order, then the others found."""
    if isinstance(given, Mapping):
        unknown = [k for k in given if isinstance(k, Symbol) and k not in found]
        known = [*found, *unknown]
        named = {find_symbol(k, known, "parameters", "parameter"): x for k, x in given.items()}

        def quantity(symbol: Symbol) -> Quantity:
            unit = units.get(symbol, units.get(printed_name(symbol)))
            return quantities.get(symbol, _NOTHING) if unit is None else Quantity(str(unit), "")

        listed = [
            Parameter(s, number(in_si(value, printed_name(s), quantity(s))), quantity(s))
            for s, value in named.items()
        ]
    else:
        listed = list(given)
    declared = {p.symbol for p in listed}
    others = [s for s in found if s not in declared]
    return [*listed, *(Parameter(s, None, quantities.get(s, _NOTHING)) for s in others)]


# -- points and the picture -----------------------------------------------------------------------


class _JointPoints:
    """Joint points and mass centres, each place once, the first of each name."""

    def __init__(self, joints: Sequence[Joint], bodies: Sequence[Body]) -> None:
        self.joints = [joint for joint in joints if not isinstance(joint, CoupledPair)]
        self.bodies = bodies
        sides = [point for j in joints for point in (j.parent_point, j.child_point)]
        every = [self.place(point) for point in (*sides, *(body.masscenter for body in bodies))]
        named: dict[str, Point] = {}
        for point in every:
            named.setdefault(point.name, point)
        self.points = tuple(named.values())

    def place(self, point: Point) -> Point:
        """The first point among those that coincide in every configuration."""
        for other, way in point._pos_dict.items():
            for joint in self.joints:
                if (other, point) == (joint.parent_point, joint.child_point) and way == 0:
                    return other
        return point

    def drawing(self) -> Drawing:
        links = [(body.name, self._line(body)) for body in self.bodies]
        rods = (joint for joint in self.joints if isinstance(joint, Cut) and joint.length)
        for rod in rods:
            ends = map(self._same_in_list, (rod.parent_point, rod.child_point))
            links.append((rod.name, tuple(end.name for end in ends)))
        pivots = [joint for joint in self.joints if self._holds_its_point(joint)]
        ground = dict.fromkeys(p.name for p in self._on(None, pivots))
        return Drawing(
            links=tuple((name, line) for name, line in links if len(line) > 1),
            ground=tuple(ground),
        )

    def _line(self, body: Body) -> tuple[str, ...]:
        """The polyline of a body through its joints, and its mass centre if there is one joint."""
        names = dict.fromkeys(p.name for p in self._on(body))
        if len(names) < 2:
            names[self._same_in_list(body.masscenter).name] = None
        return tuple(names)

    def _holds_its_point(self, joint: Joint) -> bool:
        """Whether a joint holds the point of each body: a slide is no pivot."""
        if isinstance(joint, Cut):
            return joint.axes is None or joint.length is not None
        return self.place(joint.child_point) is self.place(joint.parent_point)

    def _on(self, body: Body | None, joints: Sequence[Joint] | None = None) -> Iterable[Point]:
        for joint in self.joints if joints is None else joints:
            if joint.parent is body:
                yield self._same_in_list(joint.parent_point)
            if joint.child is body:
                yield self._same_in_list(joint.child_point)

    def _same_in_list(self, point: Point) -> Point:
        place = self.place(point)
        return next((p for p in self.points if p.name == place.name), place)
