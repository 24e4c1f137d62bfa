"""The spanning tree of a robot's joints, and the joints that close its loops as cuts.

Input: a connected robot.  Output: branches from the root outwards, and cuts.

The tree grows from the root.  Of the joints that lead on it takes those first which are not to be
cut (because they are named, or the file says that they close a loop), then those that fix, those
whose coordinate something refers to, those with few coordinates, and those near the root.  Where
several lead to one link and are alike in all this, it keeps the one that would hold its loop worse
as a cut, and then the first in the file.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

from mechc_codegen.errors import MechanismError
from mechc_codegen.robots.geometry import Place, place_of
from mechc_codegen.robots.graph import neighbours
from mechc_codegen.robots.robot import Robot, RobotJoint, unused_name
from mechc_codegen.robots.screws import Screw, child_place, conditioning, freedoms

Order: TypeAlias = "tuple[bool, bool, bool, bool, bool, int]"
COUNT = {"fixed": 0, "cylindrical": 2, "universal": 2, "ball": 3, "planar": 3, "floating": 6}


@dataclass(frozen=True)
class TreeJoint:
    """A joint of the tree between an inner link, on the side of the root, and an outer one."""

    joint: RobotJoint
    inner: str
    outer: str

    @property
    def is_turned(self) -> bool:
        """Whether the tree leads from the joint's child to its parent."""
        return self.inner == self.joint.child


@dataclass(frozen=True)
class SpanningTree:
    """Branches, each after that of its inner link, and the joints that are cut.

    ``robot``: the robot with halves of the links that were cut.  ``places``: of the links at the
    start, where all coordinates are zero.  ``orders``: of joints, by which the tree grew.
    """

    robot: Robot
    branches: tuple[TreeJoint, ...]
    cuts: tuple[RobotJoint, ...]
    places: dict[str, Place]
    orders: dict[str, Order]

    def distance(self, joint: RobotJoint) -> float:
        """How far apart the two points of a joint are at the start."""
        sides = ((joint.parent, joint.origin), (joint.child, joint.child_origin))
        points = [self.places[link].then(place_of(pose)).origin for link, pose in sides]
        return math.dist(*points)


def spanning_tree(
    robot: Robot, cut: Collection[str] = (), with_coordinate: Collection[str] = ()
) -> SpanningTree:
    """The tree of a connected robot.

    Parameters
    ----------
    cut
        Names of joints that are cut.
    with_coordinate
        Names of joints whose coordinates something refers to.  One of these that has to be cut
        stays in the tree, with one half of a link that it joins, and a weld of the halves is cut.

    Raises
    ------
    MechanismError
        If a joint in ``cut`` is unknown or in no loop, or one that closes a loop holds nothing.
    """
    growth = _Growth(robot, cut, with_coordinate)
    growth.run()
    kept = {branch.joint.name: branch for branch in growth.branches}
    _refuse_uncut(robot, cut, kept)
    branches, places, cuts = _from_root(robot, kept), growth.places, []
    for joint in (j for j in robot.joints if j.name not in kept):
        if joint.kind == "floating":
            raise MechanismError(
                f"{robot.name}: the joint {joint.name!r} closes a loop, where a floating joint "
                "holds nothing; remove it from the file"
            )
        if joint.name in with_coordinate:
            robot, branch, joint = _cut_in_halves(robot, joint)
            branches.append(branch)
            places[branch.outer] = places[joint.parent]
        cuts.append(joint)
    orders = {joint.name: growth.order(joint) for joint in robot.joints}
    return SpanningTree(robot, tuple(branches), tuple(cuts), places, orders)


