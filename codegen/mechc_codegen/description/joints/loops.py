"""The forces that each constraint of a cut joint can add to the reactions of its loop.

A constraint that follows from others, or always holds, may carry a force of any size: the joints of
its loop pass it on, and nothing moves.  These components of their reactions are not determined.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from mechc_codegen.description.constraints import Closure
from mechc_codegen.description.joints.cuts import Cut
from mechc_codegen.description.joints.tree import Body, Branch, Joint, joint_tree
from mechc_codegen.description.mechanism import Mechanism
from mechc_codegen.description.placement import ZERO, Placement, cross, minus

SAMPLES = 3
ROUNDING = 1e-9  # of values of the order of one


@dataclass(frozen=True)
class CutConstraint:
    """A constraint of a cut joint, and what it adds to.

    ``omitted``: whether it always holds, and is no row of the mechanism.  ``components``: by the
    place of a joint, which of three components of its force and three of its torque.
    """

    name: str
    omitted: bool
    components: Mapping[int, tuple[bool, ...]]


def cut_rows(mechanism: Mechanism) -> Iterator[CutConstraint]:
    """The constraints of all cut joints."""
    places = [Placement(mechanism.frame, mechanism.origin, seed) for seed in range(SAMPLES)]
    tree = joint_tree(mechanism.joints, mechanism.bodies)
    inwards = {branch.body: branch for branch in tree.branches}
    held = {name for closure in mechanism.closures for name in closure.names}
    for cut in mechanism.joints:
        if isinstance(cut, Cut):
            closure = cut.closure(mechanism.frame)
            loop = [cut, *_between(inwards, cut.parent, cut.child)]
            try:
                every = [_added(cut, closure, loop, place) for place in places]
            except KeyError:  # a joint's point is not located, so its reaction is not known either
                continue
            for row, name in enumerate(closure.names):
                samples = [each[row] for each in every]
                components = {
                    mechanism.joints.index(joint): tuple(
                        max(abs(sample[k][i]) for sample in samples) > ROUNDING for i in range(6)
                    )
                    for k, joint in enumerate(loop)
                }
                yield CutConstraint(name, name not in held, components)


def loop_joints(mechanism: Mechanism) -> dict[str, tuple[str, ...]]:
    """Name of every cut joint -> the names of the other joints of its loop."""
    tree = joint_tree(mechanism.joints, mechanism.bodies)
    inwards = {branch.body: branch for branch in tree.branches}
    return {
        cut.name: tuple(joint.name for joint in _between(inwards, cut.parent, cut.child))
        for cut in mechanism.joints
        if cut.is_cut
    }


def _between(
    inwards: Mapping[Body | None, Branch], one: Body | None, other: Body | None
) -> list[Joint]:
    """The joints on the way from one body to another through the tree."""

    def way(body: Body | None) -> list[Joint]:
        joints = []
        while body in inwards:
            joints.append(inwards[body].joint)
            body = inwards[body].inner
        return joints

    both = way(one), way(other)
    return [j for a, b in (both, both[::-1]) for j in a if j not in b]


def _added(
    cut: Cut, closure: Closure, loop: Sequence[Joint], place: Placement
) -> list[list[tuple[float, ...]]]:
    """Force and torque about the point of each joint, for a unit force of each constraint."""
    at = place.position(cut.child_point)
    arms = [minus(at, place.position(joint.child_point)) for joint in loop]
    found = list[list[tuple[float, ...]]]()
    for axis in closure.directions:
        force = place.vector(axis)
        found.append([(*force, *cross(arm, force)) for arm in arms])
    for one, other in closure.perpendicular:
        torque = cross(place.vector(one), place.vector(other))
        found.append([(*ZERO, *torque)] * len(loop))
    return found
