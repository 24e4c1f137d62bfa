"""The joints of a mechanism in one form, and the closures of its cut joints.

Constraints of a cut joint that always hold in this mechanism, such as those across the plane of a
planar one, are omitted; so are pairs of aligned axes that always point the same way.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import compress
from typing import Any

from sympy.physics.mechanics import Point, ReferenceFrame
from sympy.physics.vector import Vector

from mechc_codegen.description.constraints import Closure
from mechc_codegen.description.joints.cuts import Cut
from mechc_codegen.description.joints.tree import Body, Joint, check_joints, joint_of
from mechc_codegen.description.placement import Number3, Placement, dot, minus
from mechc_codegen.errors import MechanismError

SAMPLES = 3
Axes = tuple[Vector, Vector]
ROUNDING = 1e-12  # of values of the order of one


def joints_and_closures(
    name: str,
    place: tuple[ReferenceFrame, Point],
    bodies: Sequence[Body],
    given: Iterable[Any],
) -> tuple[tuple[Joint, ...], tuple[Closure, ...]]:
    """Joints with None for the ground, and the closures of the cut ones.

    ``place``: the inertial frame and the origin.

    Raises
    ------
    MechanismError
        If they are not a tree with cuts, or one joins an unknown body.
    """
    joints = tuple(_with_ground(name, place[0], bodies, joint_of(joint)) for joint in given)
    check_joints(name, joints)
    placements = [Placement(*place, seed) for seed in range(SAMPLES)]
    closures = [
        _without_idle(joint.closure(place[0]), placements)
        for joint in joints
        if isinstance(joint, Cut)
    ]
    return joints, tuple(c for c in closures if c.rows)


def _with_ground(name: str, frame: ReferenceFrame, bodies: Sequence[Body], joint: Joint) -> Joint:
    others = [b for b in (joint.parent, joint.child) if b is not None and b not in bodies]
    for body in others:
        if getattr(body, "frame", None) is not frame:
            raise MechanismError(
                f"{name}: the joint {joint.name} joins {body.name}, which is not among the bodies"
            )
    return joint.on_ground(others)


def _without_idle(closure: Closure, placements: Sequence[Placement]) -> Closure:
    """The closure without constraints that vanish in every configuration."""
    every = _moving(closure, placements)
    moving = iter(every)
    axes = tuple(axis for axis in closure.axes if next(moving))
    length = closure.length if closure.length is not None and next(moving) else None
    if length is not None:
        _refuse_rigid(closure, placements[0])
    return replace(
        closure,
        axes=axes,
        length=length,
        perpendicular=tuple(pair for pair in closure.perpendicular if next(moving)),
        aligned=tuple(_turning(closure, placements)),
        labels=tuple(compress(closure.labels, every)),
    )


def _refuse_rigid(closure: Closure, placement: Placement) -> None:
    """Refuse a rod between points whose distance no motion changes."""
    one, other = (_length(_gap(closure, at)) for at in (placement, placement.moved(SAMPLES)))
    if abs(one - other) > ROUNDING * max(one, other):
        return
    ends = f"{closure.target.name} and {closure.point.name}"
    if max(one, other) <= ROUNDING:
        raise MechanismError(
            f"the rod {closure.name}: its points {ends} coincide in every configuration; for "
            "bodies that share a point write mechc.Cut.spherical, or mechc.Cut.pin"
        )
    raise MechanismError(
        f"the rod {closure.name}: its points {ends} keep their distance in every configuration, "
        "as two points of one body do, so the rod cannot hold its length; give a point of each of "
        "two bodies that move relative to each other"
    )


def _gap(closure: Closure, placement: Placement) -> Number3:
    return minus(*(_position(closure.name, p, placement) for p in (closure.point, closure.target)))


def _length(vector: Number3) -> float:
    return math.sqrt(dot(vector, vector))


def _turning(closure: Closure, placements: Sequence[Placement]) -> Iterator[Axes]:
    """The pairs of aligned axes that do not point the same way in every configuration."""
    for one, other in closure.aligned:
        cosines = [_cosine(one, other, placement) for placement in placements]
        if max(cosines) < ROUNDING - 1.0:
            raise MechanismError(
                f"the joint {closure.name}: {one} of the child points against {other} of the "
                "parent in every configuration; turn child_interframe by half a turn"
            )
        if min(cosines) < 1.0 - ROUNDING:
            yield one, other


def _cosine(one: Vector, other: Vector, placement: Placement) -> float:
    return float(dot(placement.vector(one), placement.vector(other)))


def _moving(closure: Closure, placements: Sequence[Placement]) -> list[bool]:
    values = [_values(closure, placement) for placement in placements]
    return [max(map(abs, row)) > ROUNDING for row in zip(*values, strict=True)]


def _values(closure: Closure, placement: Placement) -> list[float]:
    gap = _gap(closure, placement)
    along = [dot(gap, placement.vector(axis)) for axis in closure.axes]
    if closure.length is not None:
        along.append(_length(gap) - placement.value(closure.length))
    return along + [_cosine(*pair, placement) for pair in closure.perpendicular]


def _position(name: str, point: Point, placement: Placement) -> Sequence[float]:
    try:
        return placement.position(point)
    except KeyError:
        raise MechanismError(
            f"the joint {name}: the point {point.name} is not located from the origin; set its "
            "position with set_pos or locatenew, or check that its body is joined to the ground"
        ) from None
