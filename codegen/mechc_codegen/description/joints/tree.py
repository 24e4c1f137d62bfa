"""Joints: the tree of bodies.

Input: joints of ``sympy.physics.mechanics`` as they are, or described by their points and frames.
Output: :class:`Joint`, and the tree of those that are not cut.  Invariant of the tree: exactly one
path leads from each body to the ground.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Self, TypeAlias

from sympy.core.function import AppliedUndef
from sympy.physics.mechanics import Particle, Point, ReferenceFrame, RigidBody
from sympy.physics.mechanics.joint import Joint as SymPyJoint

from mechc_codegen.description.joints.kinds import kinds_by
from mechc_codegen.errors import MechanismError

Body: TypeAlias = "RigidBody | Particle"
_OF_CLASS = kinds_by("classes")


@dataclass(frozen=True, eq=False)
class Joint:
    """A joint of the tree; two are the same only if they are one object.

    Attributes
    ----------
    parent, child
        The bodies that it joins; None is the ground.
    parent_point, child_point
        The joint's point on each body.  Reactions act at ``child_point``.
    parent_interframe, child_interframe
        Its local frames, fixed to parent and child; None on a particle.
    coordinates, speeds
        Those of the child's motion relative to the parent.
    quaternion
        Those of the coordinates that are a quaternion whose multiples are one attitude.
    cut_as
        The method of :class:`mechc.Cut` that makes the cut of a joint of this kind, where known.
    """

    name: str
    parent: Body | None
    child: Body | None
    parent_point: Point
    child_point: Point
    parent_interframe: ReferenceFrame | None = None
    child_interframe: ReferenceFrame | None = None
    coordinates: tuple[AppliedUndef, ...] = ()
    speeds: tuple[AppliedUndef, ...] = ()
    quaternion: tuple[AppliedUndef, ...] = ()
    cut_as: str = ""

    def on_ground(self, at_rest: Collection[Body]) -> Self:
        """The joint with the ground in place of these bodies."""
        moved = [side for side in ("parent", "child") if getattr(self, side) in at_rest]
        sides: dict[str, Any] = dict.fromkeys(moved)
        return replace(self, **sides) if sides else self

    @property
    def is_cut(self) -> bool:
        """Whether the joint is a cut, whose motion only constraints restrict."""
        return False


def joint_of(joint: Any) -> Joint:
    """A joint of SymPy as a :class:`Joint`; a :class:`Joint` unchanged.

    Raises
    ------
    MechanismError
        If it is neither.
    """
    if isinstance(joint, Joint):
        return joint
    if not isinstance(joint, SymPyJoint):
        raise MechanismError(
            f"{joint!r} is not a joint: give a joint of sympy.physics.mechanics (PinJoint, "
            "...), a mechc.Joint or a mechc.Cut"
        )
    kind = _OF_CLASS.get(type(joint).__name__)
    return Joint(
        joint.name, joint.parent, joint.child, joint.parent_point, joint.child_point,
        joint.parent_interframe, joint.child_interframe, tuple(joint.coordinates),
        tuple(joint.speeds), tuple(getattr(joint, "quaternion", ())), kind.cut if kind else "",
    )  # fmt: skip


# -- the tree -------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Branch:
    """A body, the joint to its parent, and the parent or the ground.

    ``sign``: 1 where the body is the joint's child, -1 where it is the parent.
    """

    body: Body
    joint: Joint
    inner: Body | None
    sign: int


@dataclass(frozen=True, eq=False)
class JointTree:
    """Branches, each after its parent; and the bodies that no joint reaches."""

    branches: tuple[Branch, ...]
    unreached: tuple[Body, ...]


def check_joints(mechanism: str, joints: Sequence[Joint]) -> None:
    """Refuse joints that cannot be a tree with cuts.

    Raises
    ------
    MechanismError
        For a name twice, a joint from a body to itself, and a loop that none of its joints cuts.
    """
    names = [joint.name for joint in joints]
    for name in names:
        if names.count(name) > 1:
            raise MechanismError(
                f"{mechanism}: more than one joint is called {name!r}; rename one of them so that "
                "reactions have different names"
            )
    for joint in joints:
        if joint.parent is joint.child:
            raise MechanismError(
                f"{mechanism}: the joint {joint.name} joins {_title(joint.parent)} to itself"
            )
    _refuse_loops(mechanism, [joint for joint in joints if not joint.is_cut])


def joint_tree(joints: Iterable[Joint], bodies: Iterable[Body]) -> JointTree:
    """The tree of the uncut joints, from the ground outwards."""
    neighbours = _Neighbours(joint for joint in joints if not joint.is_cut)
    reached: list[Body | None] = [None]
    seen: set[Body | None] = {None}
    branches: list[Branch] = []
    for inner in reached:
        for joint, body in neighbours.of(inner):
            if body is not None and body not in seen:
                seen.add(body)
                reached.append(body)
                branches.append(Branch(body, joint, inner, 1 if body is joint.child else -1))
    return JointTree(tuple(branches), tuple(b for b in bodies if b not in seen))


def refuse_unreached(mechanism: str, tree: JointTree) -> None:
    """Refuse bodies that no chain of joints connects with the ground.

    Raises
    ------
    MechanismError
        If there is one; the message names it.
    """
    if tree.unreached:
        names = ", ".join(body.name for body in tree.unreached)
        raise MechanismError(
            f"{mechanism}: no joint leads from the ground to {names}; add one (a WeldJoint for a "
            "body that is fixed to another)"
        )


class _Neighbours:
    """The neighbours of each body."""

    def __init__(self, joints: Iterable[Joint] = ()) -> None:
        self._of: dict[Body | None, list[tuple[Joint, Body | None]]] = {}
        for joint in joints:
            self.add(joint)

    def add(self, joint: Joint) -> None:
        self._of.setdefault(joint.parent, []).append((joint, joint.child))
        self._of.setdefault(joint.child, []).append((joint, joint.parent))

    def of(self, body: Body | None) -> list[tuple[Joint, Body | None]]:
        return self._of.get(body, [])

    def way(self, start: Body | None, end: Body | None) -> list[Joint] | None:
        """The joints on the path between two bodies; None if no path joins them."""
        came: dict[Body | None, tuple[Joint, Body | None] | None] = {start: None}
        waiting = [start]
        for at in waiting:
            for joint, there in self.of(at):
                if there not in came:
                    came[there] = (joint, at)
                    waiting.append(there)
        if end not in came:
            return None
        way, step = [], came[end]
        while step is not None:
            way.append(step[0])
            step = came[step[1]]
        return way[::-1]


def _refuse_loops(mechanism: str, joints: Sequence[Joint]) -> None:
    neighbours = _Neighbours()
    for joint in joints:
        way = neighbours.way(joint.parent, joint.child)
        if way is not None:
            through = ", ".join(other.name for other in way)
            raise MechanismError(
                f"{mechanism}: the joint {joint.name} closes a loop: {_title(joint.child)} is "
                f"joined to {_title(joint.parent)} through {through} already. A body is the child "
                "of one joint of the tree, so one joint of the loop must be a cut: "
                f"{_advice(joint)}"
            )
        neighbours.add(joint)


def _advice(joint: Joint) -> str:
    if not joint.cut_as:
        return "write it as mechc.Cut.pin(...), or of another kind"
    return (
        f"write mechc.Cut.{joint.cut_as}({joint.name!r}, ...) with the same bodies, points, frames "
        "and axis, without coordinates and speeds"
    )


def _title(body: Body | None) -> str:
    return "the ground" if body is None else str(body.name)
