"""The joints of a mechanism in one form, and the closures of its cut joints.

Constraints of a cut joint that always hold in this mechanism, such as those across the plane of a
planar one, are omitted; so are pairs of aligned axes that always point the same way.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from typing import Any

from sympy.physics.mechanics import Point, ReferenceFrame
from sympy.physics.vector import Vector

from mechc_codegen.description.constraints import Closure
from mechc_codegen.description.joints.cuts import Cut
from mechc_codegen.description.joints.tree import Body, Joint, check_joints, joint_of
from mechc_codegen.description.placement import Placement, dot, minus
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
    axes = len(closure.axes)
    moved = [k for k, moves in enumerate(_moving(closure, placements)) if moves]
    return replace(
        closure,
        axes=tuple(closure.axes[k] for k in moved if k < axes),
        perpendicular=tuple(closure.perpendicular[k - axes] for k in moved if k >= axes),
        aligned=tuple(_turning(closure, placements)),
        labels=tuple(closure.labels[k] for k in moved) if closure.labels else (),
    )


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
    ends = [_position(closure.name, p, placement) for p in (closure.point, closure.target)]
    gap = minus(*ends)
    along = [dot(gap, placement.vector(axis)) for axis in closure.axes]
    return along + [_cosine(*pair, placement) for pair in closure.perpendicular]


def _position(name: str, point: Point, placement: Placement) -> Sequence[float]:
    try:
        return placement.position(point)
    except KeyError:
        raise MechanismError(
            f"the joint {name}: the point {point.name} is not located from the origin; set its "
            "position with set_pos or locatenew, or check that its body is joined to the ground"
        ) from None
