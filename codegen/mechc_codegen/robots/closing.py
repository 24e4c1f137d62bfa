"""A joint that closes a loop -> the cut that holds its two sides."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from sympy.physics.mechanics import Point, ReferenceFrame, RigidBody

from mechc_codegen.description.joints.cuts import Cut
from mechc_codegen.description.joints.tree import Joint
from mechc_codegen.description.terms import vector_along
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
        If it is a distance whose length is not positive.
    """
    sides: dict[str, Any] = {
        "parent_point": parent.point, "child_point": child.point,
        "parent_interframe": parent.frame, "child_interframe": child.frame,
    }  # fmt: skip
    if joint.kind == "distance":
        sides["length"] = length if joint.length is None else joint.length
    if joint.row.has_axis and joint.kind != "planar":  # which has it along x
        sides["joint_axis"] = vector_along(joint.axis, parent.frame)
    cut: Joint = getattr(Cut, joint.row.cut)(joint.name, parent.body, child.body, **sides)
    return cut


def cut_place(joint: RobotJoint, place: Place) -> Place:
    """The place of the frame that its cut refers to: of a plane, with its axis along x."""
    if joint.kind != "planar":
        return place
    return place.then(Place(transpose(axes_of(joint))))
