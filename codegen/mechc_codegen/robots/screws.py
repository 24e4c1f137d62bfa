"""The freedoms of joints as screws at the start, and how well a loop is closed by a cut.

A screw is an angular velocity and the velocity of the point at the origin.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

from mechc_codegen.description.placement import apply, cross, dot, plus
from mechc_codegen.robots.geometry import IDENTITY, Place, axes_of, moved_to, place_of
from mechc_codegen.robots.robot import RobotJoint

Screw = Sequence[float]
NONE = (0, 0, 0)
DIGITS = 8  # of unit screws: half of those of a double, by which equal loops are equal
DEPENDENT = 10.0**-DIGITS


def child_place(joint: RobotJoint) -> Place:
    """The place of the child on the parent where all coordinates are zero."""
    moved = moved_to(joint, sum(e.offset for e in joint.mimic.terms) if joint.mimic else 0)
    return place_of(joint.origin).then(moved).then(place_of(joint.child_origin).inverse())


def freedoms(joint: RobotJoint, parent: Place, child: Place) -> list[Screw]:
    """The screws of the child against the parent, whose places are given."""
    frame = parent.then(place_of(joint.origin))
    row, axes = joint.row, axes_of(joint)
    turning = axes if row.turns_freely else [axes[k] for k in row.axes("rad")]
    found = [_turn(apply(frame.rotation, axis), frame.origin) for axis in turning]
    found += [(*NONE, *apply(frame.rotation, axes[k])) for k in row.axes("m")]
    if joint.kind == "distance":
        end = child.then(place_of(joint.child_origin)).origin
        found += [_turn(axis, end) for axis in IDENTITY]
    return found


def conditioning(cut: Iterable[Screw], others: Iterable[Screw], at: Sequence[float]) -> float:
    """The least of the independent motions of a loop's other joints that its cut joint holds.

    By Gram and Schmidt with the largest first; lengths in units of the loop's size, from ``at``.
    """
    free = [_about(screw, at) for screw in cut]
    held = [_about(screw, at) for screw in others]
    size = max((math.hypot(*screw[3:]) for screw in held if any(screw[:3])), default=0.0) or 1.0
    base: list[Screw] = []
    _extend(base, [_in_units_of(screw, size) for screw in free])
    return round(_extend(base, [_in_units_of(screw, size) for screw in held]), DIGITS)


def _turn(axis: Sequence[float], point: Sequence[float]) -> Screw:
    return (*axis, *cross(point, axis))


def _about(screw: Screw, at: Sequence[float]) -> Screw:
    """The screw with the velocity at another point."""
    return (*screw[:3], *plus(screw[3:], cross(screw[:3], at)))


def _in_units_of(screw: Screw, size: float) -> Screw:
    return (*screw[:3], *(x / size for x in screw[3:]))


def _extend(base: list[Screw], screws: list[Screw]) -> float:
    """Extend an orthonormal base by screws, the largest part first; how long the last one was."""
    last, screws = 0.0, [_across(screw, base) for screw in screws]
    while screws:
        screws.sort(key=lambda screw: dot(screw, screw))
        length = math.sqrt(dot(screws[-1], screws[-1]))
        if length <= DEPENDENT:
            break
        base.append([x / length for x in screws.pop()])
        screws = [_across(screw, base[-1:]) for screw in screws]
        last = length
    return last


def _across(screw: Screw, base: list[Screw]) -> Screw:
    for unit in base:
        along = dot(screw, unit)
        screw = [x - along * y for x, y in zip(screw, unit, strict=True)]
    return screw
