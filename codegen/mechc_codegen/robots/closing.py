"""A joint that closes a loop -> the cut that holds its two sides."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from sympy import sympify
from sympy.physics.mechanics import Point, ReferenceFrame, RigidBody

from mechc_codegen.description.constraints import Constraint
from mechc_codegen.description.joints.couplings import CoupledPair
from mechc_codegen.description.joints.cuts import Cut
from mechc_codegen.description.joints.tree import Joint
from mechc_codegen.description.terms import vector_along
from mechc_codegen.errors import MechanismError
from mechc_codegen.robots.geometry import Place, axes_of, transpose
from mechc_codegen.robots.robot import RobotJoint


@dataclass(frozen=True)
class Side:
    """A joint's point and frame on the body of one of its links; None: the ground."""

    body: RigidBody | None
    point: Point
    frame: ReferenceFrame


def cut_joint(joint: RobotJoint, parent: Side, child: Side, length: float) -> Joint:
    """The cut of a joint; ``length``: how far apart its points are at the start.

    Raises
    ------
    MechanismError
        If it is a distance of length zero.
    """
    if joint.kind == "distance":
        return _distance(joint, parent, child, length if joint.length is None else joint.length)
    sides: dict[str, Any] = {
        "parent_point": parent.point, "child_point": child.point,
        "parent_interframe": parent.frame, "child_interframe": child.frame,
    }  # fmt: skip
    if joint.row.has_axis and joint.kind != "planar":  # which has it along x
        sides["joint_axis"] = vector_along(joint.axis, parent.frame)
    cut: Joint = getattr(Cut, joint.row.cut)(joint.name, parent.body, child.body, **sides)
    return cut


def cut_place(joint: RobotJoint, place: Place) -> Place:
    """The place of the frame that its cut refers to: of a plane, with its axis along x."""
    if joint.kind != "planar":
        return place
    return place.then(Place(transpose(axes_of(joint))))


def _distance(joint: RobotJoint, parent: Side, child: Side, length: float) -> CoupledPair:
    if length <= 0:
        raise MechanismError(
            f"the joint {joint.name!r} holds two points at the distance {length}; for points that "
            'coincide write a joint of the kind "ball"'
        )
    gap = child.point.pos_from(parent.point)
    size = sympify(length)
    return CoupledPair(
        joint.name, parent.body, child.body, parent.point, child.point, parent.frame, child.frame,
        constraint=Constraint(joint.name, (gap.dot(gap) - size**2) / (2 * size), "m"),
        force=-gap / size,
    )  # fmt: skip
