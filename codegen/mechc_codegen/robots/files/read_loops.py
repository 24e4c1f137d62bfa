"""The elements by which files in URDF close loops -> joints that close them.

URDF itself has none.  Read are

- ``<constraint>``, proposed for URDF (ros/urdfdom#264);
- ``<loop_joint>``, of Isaac Sim's importer, and of Drake until 2019;
- ``<drake:ball_constraint>``, of Drake;
- ``<joint>`` of SDFormat in ``<gazebo>``, as in Gazebo's tutorial of a four-bar linkage.

A joint whose child is that of another too needs no element of its own.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from xml.etree.ElementTree import Element

from mechc_codegen.description.joints.kinds import kinds_by
from mechc_codegen.robots.files.elements import Part
from mechc_codegen.robots.files.known_parts import SDF, unknown_parts
from mechc_codegen.robots.files.sdf_joints import KINDS as SDF_KINDS
from mechc_codegen.robots.files.sdf_joints import FrameGraph, base_in, sdf_joint
from mechc_codegen.robots.geometry import Place, across, place_of, pose_of, transpose
from mechc_codegen.robots.graph import resolve_graph
from mechc_codegen.robots.robot import V3, Pose, Robot, RobotJoint
from mechc_codegen.robots.spanning import spanning_tree

KINDS = kinds_by("loops")
ABOUT_AXIS = ("continuous", "cylindrical")


def with_loops(robot: Robot, path: Path, root: Element) -> Robot:
    """The robot with the joints of such elements, and words on those that are not read.

    Raises
    ------
    MechanismError
        If an element lacks something or has a wrong number, or is of an unknown type.
    """
    joints = [
        *(_constraint(Part(path, "constraint", each)) for each in root.findall("constraint")),
        *(_loop_joint(Part(path, "loop_joint", each)) for each in root.findall("loop_joint")),
    ]
    for number, each in enumerate(root.findall("drake:ball_constraint")):
        name = f"ball_constraint_{number}"
        joints.append(_ball(Part(path, "drake:ball_constraint", each, name)))
    sdf = [Part(path, "gazebo joint", each) for each in root.findall("gazebo/joint")]
    taken = [part for part in sdf if part.element.get("type") in SDF_KINDS]
    skipped = [
        f"the joint {part.name} of <gazebo> ({part.element.get('type')})"
        for part in sdf
        if part not in taken
    ]
    skipped += unknown_parts(*(part.element for part in taken), table=SDF)
    for joint, untaken in _sdf_joints(robot, taken) if taken else ():
        joints.append(joint)
        skipped += untaken
    return replace(robot, joints=(*robot.joints, *joints), skipped=(*robot.skipped, *skipped))


def _kind(part: Part) -> str:
    kind = part.element.get("type", "")
    if kind not in KINDS:
        part.refuse(f"has the type {kind!r}; known are {', '.join({'fixed': 0} | KINDS)}")
    return KINDS[kind].name


def _constraint(part: Part) -> RobotJoint:
    kind = _kind(part)
    sides = [
        (part.name_in(side, "link"), _pose_in(part, f"{side}_origin"),
         part.axis(part.child(f"{side}_axis"), default))
        for side, default in (("parent", (1, 0, 0)), ("child", (0, 1, 0)))
    ]  # fmt: skip
    (parent, origin, axis), (child, child_origin, other) = sides
    if kind == "universal":
        origin, child_origin = _along(origin, axis, 0), _along(child_origin, other, 1)
    elif kind in ABOUT_AXIS and part.child("child_axis") is not None and other != axis:
        origin, child_origin = _along(origin, axis, 0), _along(child_origin, other, 0)
        axis = (1, 0, 0)
    elif kind == "prismatic" and part.child("child_axis") is not None and other != axis:
        part.refuse("slides along axes that differ: give both origins the same axes")
    return _closing_joint(part, kind, (parent, origin), (child, child_origin), axis)


def _loop_joint(part: Part) -> RobotJoint:
    parent, child = ((part.name_in(tag, "link"), _pose_in(part, tag)) for tag in ("link1", "link2"))
    return _closing_joint(part, _kind(part), parent, child, part.axis(part.child("axis")))


def _ball(part: Part) -> RobotJoint:
    parent, child = (
        (part.name_in(f"drake:ball_constraint_body_{body}", "name"),
         Pose(part.vector(part.child(f"drake:ball_constraint_p_{point}"), "value")))
        for body, point in (("A", "AP"), ("B", "BQ"))
    )  # fmt: skip
    return _closing_joint(part, "ball", parent, child)


def _sdf_joints(robot: Robot, parts: Sequence[Part]) -> Iterator[tuple[RobotJoint, list[str]]]:
    """Joints whose poses are given on the child: their places on the parent are at the start."""
    frames = FrameGraph()
    for link, place in spanning_tree(resolve_graph(robot)).places.items():
        frames.add_link(link, place)
    for part in parts:
        child = part.words_of("child")
        frames.add(part, part.name, base_in(part.child("pose"), "", child), child)
    for part in parts:
        joint, skipped = sdf_joint(part, frames)
        yield replace(joint, closes=True), skipped


def _closing_joint(
    part: Part, kind: str, parent: tuple[str, Pose], child: tuple[str, Pose], axis: V3 = (1, 0, 0)
) -> RobotJoint:
    return RobotJoint(
        part.name, kind, parent[0], child[0], parent[1], axis, child_origin=child[1], closes=True
    )


def _pose_in(part: Part, tag: str) -> Pose:
    element = part.child(tag)
    return Pose(part.vector(element, "xyz"), part.vector(element, "rpy"))


def _along(pose: Pose, axis: V3, number: int) -> Pose:
    """The pose with its axis of this number, x or y, along an axis that is given in it."""
    first, second = across(axis)
    columns = [[axis, first, second], [second, axis, first]][number]
    return pose_of(place_of(pose).then(Place(transpose(columns))))
