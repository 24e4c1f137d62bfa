"""The elements by which files in URDF close loops -> joints that close them.

URDF itself has none.  Read are

- ``<constraint>``, proposed for URDF (ros/urdfdom#264);
- ``<loop_joint>``, of Isaac Sim's importer, and of Drake until 2019;
- ``<loop>`` and ``<coupling>``, of URDF+ (M. Chignoli, 2024; generalized_rbda);
- ``<drake:ball_constraint>``, of Drake;
- ``<joint>`` of SDFormat in ``<gazebo>``, as in Gazebo's tutorial of a four-bar linkage.

A joint whose child is that of another too needs no element of its own.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from xml.etree.ElementTree import Element

from mechc_codegen.description.joints.kinds import kinds_by
from mechc_codegen.robots.files.elements import Part
from mechc_codegen.robots.files.known_parts import SDF, unknown_parts
from mechc_codegen.robots.files.sdf_joints import KINDS as SDF_KINDS
from mechc_codegen.robots.files.sdf_joints import FrameGraph, base_in, sdf_joint
from mechc_codegen.robots.geometry import Place, across, place_of, pose_of, transpose
from mechc_codegen.robots.graph import resolve_graph
from mechc_codegen.robots.robot import V3, Mimic, Pose, Robot, RobotJoint
from mechc_codegen.robots.spanning import spanning_tree

KINDS = kinds_by("loops")
ABOUT_AXIS = ("continuous", "cylindrical")
ENDS = ("predecessor", "successor")  # of loops and couplings


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
        *(_loop(Part(path, "loop", each)) for each in root.findall("loop")),
    ]
    couplings = [
        Part(path, "coupling", each, f"coupling_{number}")
        for number, each in enumerate(root.findall("coupling"))
    ]
    robot = replace(robot, joints=_coupled(robot.joints, couplings, root))
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


def _loop(part: Part) -> RobotJoint:
    parent, child = (
        (part.name_in(tag, "link"), part.pose(part.child(tag)))
        for tag in ("predecessor", "successor")
    )
    return _closing_joint(part, _kind(part), parent, child, part.axis(part.child("axis")))


def _coupled(
    joints: Sequence[RobotJoint], parts: Sequence[Part], root: Element
) -> tuple[RobotJoint, ...]:
    """The joints; as many as there are couplings follow the others.

    A coupling is of the sums of the positions on the ways from the last link that both have in
    common: ``ratio`` times that of its predecessor is that of its successor.  All are solved
    together, for joints that are not ``independent`` before others, the last ones first.
    """
    if not parts:
        return tuple(joints)
    rows = [(part, _coupling(part, joints)) for part in parts]
    dependent = {
        joint.get("name")
        for joint in root.findall("joint")
        if joint.get("independent", "").lower() == "false"
    }
    able = [joint.name for joint in reversed(joints) if joint.mimic is None]
    order = sorted(able, key=lambda name: name not in dependent)
    solved = dict[str, dict[str, Fraction]]()  # follower: factors, that of its own is one
    for part, row in rows:
        for known in solved.keys() & row.keys():
            _take(row, solved[known], row[known])
        follower = next((name for name in order if row.get(name)), None)
        if follower is None or len(row) < 2:
            part.refuse("couples no two joints that nothing couples yet")
        row = {name: factor / row[follower] for name, factor in row.items()}
        for other in solved.values():
            _take(other, row, other.get(follower, Fraction(0)))
        solved[follower] = row
    return tuple(
        replace(joint, mimic=_sum_of(solved[joint.name], joint.name))
        if joint.name in solved
        else joint
        for joint in joints
    )


def _take(row: dict[str, Fraction], other: Mapping[str, Fraction], factor: Fraction) -> None:
    """Subtract a multiple of another row, in place."""
    for name, value in other.items():
        row[name] = row.get(name, Fraction(0)) - factor * value
        if not row[name]:
            del row[name]


def _sum_of(row: Mapping[str, Fraction], follower: str) -> Mimic:
    factors = {name: -factor for name, factor in row.items() if name != follower}
    first, *others = (
        Mimic(name, int(factor) if factor.denominator == 1 else float(factor))
        for name, factor in factors.items()
    )
    return replace(first, beside=tuple(others))


def _coupling(part: Part, joints: Sequence[RobotJoint]) -> dict[str, Fraction]:
    """The factors of the positions of joints whose sum is zero."""
    ratio = Fraction(part.number(part.required("ratio"), "value", None))
    ways = [_way(part, part.name_in(tag, "link"), joints) for tag in ENDS]
    common = {joint.name for joint in ways[0]} & {joint.name for joint in ways[1]}
    factors = {
        joint.name: factor
        for way, factor in zip(ways, (ratio, Fraction(-1)), strict=True)
        for joint in way
        if joint.name not in common and joint.kind != "fixed"
    }
    single = {joint.name for joint in joints if joint.row.unit}
    for name in factors.keys() - single:
        part.refuse(f"is of the joint {name!r}, which has not one coordinate")
    return {name: factor for name, factor in factors.items() if factor}


def _way(part: Part, link: str, joints: Sequence[RobotJoint]) -> list[RobotJoint]:
    """The joints from the root to a link."""
    way, known = list[RobotJoint](), {name for j in joints for name in (j.parent, j.child)}
    if link not in known:
        part.refuse(f"has the link {link!r}, which no joint joins")
    while leading := [joint for joint in joints if joint.leads_on and joint.child == link]:
        if len(leading) > 1 or len(way) > len(joints):
            part.refuse(f"is on a way by the link {link!r}, to which several joints lead")
        way += leading
        link = way[-1].parent
    return way[::-1]


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
