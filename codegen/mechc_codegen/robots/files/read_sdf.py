"""An SDFormat file -> Robot, whose root is the world.

The file is untrusted, as one in URDF.  Read are models, in a world and in each other, with links,
joints, frames, inertials and visuals; what else moves or acts is named in ``skipped``.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Iterator, Mapping
from pathlib import Path
from xml.etree.ElementTree import Element

from mechc_codegen.errors import MechanismError
from mechc_codegen.robots.files.elements import Part
from mechc_codegen.robots.files.known_parts import SDF, unknown_parts
from mechc_codegen.robots.files.read_urdf import INERTIA, parse
from mechc_codegen.robots.files.sdf_joints import (
    MODEL,
    WORLD,
    FrameGraph,
    base_in,
    name_within,
    number_in,
    pose_in,
    sdf_joint,
)
from mechc_codegen.robots.geometry import Place, pose_of
from mechc_codegen.robots.robot import (
    V3,
    Number,
    Robot,
    RobotJoint,
    RobotLink,
    Visual,
    unused_name,
)

DEEPEST = 40  # models within each other
GRAVITY: V3 = (0, 0, -9.8)  # of a world that says none
NEWEST = 12  # what is read is as of SDFormat 1.12
_ACTING = ("actor", "gripper", "model_state", "plugin", "population", "state", "wind")
_NO_SHAPE = "empty"
_DIGITS = 1e-5  # by which rounding of an inertia in a file changes its moments, of the largest
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
    reader = _Reader(path, _version(path, root))
    reader.skipped += unknown_parts(root, table=SDF)
    return reader.robot(outermost[0], floating)


def _version(path: Path, root: Element) -> int:
    """The n of SDFormat 1.n, on which it depends where weight is and in what axes are given."""
    given = root.get("version", "").strip()
    if not re.fullmatch(r"1\.\d{1,3}", given, re.ASCII):
        raise MechanismError(
            f"{path.name!r}: the version of SDFormat is {given[:60]!r}, not one like '1.{NEWEST}'"
        )
    return int(given[2:])


class _Reader:
    """The parts of a file with the scope of their names, and their frames."""

    def __init__(self, path: Path, version: int) -> None:
        self.path, self.version = path, version
        self.frames = FrameGraph()
        self.frames.add_link(WORLD, Place())
        self.links: list[tuple[Part, str, bool]] = []  # whether it is static
        self.joints: list[tuple[Part, str]] = []
        self.models: list[tuple[Part, str]] = []
        self.skipped: list[str] = []
        self.undrawn = dict[str, list[str]]()
        if version > NEWEST:
            self.skipped.append(f"what is new since SDFormat 1.{NEWEST}: the file is 1.{version}")

    def robot(self, outermost: Element, floating: bool) -> Robot:
        gravity = GRAVITY
        if outermost.tag == "world":
            self._collect(outermost, "", WORLD, False, 0)
            gravity = self._gravity(Part(self.path, "world", outermost, WORLD))
        else:
            self._add_model(Part(self.path, "model", outermost), "", WORLD, False, 0)
        for part, own in self.models:
            self.frames.link(part, own)  # by its canonical link, which there has to be
        links = {scope + part.name: self._link(part, scope) for part, scope, _ in self.links}
        joints = []
        for part, scope in self.joints:
            joint, skipped = sdf_joint(part, self.frames, scope, self.version < 5)
            joints.append(joint)
            self.skipped += skipped
        joints += self._joints_of_world(joints, floating)
        self.skipped += [f"{what}: {', '.join(names)}" for what, names in self.undrawn.items()]
        name = outermost.get("name") or self.path.stem
        return Robot(
            name, {WORLD: RobotLink(WORLD), **links}, tuple(joints), WORLD,
            skipped=tuple(self.skipped), gravity=gravity,
        )  # fmt: skip

    def _gravity(self, world: Part) -> V3:
        older = "physics/gravity"
        tags = ["gravity"]
        if self.version < 6:
            tags = [older, *tags]
        elif world.child(older) is not None:
            self.skipped.append("<gravity> in <physics>, where it is until SDFormat 1.5")
        for tag in (each for each in tags if world.child(each) is not None):
            x, y, z = world.numbers_of(tag, 3)
            return x, y, z
        return GRAVITY

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
        self.models.append((part, own))
        static = static or part.truth(element.findtext("static"), "static")
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
                self.frames.hint = "; models of other files are not read: gz sdf -p adds them to it"
            elif each.tag in _ACTING:
                self.skipped.append(f"the element <{each.tag}> {each.get('name', '')}".rstrip())

    def _add(self, part: Part, scope: str, own: str, static: bool) -> None:
        name, pose, kind = scope + part.name, part.child("pose"), part.element.get("type")
        if part.name == WORLD or (part.name.startswith("__") and part.name.endswith("__")):
            part.refuse("has a name that SDFormat reserves")
        if part.element.tag == "link":
            self.frames.add(part, name, base_in(pose, scope, own))
            self.links.append((part, scope, static))
        elif part.element.tag == "frame":
            given = part.element.get("attached_to")
            carrier = name_within(scope, given) if given else own
            self.frames.add(part, name, base_in(pose, scope, carrier), carrier)
        else:  # others may refer to the frame of a joint that does not move
            child = name_within(scope, part.words_of("child"))
            self.frames.add(part, name, base_in(pose, scope, child), child)
            if kind == "gearbox":
                self.skipped.append(f"the gearbox {name}")
            elif not static:
                self.joints.append((part, scope))

    # -- links -------------------------------------------------------------------------------

    def _link(self, part: Part, scope: str) -> RobotLink:
        given, name = part.child("inertial"), scope + part.name
        if given is not None and part.truth(given.get("auto"), "auto"):
            part.refuse("has the inertia of its shapes (auto): write it out")
        if base_in(part.child("inertial/pose"), "", ""):
            part.refuse("has a <pose> in <inertial> that is relative to another frame")
        self.skipped += [f"{what} the link {name}{ends}" for what, ends in _untaken_of(part)]
        mass = number_in(part, "inertial/mass", 1)
        if mass < 0:
            part.refuse(f"has the mass {mass}, which is negative")
        inertia = tuple(number_in(part, f"inertial/inertia/{entry}", int(entry[1] == entry[2]))
                        for entry in INERTIA)  # fmt: skip
        if not _is_of_a_body(*inertia):
            part.refuse(f"has an inertia that no body has, with a negative moment: {inertia}")
        centre = pose_of(pose_in(part, "inertial/pose"))
        return RobotLink(name, mass, centre, inertia, tuple(self._visuals(part, scope)))

    def _visuals(self, link: Part, scope: str) -> Iterator[Visual]:
        name = scope + link.name
        for number, element in enumerate(link.element.findall("visual")):
            shape = element.find("geometry/*")
            if shape is None or shape.tag not in _SHAPES:
                if shape is not None and shape.tag != _NO_SHAPE:
                    self._leave(f"the drawing of shapes (<{shape.tag}>)", name)
                continue
            label, (kind, tags) = f"{name} {number}" if number else name, _SHAPES[shape.tag]
            part = Part(self.path, "visual", element, label)
            sizes = [x for tag in tags for x in part.numbers_of(f"geometry/{shape.tag}/{tag}",
                     3 if tag in ("size", "scale") else 1)]  # fmt: skip
            if kind == "mesh" and shape.find("scale") is None:
                sizes = [1, 1, 1]
            if kind != "mesh" and any(size < 0 for size in sizes):
                link.refuse(f"has a <{shape.tag}> of negative size")
            if shape.find("submesh") is not None:
                self._leave("that of a mesh one part is drawn (<submesh>)", name)
            base = self.frames.place_of(part, base_in(part.child("pose"), scope, name))
            pose = pose_of(self.frames.place(name).inverse().then(base).then(pose_in(part)))
            if all(sizes):
                uri = (shape.findtext("uri") or "").strip()
                yield Visual(kind, label, tuple(sizes), pose, uri)

    def _leave(self, what: str, link: str) -> None:
        self.undrawn.setdefault(what, []).append(link)

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
        still = {scope + part.name for part, scope, static in self.links if static}
        reached = _connected_links({WORLD, *still}, around)
        for name in (scope + part.name for part, scope, _ in self.links):
            if name in still or name not in reached:
                kind = "floating" if floating and name not in still else "fixed"
                names.append(unused_name(name, names))
                place = pose_of(self.frames.place(name))
                yield RobotJoint(names[-1], kind, WORLD, name, place)
                reached |= _connected_links({name}, around)


def _untaken_of(link: Part) -> Iterator[tuple[str, str]]:
    """Parts of a link that are not taken and act on its motion: words before and after its name."""
    for tag, default, words in (
        ("gravity", True, ("that", " has no weight")),
        ("kinematic", False, ("that", " is kinematic")),
    ):
        if link.truth(link.element.findtext(tag), tag, default) is not default:
            yield words
    if any(number_in(link, f"velocity_decay/{which}", 0) for which in ("linear", "angular")):
        yield "velocity_decay of", ""
    if link.child("inertial/fluid_added_mass") is not None:
        yield "fluid_added_mass of", ""


def _is_of_a_body(xx: Number, xy: Number, xz: Number, yy: Number, yz: Number, zz: Number) -> bool:
    """Whether no principal moment is negative, but for the digits of a file."""
    size = max(map(abs, (xx, yy, zz, xy, xz, yz)))
    minors = xx * yy - xy * xy, xx * zz - xz * xz, yy * zz - yz * yz
    whole = xx * minors[2] - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz)
    least = -_DIGITS * size
    return min(xx, yy, zz) >= least and min(minors) >= least * size and whole >= least * size**2


def _connected_links(links: Collection[str], around: Mapping[str, Iterable[str]]) -> set[str]:
    """The links that joints connect with these, and these."""
    reached, waiting = {*links}, [*links]
    while waiting:
        beyond = {*around.get(waiting.pop(), ())} - reached
        reached |= beyond
        waiting += beyond
    return reached
