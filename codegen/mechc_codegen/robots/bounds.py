"""Bounds and dry friction of a file -> joints and motors that have them, and words on the others.

Output: a robot whose joints with ``stops`` stop at their limits, whose joints have the dry friction
that is taken, and whose motors and joints have the bounds of torques and forces that are.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from mechc_codegen.errors import MechanismError
from mechc_codegen.robots.robot import Robot, RobotJoint, RobotMotor

WARN, IGNORE = "warn", "ignore"
TAKEN = {"limits": "stop", "friction": "dry", "effort": "saturate"}
WORDS = {
    "limits": ("position limits", "them"),
    "friction": ("dry friction", "it"),
    "effort": ("bounds of motors", "them"),
}


def take_bounds(
    robot: Robot, limits: str = WARN, friction: str = WARN, effort: str = WARN
) -> Robot:
    """The robot with what is asked for, and what is to be warned of in ``skipped``.

    Raises
    ------
    MechanismError
        For another choice than ``"warn"``, ``"ignore"`` or that of ``TAKEN``.
    """
    chosen = {"limits": limits, "friction": friction, "effort": effort}
    for part, choice in chosen.items():
        if choice not in (WARN, IGNORE, TAKEN[part]):
            raise MechanismError(
                f"{robot.name}: {part}={choice!r} is none of {WARN!r}, {IGNORE!r} and "
                f"{TAKEN[part]!r}"
            )
    taken = {part: choice == TAKEN[part] for part, choice in chosen.items()}
    driven = {motor.joint for motor in robot.motors}
    found = {part: list(_words_of(part, robot, driven)) for part in TAKEN}
    skipped = [
        _untaken(part, found[part])
        for part, choice in chosen.items()
        if choice == WARN and found[part]
    ]
    skipped += [words for part in TAKEN if taken[part] for words in _without_room(part, robot)]
    joints = tuple(
        replace(
            joint,
            stops=taken["limits"] and _moves_within_limits(joint),
            friction=joint.friction if taken["friction"] or not joint.row.unit else 0,
            saturates=taken["effort"] and _saturates(joint),
        )
        for joint in robot.joints
    )
    motors = robot.motors
    if not taken["effort"]:
        motors = tuple(replace(motor, control=None, force=None) for motor in motors)
    return replace(robot, joints=joints, motors=motors, skipped=(*robot.skipped, *skipped))


def _untaken(part: str, found: Iterable[str]) -> str:
    name, them = WORDS[part]
    lines = f"{part}={TAKEN[part]!r} takes {them}, {part}={IGNORE!r} leaves {them}"
    return f"{name} ({lines}): {', '.join(found)}"


def _moves_within_limits(joint: RobotJoint) -> bool:
    return _has_limits(joint) and joint.limits["lower"] < joint.limits["upper"]


def _has_limits(joint: RobotJoint) -> bool:
    return bool(joint.row.unit) and "lower" in joint.limits


def _saturates(joint: RobotJoint) -> bool:
    return joint.saturates and joint.limits.get("effort", 0) > 0


def _words_of(part: str, robot: Robot, driven: Iterable[str]) -> Iterable[str]:
    """Joints and motors with the values that the file has for a part."""
    for joint in (each for each in robot.joints if each.row.unit):
        if part == "limits" and _moves_within_limits(joint):
            yield f"{joint.name} {joint.limits['lower']} to {joint.limits['upper']}"
        elif part == "friction" and joint.friction:
            yield f"{joint.name} {joint.friction}"
        elif part == "effort" and joint.name in driven and _saturates(joint):
            yield f"{joint.name} {joint.limits['effort']}"
    if part == "effort":
        yield from (words for motor in robot.motors for words in _bounds_of(motor))


def _bounds_of(motor: RobotMotor) -> Iterable[str]:
    for what, bounds in (("", motor.control), ("force of ", motor.force)):
        if bounds:
            yield f"{what}{motor.name} {bounds[0]} to {bounds[1]}"


def _without_room(part: str, robot: Robot) -> Iterable[str]:
    """Bounds between which nothing moves or acts, as exporters write them that know none."""
    driven = {motor.joint for motor in robot.motors}
    for joint in robot.joints:
        if part == "limits" and _has_limits(joint) and not _moves_within_limits(joint):
            yield f"the limits of the joint {joint.name}, both {joint.limits['lower']}"
        if part == "effort" and joint.name in driven and joint.limits.get("effort") == 0:
            yield f"the effort of the joint {joint.name}, 0, with which its motor never acts"
