"""Wheels and slides that couplings join: centre, axis, and angle or way, on one carrier.

Whether axes are parallel is decided by numbers, at random values of all symbols.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, NamedTuple, Self

from sympy import Expr, S
from sympy.physics.mechanics import PinJoint, Point, PrismaticJoint, ReferenceFrame
from sympy.physics.vector import Vector

from mechc_codegen.description.joints.tree import Body
from mechc_codegen.description.placement import Placement, dot
from mechc_codegen.description.terms import vector_along
from mechc_codegen.errors import MechanismError

ROUNDING = 1e-12  # of vectors of length one
SAMPLES = 3


@dataclass(frozen=True)
class Wheel:
    """A body that turns about an axis by ``angle`` relative to the carrier.

    ``hub``: its point at ``centre``.  ``frame`` turns with it, and is ``still`` at angle 0.
    """

    body: Body
    carrier: Body
    centre: Point
    hub: Point
    axis: Vector
    angle: Expr
    still: ReferenceFrame
    frame: ReferenceFrame

    @classmethod
    def of(cls, name: str, pin: Any) -> Self:
        """The wheel that is the child of a pin."""
        _expect(PinJoint, pin, name)
        points = (pin.parent_point, pin.child_point)
        frames = (pin.parent_interframe, pin.child_interframe)
        axis = pin.joint_axis.normalize()
        return cls(pin.child, pin.parent, *points, axis, pin.coordinates[0], *frames)

    def rotate(self, vector: Vector) -> Vector:
        """The vector fixed to the wheel that equals this vector at angle 0."""
        return vector_along(vector.to_matrix(self.still), self.frame)


@dataclass(frozen=True)
class Slide:
    """A body that slides: its point is at ``start`` where ``way`` is 0."""

    body: Body
    carrier: Body
    start: Point
    point: Point
    direction: Vector
    way: Expr

    @classmethod
    def of(cls, name: str, slide: Any) -> Self:
        """The slide that is the child of a prismatic joint."""
        _expect(PrismaticJoint, slide, name)
        direction = slide.joint_axis.normalize()
        points = (slide.parent_point, slide.child_point)
        return cls(slide.child, slide.parent, *points, direction, slide.coordinates[0])


def _expect(kind: type, joint: Any, name: str) -> None:
    if not isinstance(joint, kind):
        raise MechanismError(
            f"the coupling {name}: {joint!r} is not a {kind.__name__} of sympy.physics.mechanics"
        )


class WheelPair(NamedTuple):
    """Two wheels with parallel axes on one carrier."""

    first: Wheel
    second: Wheel

    @property
    def distance(self) -> Vector:
        """The vector from the first centre to the second."""
        return self.second.centre.pos_from(self.first.centre)


def between(name: str, first: Any, second: Any, carrier: PinJoint | None) -> WheelPair:
    """The wheels of two pins, their angles relative to one carrier and about the first's axis.

    Raises
    ------
    MechanismError
        If their axes are not parallel, or coincide, or they are not on one carrier.
    """
    arm = None if carrier is None else Wheel.of(name, carrier)
    wheels = [_wheel(name, each, arm) for each in (first, second)]
    own = arm.body if arm else wheels[0].carrier
    wheels = [_relative(name, wheel, own, arm) for wheel in wheels]
    first, second = wheels
    sense = _sense(name, first, second)
    pair = WheelPair(first, replace(second, angle=sense * second.angle))
    across = pair.distance
    square, along = _dots(first, across, across), _dots(first, across, first.axis)
    if min(s - a * a for s, a in zip(square, along, strict=True)) < ROUNDING:
        raise MechanismError(
            f"the coupling {name}: the axes of {first.body.name} and {second.body.name} coincide"
        )
    return pair


def check_across(name: str, wheel: Wheel, slide: Slide) -> None:
    """Refuse a slide that is not across the axis, or on another carrier."""
    if wheel.carrier is not slide.carrier:
        raise MechanismError(
            f"the coupling {name}: its joints have different parents, {wheel.carrier.name} and "
            f"{slide.carrier.name}"
        )
    if max(abs(x) for x in _dots(wheel, wheel.axis, slide.direction)) > ROUNDING:
        raise MechanismError(f"the coupling {name}: the slide is not across the pin's axis")


def _wheel(name: str, given: Any, arm: Wheel | None) -> Wheel:
    if arm is not None and given is arm.carrier:
        frames = (arm.still, arm.still)
        return Wheel(given, given, arm.centre, arm.centre, arm.axis, S.Zero, *frames)
    return Wheel.of(name, given)


def _relative(name: str, wheel: Wheel, carrier: Body, arm: Wheel | None) -> Wheel:
    """The wheel with its angle measured relative to the carrier."""
    if wheel.carrier is carrier:
        return wheel
    if arm is None or wheel.carrier is not arm.carrier:
        raise MechanismError(
            f"the coupling {name}: {wheel.body.name} turns on {wheel.carrier.name}, which is not "
            f"the carrier, {carrier.name}: give pins with one parent, or carrier="
        )
    turn = _sense(name, wheel, arm) * arm.angle
    return replace(wheel, carrier=carrier, angle=wheel.angle - turn)


def _sense(name: str, first: Wheel, second: Wheel) -> Expr:
    """1 for axes in one direction, -1 for opposite ones."""
    values = _dots(first, first.axis, second.axis)
    if max(abs(abs(x) - 1) for x in values) > ROUNDING:
        raise MechanismError(
            f"the coupling {name}: the axes of {first.body.name} and {second.body.name} are not "
            "parallel"
        )
    return S.One if values[0] > 0 else S.NegativeOne


def _dots(wheel: Wheel, one: Vector, other: Vector) -> list[float]:
    found = []
    for seed in range(SAMPLES):
        at = Placement(wheel.frame, wheel.centre, seed)
        found.append(dot(at.vector(one), at.vector(other)))
    return found
