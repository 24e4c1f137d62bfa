"""The graph of a robot's joints, checked: one ground from which joints lead to every link, and
mimics that lead to a joint.

Input: the links and joints of a file.  Output: the same with the ground named and mimics of mimics
resolved.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from mechc_codegen.errors import MechanismError
from mechc_codegen.robots.robot import Mimic, Robot, RobotJoint


def resolve_graph(robot: Robot) -> Robot:
    """The robot with its root, and each mimic of a joint that moves by itself.

    Raises
    ------
    MechanismError
        If joints join unknown links or one to itself, no joint leads to a link, the root is not
        known, or a mimic refers to no joint or to itself.
    """
    if not robot.links:
        raise MechanismError(f"{robot.name}: the file has no link")
    for joint in robot.joints:
        for side, name in (("parent", joint.parent), ("child", joint.child)):
            if name not in robot.links:
                raise MechanismError(
                    f"{robot.name}: the {side} of the joint {joint.name!r} is {name!r}, which is "
                    "no link of the file"
                )
        if joint.parent == joint.child:
            raise MechanismError(
                f"{robot.name}: the joint {joint.name!r} joins the link {joint.child!r} to itself"
            )
    root = robot.root or _root(robot)
    _refuse_unreached(robot, root)
    joints = {joint.name: joint for joint in robot.joints}
    return replace(
        robot, joints=tuple(_resolve(robot, joints, joint) for joint in robot.joints), root=root
    )


def neighbours(robot: Robot) -> dict[str, list[tuple[RobotJoint, str]]]:
    """The joints of each link, in the order of the file, and the links on their other sides."""
    found: dict[str, list[tuple[RobotJoint, str]]] = {name: [] for name in robot.links}
    for joint in robot.joints:
        found[joint.parent].append((joint, joint.child))
        found[joint.child].append((joint, joint.parent))
    return found


def _root(robot: Robot) -> str:
    below = {joint.child for joint in robot.joints if joint.leads_on}
    roots = [name for name in robot.links if name not in below]
    if len(roots) == 1:
        return roots[0]
    found = ", ".join(map(repr, roots[:8])) or "none"
    raise MechanismError(
        f"{robot.name}: the root is the one link that is the child of no joint, but here these "
        f"are {found}; add joints (of type fixed, or floating) that connect them, or exchange "
        "parent and child of a joint"
    )


def _refuse_unreached(robot: Robot, root: str) -> None:
    around, waiting = neighbours(robot), [root]
    reached = set(waiting)
    while waiting:
        beyond = {link for joint, link in around[waiting.pop()] if joint.leads_on} - reached
        reached |= beyond
        waiting += beyond
    left = [name for name in robot.links if name not in reached]
    if left:
        raise MechanismError(
            f"{robot.name}: no joint connects {', '.join(map(repr, left[:8]))} with the root, "
            f"{root!r}; add a joint (of type fixed, or floating)"
        )


def _resolve(robot: Robot, joints: dict[str, RobotJoint], joint: RobotJoint) -> RobotJoint:
    """The joint, its mimic of mimics resolved to joints that move by themselves."""
    if joint.mimic is None:
        return joint

    def ends(mimic: Mimic, seen: frozenset[str]) -> Iterator[Mimic]:
        words = f"{robot.name}: the joint {joint.name!r} mimics {mimic.joint!r}"
        if mimic.joint in seen:
            raise MechanismError(f"{words}, which leads back to itself")
        followed = joints.get(mimic.joint)
        if followed is None or not followed.row.unit:
            raise MechanismError(f"{words}, which is no joint with one coordinate")
        if followed.mimic is None:
            yield replace(mimic, beside=())
            return
        inner = followed.mimic.terms
        if mimic.powers and len(inner) > 1:
            raise MechanismError(f"{words} by a power, and that follows several joints")
        for number, each in enumerate(inner):
            outer = mimic if number == 0 else replace(mimic, offset=0)
            yield from ends(outer.of(each), seen | {followed.name})

    first, *others = (
        end for each in joint.mimic.terms for end in ends(each, frozenset({joint.name}))
    )
    return replace(joint, mimic=replace(first, beside=tuple(others)))
