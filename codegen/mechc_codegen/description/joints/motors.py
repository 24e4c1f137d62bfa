"""Motors: what drives one coordinate of a joint -> loads, constraints, rotors and outputs.

The axis of a coordinate q with q' = u is how the child's velocity against the parent depends on u.
A torque about it, or a force along it, on the child and its opposite on the parent, does the power
torque * u: that follows from the axis being of length one, and across those of the joint's other
coordinates.  A motion that is given is a constraint, and the motor does -lambda on u.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, field
from math import inf
from typing import Any

from sympy import Expr, S, Symbol, simplify
from sympy.core.function import AppliedUndef
from sympy.physics.mechanics import ReferenceFrame, RigidBody, dynamicsymbols
from sympy.physics.vector import Vector, outer

from mechc_codegen.description.constraints import Constraint
from mechc_codegen.description.joints.tree import Joint
from mechc_codegen.description.quantity import Quantity
from mechc_codegen.description.terms import (
    Load,
    as_expression,
    multiplier,
    printed_name,
    vector_along,
    within,
)
from mechc_codegen.errors import MechanismError

UNITS = {"torque": "N m", "force": "N", "angle": "rad", "position": "m"}
GIVEN = ("speed", *UNITS)
ROUNDING = 1e-12


@dataclass(frozen=True, eq=False)
class Motor:
    """What drives a joint, given to ``mechc.from_joints(..., motors=[...])``.

    Its torque (or force) and its power are outputs of the model, ``NAME_torque`` (``NAME_force``)
    in N m (N) and ``NAME_power`` in W.  A positive torque drives the child in the direction of the
    joint's coordinate; a positive power is given to the mechanism.

    Parameters
    ----------
    joint
        The joint or its name; of one with several coordinates the coordinate that it drives, or
        its name.  The joint has an axis: a pin, slide, screw, cylindrical, planar or universal
        joint, not a cut.
    speed, angle, position
        The motion of the joint: its speed (rad/s or m/s), its angle (rad), or of a slide its
        position (m), an expression of time, parameters and inputs, held by a constraint NAME.
    torque, force
        The motor's torque (N m), or of a slide its force (N): an expression that may also contain
        coordinates and speeds.  Of ``speed`` to ``force`` one is given.
    gear
        Turns of the rotor for one of the joint, or for a slide rad/m, with which its motor has a
        torque.  Torque, effort and inertia are those of the rotor, before the gear; speed, angle
        and position those of the joint.  The gear has no losses.  By default 1.
    effort
        The largest size of a torque or force that is given; beyond it the motor saturates.
    inertia
        Of the rotor about its axis (kg m^2).  It turns with ``gear`` times the joint's speed
        against the parent, in whose body its mass is.
    name
        By default the name of the joint, or of the coordinate that is given in its place.

    Raises
    ------
    MechanismError
        When it is given to a mechanism, if it does not fit the joint; the message names both.

    Examples
    --------
    >>> motors = [mechc.Motor("shoulder", angle=path, gear=50, inertia=1e-5)]
    >>> arm = mechc.from_joints("arm", joints, motors=motors)
    >>> mechc.compile(arm).simulate(2.0).plot("shoulder_torque")
    """

    joint: Any
    _: KW_ONLY
    speed: Any = None
    angle: Any = None
    position: Any = None
    torque: Any = None
    force: Any = None
    gear: Any = None
    effort: Any = None
    inertia: Any = None
    name: str = ""


@dataclass
class Drives:
    """What motors add to a mechanism.

    Attributes
    ----------
    loads, configuration_constraints, motion_constraints
        In the order of the motors.
    rotors
        Joints without coordinates, whose children are the rotors.
    outputs
        Name -> expression and unit.
    factors
        The gears, which may be in outputs alone.
    quantities
        Of the parameters that a motor is given as they are.
    """

    loads: list[Load] = field(default_factory=list)
    configuration_constraints: list[Constraint] = field(default_factory=list)
    motion_constraints: list[Constraint] = field(default_factory=list)
    rotors: list[Joint] = field(default_factory=list)
    outputs: dict[str, tuple[Expr, str]] = field(default_factory=dict)
    factors: list[Expr] = field(default_factory=list)
    quantities: dict[Symbol, Quantity] = field(default_factory=dict)


def drives_of(
    motors: Iterable[Motor], joints: Sequence[Joint], rates: Mapping[Expr, Expr],
    taken: Collection[str],
) -> Drives:  # fmt: skip
    """What these motors add to joints on the ground.

    ``rates``: of the coordinates whose rate is a speed; ``taken``: names of constraints.

    Raises
    ------
    MechanismError
        For a motor that does not fit its joint, and names that are used twice.
    """
    drives, names = Drives(), {*taken}
    states = {x for joint in joints for x in (*joint.coordinates, *joint.speeds)}
    for motor in motors:
        if not isinstance(motor, Motor):
            raise MechanismError(f"motors are mechc.Motor(joint, ...), not {str(motor)[:60]}")
        joint, q = _driven_coordinate(motor, joints)
        driven = _Driven(motor, joint, q, rates, states, drives)
        others = {other.name for other in joints if other is not joint}
        if {driven.name, driven.rotor} & (names | others):
            raise MechanismError(
                f"a motor is called {driven.name}, as another motor, joint or constraint is: give "
                "it another name, mechc.Motor(..., name=...)"
            )
        names.add(driven.name)
        driven.add()
    return drives


def _driven_coordinate(motor: Motor, joints: Sequence[Joint]) -> tuple[Joint, Expr]:
    """The joint and the coordinate that a motor drives."""
    given = motor.joint
    named = given if isinstance(given, str) else getattr(given, "name", None)
    if not isinstance(given, AppliedUndef):
        for joint in (each for each in joints if each.name == named):
            if len(joint.coordinates) == 1:
                return joint, joint.coordinates[0]
            held = ", ".join(map(printed_name, joint.coordinates))
            what = (
                f"has the coordinates {held}: give the one that the motor drives"
                if held
                else "has no coordinate, as a cut or a weld: drive another joint of the loop"
            )
            raise MechanismError(f"the motor of {named}: this joint {what}")
    for joint in joints:
        for q in joint.coordinates:
            if given in (q, printed_name(q)):
                return joint, q
    known = ", ".join(joint.name for joint in joints if joint.coordinates)
    raise MechanismError(
        f"a motor drives {named or given}, which is no joint and no coordinate of one; the joints "
        f"are {known}"
    )


def _vanishes(value: Expr) -> bool:
    """Whether a number of the size of one is zero but for rounding."""
    rest = simplify(value)
    return bool(rest.is_number and abs(rest) < ROUNDING)


class _Driven:
    """A motor with the coordinate q that it drives, and what it adds to the drives of all.

    ``unit``: of q.  ``axis``: its direction in the parent.  ``effort``: ``"torque"`` or, of a slide
    without a gear, ``"force"``.
    """

    def __init__(
        self, motor: Motor, joint: Joint, q: Expr, rates: Mapping[Expr, Expr],
        states: Collection[Expr], drives: Drives,
    ) -> None:  # fmt: skip
        self.motor, self.joint, self.q, self.drives = motor, joint, q, drives
        self.rates, self.states = rates, {*states, *rates.values()}
        self.name = motor.name or (joint.name if len(joint.coordinates) == 1 else printed_name(q))
        self.rotor = f"{self.name} rotor"
        self.unit, self.axis = self._axis()
        self.effort = "force" if self.unit == "m" and motor.gear is None else "torque"

    def add(self) -> None:
        what, given = self._given()
        gear = self._size("gear", "rad/m" if self.unit == "m" else "1")
        value = self._value(what, given, UNITS.get(what, f"{self.unit}/s"))
        if what == self.effort:
            bound = self._size("effort", UNITS[what])
            value = value if bound is None else within((-bound, bound), value)
            self.drives.loads += self._loads(value if gear is None else gear * value)
        else:
            self._hold(what, value)
            value = -multiplier(self.name) / (1 if gear is None else gear)
        speed = self.rates[self.q] * (1 if gear is None else gear)
        self.drives.outputs[self._output(self.effort)] = value, UNITS[self.effort]
        self.drives.outputs[self._output("power")] = value * speed, "W"
        inertia = self._size("inertia", "kg m^2")
        if inertia is not None:
            self.drives.rotors.append(self._rotor(inertia, speed))
        self.drives.factors += [] if gear is None else [gear]

    # -- what is given ----------------------------------------------------------------------

    def _given(self) -> tuple[str, Any]:
        """What is known of the motor, and its value."""
        values = {what: getattr(self.motor, what) for what in GIVEN}
        found = {what: value for what, value in values.items() if value is not None}
        fitting = ("speed", "angle" if self.unit == "rad" else "position", self.effort)
        if len(found) != 1 or not found.keys() <= {*fitting}:
            moves = "turns" if self.unit == "rad" else "slides"
            geared = ", with a gear in rad/m" * (self.unit == "m" and self.effort == "torque")
            raise self._error(
                f"the joint {self.joint.name} {moves}{geared}: give one of "
                f"{', '.join(f'{each}=' for each in fitting)}, not "
                f"{' and '.join(f'{each}=' for each in found) or 'none of them'}"
            )
        return next(iter(found.items()))

    def _value(self, what: str, given: Any, unit: str, lower: float = -inf) -> Expr:
        """An expression; a parameter that stands alone gets a unit and a bound."""
        value = as_expression(given, f"the motor {self.name}: {what}")
        if isinstance(value, Symbol) and value != dynamicsymbols._t:
            told = f"{what} of the motor {self.name}"
            self.drives.quantities[value] = Quantity(unit, told, lower)
        return value

    def _size(self, what: str, unit: str) -> Expr | None:
        """The gear, the effort or the inertia: a number or an expression of parameters."""
        given = getattr(self.motor, what)
        if given is None:
            return None
        value = self._value(what, given, unit, -inf if what == "gear" else 0.0)
        if value.atoms(AppliedUndef) or value.has(dynamicsymbols._t):
            raise self._error(f"{what}={given} varies with time: give a number or a parameter")
        signed = value.is_zero is False if what == "gear" else value.is_positive
        if value.is_number and not (value.is_real and value.is_finite and signed):
            kind = "a number other than zero" if what == "gear" else "a positive number"
            raise self._error(f"{what}={given} must be {kind}")
        return value

    def _output(self, what: str) -> str:
        return re.sub(r"\W", "_", f"{self.name}_{what}")

    def _error(self, words: str) -> MechanismError:
        return MechanismError(f"the motor {self.name}: {words}")

    # -- what it adds -----------------------------------------------------------------------

    def _axis(self) -> tuple[str, Vector]:
        """The unit of the coordinate, and its direction.

        It must be of length one and across those of the joint's other coordinates.
        """
        found = {x: self._direction(x) for x in self.joint.coordinates if x in self.rates}
        own = found.pop(self.q, ("", Vector(0)))
        known = len(found) == len(self.joint.coordinates) - 1
        alike = (axis for unit, axis in found.values() if unit == own[0])
        apart = [own[1].dot(own[1]) - 1, *(own[1].dot(axis) for axis in alike)]
        if not known or not all(map(_vanishes, apart)):
            raise self._error(
                f"{printed_name(self.q)} of the joint {self.joint.name} is no turn about an axis, "
                "nor a slide along one, by itself, so no torque or force belongs to it"
            )
        return own

    def _direction(self, q: Expr) -> tuple[str, Vector]:
        """How a coordinate moves the child in the parent: the unit, and the axis or the way."""
        joint, parent = self.joint, self.joint.parent_interframe
        if parent is None or joint.child_interframe is None:
            return "", Vector(0)
        spin = joint.child_interframe.ang_vel_in(parent).to_matrix(parent)
        rates = {x.diff(dynamicsymbols._t): u for x, u in self.rates.items()}
        axis = vector_along([x.xreplace(rates).diff(self.rates[q]) for x in spin], parent)
        if axis != 0:
            return "rad", axis
        place = joint.child_point.pos_from(joint.parent_point).to_matrix(parent)
        return "m", vector_along([x.diff(q) for x in place], parent)

    def _hold(self, what: str, value: Expr) -> None:
        """Add the constraint of a motion that is given."""
        if self.motor.effort is not None:
            raise self._error(
                f"a motion that is given takes the {self.effort} that it needs, so it has no "
                f"effort=: compare the output {self._output(self.effort)} with it"
            )
        held = value.atoms(AppliedUndef) & self.states
        if held:
            raise self._error(
                f"{what}= contains {printed_name(min(held, key=str))}, of the mechanism: a motion "
                "that is given is an expression of time, parameters and inputs; joints that move "
                "together are a mechc.Coupling or a constraint"
            )
        constraints, moves, unit = self.drives.configuration_constraints, self.q, self.unit
        if what == "speed":
            constraints, moves = self.drives.motion_constraints, self.rates[self.q]
            unit += "/s"
        constraints.append(Constraint(self.name, moves - value, unit))

    def _loads(self, size: Expr) -> list[Load]:
        """A torque about the axis or a force along it, on the child, and its opposite."""
        joint, along = self.joint, size * self.axis
        child, parent = joint.child_interframe, joint.parent_interframe
        pairs: list[Any] = [(joint.child, child, along), (joint.parent, parent, -along)]
        if self.unit == "m":
            arm = joint.child_point.pos_from(joint.parent_point)
            pairs = [(joint.child, joint.child_point, along)]
            pairs += [(joint.parent, joint.parent_point, -along)]
            pairs += [(joint.parent, parent, -arm.cross(along))]
        return [(place, load) for body, place, load in pairs if body is not None and load != 0]

    def _rotor(self, inertia: Expr, speed: Expr) -> Joint:
        """The rotor, a body without mass that turns against the parent."""
        joint, still = self.joint, self.joint.parent_interframe
        assert still is not None
        if self.effort == "force":
            raise self._error(
                "without gear= in rad/m nothing turns, so it has no inertia=: add the mass that it "
                "moves to that of the child"
            )
        along = self.axis.to_matrix(still)
        if along.atoms(AppliedUndef):
            raise self._error("its axis turns against the parent, so it has no inertia=")
        frame = ReferenceFrame(self.rotor)
        frame.orient_axis(still, self.axis, speed.xreplace({self.rates[self.q]: self.q}))
        frame.set_ang_vel(still, speed * self.axis)
        centre = joint.parent_point.locatenew(frame.name, Vector(0))
        axis = vector_along(along, frame)
        body = RigidBody(frame.name, centre, frame, S.Zero, (inertia * outer(axis, axis), centre))
        return Joint(frame.name, joint.parent, body, joint.parent_point, centre, still, frame)
