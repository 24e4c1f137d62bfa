"""The drawing of couplings: rims with a spoke, strands, racks, profiles of cams.

Polylines through points that are fixed to the bodies; they are located from points of the joints.
"""

from __future__ import annotations

from collections.abc import Iterable

from sympy import Expr, Rational, cos, pi, sin, sqrt
from sympy.physics.mechanics import Point
from sympy.physics.vector import Vector

from mechc_codegen.description.drawing import Link
from mechc_codegen.description.joints.cuts import across
from mechc_codegen.description.terms import vector_along
from mechc_codegen.joints.wheels import Slide, Wheel, WheelPair

CORNERS = 24
PROFILE = 72


def rim(name: str, wheel: Wheel, radius: Expr) -> tuple[Link, ...]:
    """A circle about a wheel's axis with a spoke."""
    start = radius * wheel.rotate(_beside(wheel))
    axis = wheel.rotate(wheel.axis)
    turns = (2 * pi * Rational(k, CORNERS) for k in range(CORNERS))
    arms = (_rotate(start, axis, turn) for turn in turns)
    points = _points(f"{name}_{wheel.body.name}", wheel.hub, arms)
    return ((str(wheel.body.name), (wheel.hub, *points, points[0])),)


def strands(name: str, pair: WheelPair, one: Expr, other: Expr) -> tuple[Link, ...]:
    """The two straight parts of a belt; ``other`` is negative for an open belt."""
    n, distance = pair[0].axis, pair.distance
    length = sqrt(distance.dot(distance))
    along, beside = distance / length, n.cross(distance) / length
    slope = (one + other) / length
    links = []
    for side, sign in (("a", 1), ("b", -1)):
        normal = slope * along + sign * sqrt(1 - slope**2) * beside
        ends = _points(f"{name}_{side}", pair[0].centre, [one * normal, distance - other * normal])
        links.append((name, tuple(ends)))
    return tuple(links)


def rack(name: str, slide: Slide, touch: Point, radius: Expr) -> tuple[Link, ...]:
    """The pitch line, half a turn of the pinion to each side."""
    foot = touch.pos_from(slide.start)
    ways = [foot + sign * pi * radius * slide.direction for sign in (-1, 1)]
    return ((str(slide.body.name), tuple(_points(f"{name}_rack", slide.point, ways))),)


def profile(name: str, wheel: Wheel, slide: Slide, lift: Expr, flat: bool) -> tuple[Link, ...]:
    """The curve that the contact, or the roller's centre, draws on the cam in one turn."""
    d, n = slide.direction, wheel.axis
    beside, foot = n.cross(d), slide.start.pos_from(wheel.centre)
    offset = -lift.diff(wheel.angle) if flat else foot.dot(beside)
    arms, axis = [], wheel.rotate(n)
    for k in range(PROFILE):
        turn = 2 * pi * Rational(k, PROFILE)
        at = {wheel.angle: turn}
        touch = (foot.dot(d) + lift).subs(at) * d + offset.subs(at) * beside
        arms.append(_rotate(wheel.rotate(touch), axis, -turn))
    points = _points(f"{name}_profile", wheel.hub, arms)
    curve = (str(wheel.body.name), (*points, points[0], wheel.hub))
    return (curve, *_follower(name, slide, foot.dot(d), beside, flat))


def _follower(name: str, slide: Slide, size: Expr, beside: Vector, flat: bool) -> tuple[Link, ...]:
    """A stem, and the plane across it of a flat follower."""
    label, point = str(slide.body.name), slide.point
    (top,) = _points(f"{name}_stem", point, [size * slide.direction])
    stem = (label, (point, top))
    if not flat:
        return (stem,)
    ends = _points(f"{name}_plane", point, [-size / 2 * beside, size / 2 * beside])
    return (stem, (label, tuple(ends)))


def _beside(wheel: Wheel) -> Vector:
    """A unit vector across a wheel's axis."""
    return vector_along(across(tuple(wheel.axis.to_matrix(wheel.still)))[0], wheel.still)


def _rotate(vector: Vector, axis: Vector, angle: Expr) -> Vector:
    """A vector perpendicular to the axis, rotated about it by Rodrigues' formula."""
    return cos(angle) * vector + sin(angle) * axis.cross(vector)


def _points(name: str, origin: Point, arms: Iterable[Vector]) -> list[Point]:
    """Points whose names begin with a dot: they are not joints and are drawn without a mark."""
    return [origin.locatenew(f".{name}_{k}", arm) for k, arm in enumerate(arms)]