class _Growth:
    """The tree as it grows: the branch that leads to each link, and the link's place."""

    def __init__(
        self, robot: Robot, cut: Collection[str], with_coordinate: Collection[str]
    ) -> None:
        self.robot, self.cut, self.with_coordinate = robot, cut, with_coordinate
        self.to: dict[str, TreeJoint] = {}
        self.depth = {robot.root: 0}
        self.places = {robot.root: Place()}
        self.around = neighbours(robot)
        self.number = {joint.name: k for k, joint in enumerate(robot.joints)}
        self.waiting: list[tuple[Order, int, int, str]] = []

    @property
    def branches(self) -> list[TreeJoint]:
        return list(self.to.values())

    def run(self) -> None:
        self._lead_on(self.robot.root)
        while self.waiting:
            order, depth, _, outer = heapq.heappop(self.waiting)
            if outer in self.places:
                continue
            alike = [
                TreeJoint(joint, inner, outer)
                for joint, inner in self.around[outer]
                if inner in self.places and (self.order(joint), self.depth[inner]) == (order, depth)
            ]
            self._keep(self._to_keep(alike) if len(alike) > 1 else alike[0])

    def _keep(self, branch: TreeJoint) -> None:
        place = child_place(branch.joint)
        inner, outer = branch.inner, branch.outer
        self.to[outer] = branch
        self.depth[outer] = self.depth[inner] + (branch.joint.kind != "fixed")
        self.places[outer] = self.places[inner].then(place.inverse() if branch.is_turned else place)
        self._lead_on(outer)

    def _lead_on(self, inner: str) -> None:
        for joint, outer in self.around[inner]:
            if outer not in self.places:
                entry = (self.order(joint), self.depth[inner], self.number[joint.name], outer)
                heapq.heappush(self.waiting, entry)

    def order(self, joint: RobotJoint) -> Order:
        count = 0 if joint.mimic else COUNT.get(joint.kind, 1)
        refers = joint.name in self.with_coordinate
        to_cut = (joint.kind == "distance", joint.name in self.cut, not joint.leads_on)
        return (*to_cut, joint.kind != "fixed", not refers, count)

    def _to_keep(self, alike: Sequence[TreeJoint]) -> TreeJoint:
        """The one of branches to one link that would hold its loop worst as a cut."""
        held = [self._conditioning(one, alike[k == 0]) for k, one in enumerate(alike)]
        return alike[held.index(min(held))]

    def _conditioning(self, one: TreeJoint, kept: TreeJoint) -> float:
        """How well the loop of two branches to a link is closed where the first is cut."""
        ways = self._way(one.inner), self._way(kept.inner)
        common = {branch.outer for branch in ways[0]} & {branch.outer for branch in ways[1]}
        loop = [branch for way in ways for branch in way if branch.outer not in common]
        others = [screw for branch in (*loop, kept) for screw in self._freedoms(branch)]
        near = place_of(one.joint.child_origin if one.is_turned else one.joint.origin)
        at = self.places[one.inner].then(near).origin
        return conditioning(self._freedoms(one), others, at)

    def _way(self, link: str) -> list[TreeJoint]:
        way = []
        while link != self.robot.root:
            way.append(self.to[link])
            link = self.to[link].inner
        return way

    def _freedoms(self, branch: TreeJoint) -> list[Screw]:
        joint = branch.joint
        parent = self.places.get(joint.parent)
        if parent is None:  # the link that is not reached yet, where this branch would bring it
            parent = self.places[joint.child].then(child_place(joint).inverse())
        child = self.places.get(joint.child) or parent.then(child_place(joint))
        return freedoms(joint, parent, child)


def _from_root(robot: Robot, kept: dict[str, TreeJoint]) -> list[TreeJoint]:
    """The branches as one follows them through the file, each link's beyond it before the next."""
    around = neighbours(robot)
    ordered: list[TreeJoint] = []
    waiting = [kept[j.name] for j, _ in reversed(around[robot.root]) if j.name in kept]
    while waiting:
        branch = waiting.pop()
        ordered.append(branch)
        beyond = (kept[j.name] for j, _ in reversed(around[branch.outer]) if j.name in kept)
        waiting += (each for each in beyond if each is not branch)
    return ordered


def _refuse_uncut(robot: Robot, cut: Collection[str], kept: dict[str, TreeJoint]) -> None:
    known = {joint.name for joint in robot.joints}
    for name in cut:
        if name not in known:
            loops = sorted(known - kept.keys())
            found = f"those that close loops are {', '.join(map(repr, loops))}" if loops else ""
            raise MechanismError(
                f"{robot.name}: cut={name!r} is no joint of the file; {found or 'it has no loop'}"
            )
        if name in kept:
            raise MechanismError(
                f"{robot.name}: the joint {name!r} cannot be cut: besides the others in cut= no "
                f"loop leads to {kept[name].outer!r}"
            )


def _cut_in_halves(robot: Robot, joint: RobotJoint) -> tuple[Robot, TreeJoint, RobotJoint]:
    """The robot with a link in two halves, the joint to one of them, and the weld of both."""
    links = dict(robot.links)
    heavy = any((links[joint.child].mass, *links[joint.child].inertia))
    whole = joint.child if heavy and joint.child != robot.root else joint.parent
    if whole == robot.root:
        whole = joint.child
    half = unused_name(f"{whole} half", links)
    links[whole] = replace(links[whole], share=links[whole].share / 2)
    links[half] = replace(links[whole], visuals=())
    if whole == joint.child:
        branch = TreeJoint(replace(joint, child=half), joint.parent, half)
    else:
        branch = TreeJoint(replace(joint, parent=half), joint.child, half)
    weld = RobotJoint(f"{joint.name} weld", "fixed", whole, half)
    return replace(robot, links=links), branch, weld
