"""The joints of a robot from its root outwards, checked: one tree, and mimics that lead to a joint.

Input: the links and joints of a file.  Output: the same with the joints in order, and the root.
"""

from __future__ import annotations

from dataclasses import replace

from mechc_codegen.errors import MechanismError
from mechc_codegen.urdf.robot import SINGLE, Mimic, Robot, RobotJoint


def as_tree(robot: Robot) -> Robot:
    """The robot with its joints from the root outwards.

    Raises
    ------
    MechanismError
        If they are no tree, or a mimic refers to no joint or to itself.
    """
    if not robot.links:
        raise MechanismError(f"{robot.name}: the file has no link")
    above: dict[str, RobotJoint] = {}
    for joint in robot.joints:
        for side, name in (("parent", joint.parent), ("child", joint.child)):
            if name not in robot.links:
                raise MechanismError(
                    f"{robot.name}: the {side} of the joint {joint.name!r} is {name!r}, which is "
                    "no link of the file"
                )
        if joint.child in above:
            raise MechanismError(
                f"{robot.name}: the link {joint.child!r} is the child of two joints, "
                f"{above[joint.child].name!r} and {joint.name!r}; a URDF is a tree"
            )
        above[joint.child] = joint
    root = _root(robot, above)
    ordered = _joints_from_root(robot, root)
    _refuse_rings(robot, ordered)
    return replace(robot, joints=tuple(_resolve(robot, joint) for joint in ordered), root=root)


def _root(robot: Robot, above: dict[str, RobotJoint]) -> str:
    roots = [name for name in robot.links if name not in above]
    if len(roots) == 1:
        return roots[0]
    found = ", ".join(map(repr, roots[:8])) or "none"
    raise MechanismError(
        f"{robot.name}: the root is the one link that is the child of no joint, but here these "
        f"are {found}; add joints (of type fixed, or floating) that connect them"
    )


def _joints_from_root(robot: Robot, root: str) -> list[RobotJoint]:
    below: dict[str, list[RobotJoint]] = {}
    for joint in robot.joints:
        below.setdefault(joint.parent, []).append(joint)
    ordered, waiting = [], list(reversed(below.get(root, [])))
    while waiting:
        joint = waiting.pop()
        ordered.append(joint)
        waiting += reversed(below.get(joint.child, []))
    return ordered


def _refuse_rings(robot: Robot, ordered: list[RobotJoint]) -> None:
    reached = {joint.name for joint in ordered}
    left = [joint.name for joint in robot.joints if joint.name not in reached]
    if left:
        raise MechanismError(
            f"{robot.name}: the joints {', '.join(map(repr, left[:8]))} form a ring that no joint "
            "connects with the root"
        )


def _resolve(robot: Robot, joint: RobotJoint) -> RobotJoint:
    """The joint, its mimic of a mimic resolved to the joint that moves by itself."""
    joints = {each.name: each for each in robot.joints}
    mimic, seen = joint.mimic, {joint.name}
    while mimic is not None:
        words = f"{robot.name}: the joint {joint.name!r} mimics {mimic.joint!r}"
        if mimic.joint in seen:
            raise MechanismError(f"{words}, which leads back to itself")
        followed = joints.get(mimic.joint)
        if followed is None or followed.kind not in SINGLE:
            raise MechanismError(f"{words}, which is no joint with one coordinate")
        seen.add(followed.name)
        inner = followed.mimic
        if inner is None:
            return replace(joint, mimic=mimic)
        mimic = Mimic(
            inner.joint,
            mimic.multiplier * inner.multiplier,
            mimic.multiplier * inner.offset + mimic.offset,
        )
    return joint
