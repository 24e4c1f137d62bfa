"""Equality constraints -> joints that close loops, and joints that follow others or are locked."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

from mechc_codegen.errors import MechanismError
from mechc_codegen.mjcf.names import PartNames
from mechc_codegen.mjcf.poses import exact, place_at
from mechc_codegen.mjcf.read import CompiledFile
from mechc_codegen.robots.geometry import moved_to, place_of, pose_of
from mechc_codegen.robots.robot import Mimic, RobotJoint, substitute

_ANCHORS = {"CONNECT": (0, 3), "WELD": (3, 0)}  # where the data have the points on both bodies


def with_equalities(
    file: CompiledFile, names: PartNames, joints: Iterable[RobotJoint]
) -> tuple[RobotJoint, ...]:
    """The joints, those coupled by the file as mimics or fixed, and those that close loops.

    Raises
    ------
    MechanismError
        For a constraint that no joint is: of tendons, flexible bodies, or a second one on a joint.
    """
    own = {joint.name: joint for joint in joints}
    closing = []
    if file.disables("EQUALITY", "CONSTRAINT"):
        return tuple(own.values())
    coupled: set[str] = set()
    for number, name in enumerate(names.equalities):
        if not file.model.eq_active0[number]:
            continue
        kind = file.code("mjtEq", file.model.eq_type[number])
        if kind in _ANCHORS:
            closing.append(_closing_joint(file, names, number, kind))
        elif kind == "JOINT":
            follower = names.joints[int(file.model.eq_obj1id[number])]
            if follower in coupled:
                raise MechanismError(
                    f"{file.name!r}: the equality {name!r} is the second that the joint "
                    f"{follower!r} follows; write the other joint as its joint1"
                )
            coupled.add(follower)
            own[follower] = _follower(file, names, number, own[follower])
        else:
            raise MechanismError(
                f"{file.name!r}: the equality {name!r} is of the kind {kind.lower()}; mechc takes "
                "connect, weld and joint: remove it from the file"
            )
    return (*own.values(), *closing)


def _closing_joint(file: CompiledFile, names: PartNames, number: int, kind: str) -> RobotJoint:
    model = file.model
    sides = (int(model.eq_obj1id[number]), int(model.eq_obj2id[number]))
    data = model.eq_data[number].tolist()
    if file.code("mjtObj", model.eq_objtype[number]) == "SITE":
        bodies = [int(model.site_bodyid[side]) for side in sides]
        places = [place_at(model.site_pos[side], model.site_quat[side]) for side in sides]
    else:
        bodies = list(sides)
        places = [place_at(data[k : k + 3]) for k in _ANCHORS[kind]]
        if kind == "WELD":
            places[0] = place_at(data[3:6], data[6:10])
    turns = kind == "CONNECT" or data[10] == 0  # the scale of the torque that holds directions
    return RobotJoint(
        names.equalities[number],
        "ball" if turns else "fixed",
        names.bodies[bodies[0]],
        names.bodies[bodies[1]],
        pose_of(places[0]),
        child_origin=pose_of(places[1]),
        closes=True,
    )


def _follower(file: CompiledFile, names: PartNames, number: int, joint: RobotJoint) -> RobotJoint:
    """The joint as a mimic of the other, or fixed where there is no other."""
    model = file.model
    coefficients = [exact(x) for x in model.eq_data[number].tolist()[:5]]
    coefficients[0] += _reference(model, model.eq_obj1id[number])
    other = int(model.eq_obj2id[number])
    if other < 0:
        return _locked_joint(joint, coefficients[0])
    offset, multiplier, *powers = substitute(coefficients, (-_reference(model, other), 1))
    return replace(joint, mimic=Mimic(names.joints[other], multiplier, offset, tuple(powers)))


def _reference(model: Any, joint: Any) -> Any:
    return exact(float(model.qpos0[int(model.jnt_qposadr[int(joint)])]))


def _locked_joint(joint: RobotJoint, position: Any) -> RobotJoint:
    moved = place_of(joint.origin).then(moved_to(joint, position))
    return RobotJoint(
        joint.name, "fixed", joint.parent, joint.child, pose_of(moved),
        child_origin=joint.child_origin,
    )  # fmt: skip
