"""An SDFormat file -> Robot, whose root is the world.

The file is untrusted, as one in URDF.  Read are models, in a world and in each other, with links,
joints, frames, inertials and visuals; what else moves or acts is named in ``skipped``.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from pathlib import Path
from xml.etree.ElementTree import Element

from mechc_codegen.errors import MechanismError
from mechc_codegen.robots.files.elements import Part
from mechc_codegen.robots.files.read_urdf import INERTIA, parse
from mechc_codegen.robots.files.sdf_joints import (
    MODEL,
    TRUE,
    WORLD,
    FrameGraph,
    base_in,
    name_within,
    number_in,
    pose_in,
    sdf_joint,
)
from mechc_codegen.robots.geometry import Place, pose_of
from mechc_codegen.robots.robot import V3, Robot, RobotJoint, RobotLink, Visual, unused_name

DEEPEST = 40  # models within each other
GRAVITY: V3 = (0, 0, -9.8)  # of a world that says none
_ACTING = ("actor", "gripper", "plugin", "wind")
_SHAPES = {
    "box": ("box", ("size",)), "cylinder": ("cylinder", ("radius", "length")),
    "sphere": ("ball", ("radius",)), "mesh": ("mesh", ("scale",)),
}  # fmt: skip


def read_sdf(path: Path, floating: bool = True) -> Robot:
    """The links and joints in a file, not yet checked as a whole.

    ``floating``: links that no joint joins with the world move freely, else the first is fixed.

    Raises
    ------
    MechanismError
        If it cannot be read, is no SDFormat, or an element lacks something or has a wrong number.
    """
    root = parse(path)
    outermost = [*root.findall("world"), *root.findall("model")]
    if root.tag != "sdf" or len(outermost) != 1:
        raise MechanismError(
            f"{path.name!r}: the outermost element is <{root.tag}> with {len(outermost)} worlds or "
            "models, not <sdf> with one of them"
        )
    return _Reader(path, _is_before_1_5(root.get("version", ""))).robot(outermost[0], floating)


def _is_before_1_5(version: str) -> bool:
    return version.strip() in ("1.0", "1.2", "1.3", "1.4")


class _Reader:
    """The parts of a file with the scope of their names, and their frames."""

    def __init__(self, path: Path, in_model: bool) -> None:
        self.path, self.in_model = path, in_model
        self.frames = FrameGraph()
        self.frames.add_link(WORLD, Place())
        self.links: list[tuple[Part, str, bool]] = []  # whether it is static
        self.joints: list[tuple[Part, str]] = []
        self.skipped: list[str] = []

    def robot(self, outermost: Element, floating: bool) -> Robot:
        gravity = GRAVITY
        if outermost.tag == "world":
            self._collect(outermost, "", WORLD, False, 0)
            if outermost.find("gravity") is not None:
                x, y, z = Part(self.path, "world", outermost, WORLD).numbers_of("gravity", 3)
                gravity = (x, y, z)
        else:
            self._add_model(Part(self.path, "model", outermost), "", WORLD, False, 0)
        links = {scope + part.name: self._link(part, scope) for part, scope, _ in self.links}
        joints = []
        for part, scope in self.joints:
            joint, skipped = sdf_joint(part, self.frames, scope, self.in_model)
            joints.append(joint)
            self.skipped += skipped
        joints += self._joints_of_world(joints, floating)
        name = outermost.get("name") or self.path.stem
        return Robot(
            name, {WORLD: RobotLink(WORLD), **links}, tuple(joints), WORLD,
            skipped=tuple(self.skipped), gravity=gravity,
        )  # fmt: skip

    # -- what there is -----------------------------------------------------------------------

    def _add_model(self, part: Part, scope: str, outer: str, static: bool, depth: int) -> None:
        """Add a model with this scope of names within that whose frame is ``outer``."""
        element, pose = part.element, part.child("pose")
        if depth > DEEPEST or element.get("placement_frame"):
            part.refuse(f"has a placement_frame, or is within more than {DEEPEST} others")
        own, inner = f"{scope}{MODEL}", [*element.findall("link"), *element.findall("model")]
        first = element.get("canonical_link") or (inner[0].get("name", "") if inner else "")
        base = base_in(pose, outer.removesuffix(MODEL).removesuffix(WORLD), outer)
        self.frames.add(part, own, base, scope + first if first else WORLD)
        static = static or (element.findtext("static") or "").strip() in TRUE
        self._collect(element, scope, own, static, depth)

    def _collect(self, element: Element, scope: str, own: str, static: bool, depth: int) -> None:
        """Add the parts within a world or a model, whose frame is ``own``."""
        for each in element:
            if each.tag in ("link", "frame", "joint"):
                self._add(Part(self.path, each.tag, each), scope, own, static)
            elif each.tag == "model":
                part = Part(self.path, "model", each)
                self._add_model(part, f"{scope}{part.name}::", own, static, depth + 1)
            elif each.tag == "include":
                self.skipped.append(f"the model of another file, {each.findtext('uri')}")
            elif each.tag in _ACTING:
                self.skipped.append(f"the element <{each.tag}> {each.get('name', '')}".rstrip())

    def _add(self, part: Part, scope: str, own: str, static: bool) -> None:
        name, pose = scope + part.name, part.child("pose")
        if part.element.tag == "link":
            self.frames.add(part, name, base_in(pose, scope, own))
            self.links.append((part, scope, static))
        elif part.element.tag == "frame":
            given = part.element.get("attached_to")
            carrier = name_within(scope, given) if given else own
            self.frames.add(part, name, base_in(pose, scope, carrier), carrier)
        elif part.element.get("type") == "gearbox":
            self.skipped.append(f"the gearbox {name}")
        elif not static:
            child = name_within(scope, part.words_of("child"))
            self.frames.add(part, name, base_in(pose, scope, child), child)
            self.joints.append((part, scope))

    # -- links -------------------------------------------------------------------------------

    def _link(self, part: Part, scope: str) -> RobotLink:
        given, name = part.child("inertial"), scope + part.name
        if given is not None and given.get("auto") in TRUE:
            part.refuse("has the inertia of its shapes (auto): write it out")
        if (part.element.findtext("gravity") or "").strip() in ("false", "0"):
            self.skipped.append(f"that the link {name} has no weight")
        mass = number_in(part, "inertial/mass", 1)
        if mass < 0:
            part.refuse(f"has the mass {mass}, which is negative")
        inertia = (number_in(part, f"inertial/inertia/{entry}", int(entry[1] == entry[2]))
                   for entry in INERTIA)  # fmt: skip
        centre = pose_of(pose_in(part, "inertial/pose"))
        return RobotLink(name, mass, centre, tuple(inertia), tuple(self._visuals(part, scope)))

    def _visuals(self, link: Part, scope: str) -> Iterator[Visual]:
        name = scope + link.name
        for number, element in enumerate(link.element.findall("visual")):
            shape = element.find("geometry/*")
            if shape is None or shape.tag not in _SHAPES:
                continue
            label, (kind, tags) = f"{name} {number}" if number else name, _SHAPES[shape.tag]
            part = Part(self.path, "visual", element, label)
            sizes = [x for tag in tags for x in part.numbers_of(f"geometry/{shape.tag}/{tag}",
                     3 if tag in ("size", "scale") else 1)]  # fmt: skip
            if kind == "mesh" and shape.find("scale") is None:
                sizes = [1, 1, 1]
            base = self.frames.place_of(part, base_in(part.child("pose"), scope, name))
            pose = pose_of(self.frames.place(name).inverse().then(base).then(pose_in(part)))
            if all(x > 0 or (kind == "mesh" and x) for x in sizes):
                uri = (shape.findtext("uri") or "").strip()
                yield Visual(kind, label, tuple(sizes), pose, uri)

    # -- the world ---------------------------------------------------------------------------

    def _joints_of_world(
        self, joints: Iterable[RobotJoint], floating: bool
    ) -> Iterator[RobotJoint]:
        """Joints by which the world holds static links, and one of others that it does not."""
        around: dict[str, list[str]] = {}
        names = [joint.name for joint in joints]
        for joint in joints:
            around.setdefault(joint.parent, []).append(joint.child)
            around.setdefault(joint.child, []).append(joint.parent)
        still = [scope + part.name for part, scope, static in self.links if static]
        reached = _connected_links({WORLD, *still}, around)
        for name in (scope + part.name for part, scope, _ in self.links):
            if name in still or name not in reached:
                kind = "floating" if floating and name not in still else "fixed"
                names.append(unused_name(name, names))
                place = pose_of(self.frames.place(name))
                yield RobotJoint(names[-1], kind, WORLD, name, place)
                reached |= _connected_links({name}, around)


def _connected_links(links: Collection[str], around: Mapping[str, Iterable[str]]) -> set[str]:
    """The links that joints connect with these, and these."""
    reached, waiting = {*links}, [*links]
    while waiting:
        beyond = {*around.get(waiting.pop(), ())} - reached
        reached |= beyond
        waiting += beyond
    return reached
