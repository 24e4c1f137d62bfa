"""A URDF file -> Robot.

The file is untrusted: a document type, by which entities are declared, is refused, nothing else is
opened, and every number is finite.  Errors name the link or joint.
"""

from __future__ import annotations

import stat
from collections.abc import Iterable
from pathlib import Path
from typing import Any, NoReturn
from xml.etree.ElementTree import Element, TreeBuilder
from xml.parsers import expat

from mechc_codegen.description.joints.kinds import kinds_by
from mechc_codegen.errors import MechanismError
from mechc_codegen.robots.files.elements import Part
from mechc_codegen.robots.files.known_parts import URDF, unknown_parts
from mechc_codegen.robots.files.read_loops import with_loops
from mechc_codegen.robots.robot import Mimic, Number, Robot, RobotJoint, RobotLink, Visual

KINDS = kinds_by("urdf")
LARGEST = 2**25  # bytes: the largest public robots have less than a hundredth of it
MOST_PARTS = 200_000  # elements and attributes, each of which takes some hundred bytes
INERTIA = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")


def read_robot(path: Path) -> Robot:
    """The links and joints in a file, not yet checked as a whole.

    Raises
    ------
    MechanismError
        If it cannot be read, is no URDF, or an element lacks something or has a wrong number.
    """
    root = parse(path)
    if root.tag != "robot":
        raise MechanismError(f"{path.name!r}: the outermost element is <{root.tag}>, not <robot>")
    if any(each.tag.startswith("xacro:") for each in root.iter()):
        raise MechanismError(
            f"{path.name!r} contains macros of xacro: expand them first, xacro FILE > robot.urdf"
        )
    links = [_link(Part(path, "link", each)) for each in root.findall("link")]
    joints = [_joint(Part(path, "joint", each)) for each in root.findall("joint")]
    _refuse_repeats(path, "link", [link.name for link in links])
    _refuse_repeats(path, "joint", [joint.name for joint in joints])
    robot = Robot(
        root.get("name") or path.stem, {link.name: link for link in links}, tuple(joints),
        skipped=tuple(unknown_parts(root, table=URDF)),
    )  # fmt: skip
    robot = with_loops(robot, path, root)
    _refuse_repeats(path, "joint", [joint.name for joint in robot.joints])
    return robot


# -- the document -----------------------------------------------------------------------------


def path_of(given: Any) -> Path:
    """The path that a caller gives; raises ``TypeError`` for anything but a text or a path."""
    try:
        return Path(given)
    except TypeError:
        kind = type(given).__name__
        raise TypeError(f"a path is a text or a pathlib.Path, not of type {kind}") from None


def parse(path: Path) -> Element:
    """The outermost element of a file in XML.

    Raises
    ------
    MechanismError
        If it cannot be read, is no file, is larger than ``LARGEST``, has more than ``MOST_PARTS``,
        declares a document type or is no XML.
    """
    count = 0

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal count
        count += 1 + len(attributes)
        if count > MOST_PARTS:
            raise MechanismError(f"{path.name!r} has more than {MOST_PARTS} elements, attributes")
        builder.start(tag, attributes)

    try:
        status = path.stat()
        if stat.S_ISFIFO(status.st_mode) or stat.S_ISCHR(status.st_mode):  # they may have no end
            raise MechanismError(f"{path.name!r} is a pipe or a device, not a file")
        if status.st_size > LARGEST:
            raise MechanismError(f"{path.name!r} is larger than {LARGEST >> 20} MiB")
        builder, parser = TreeBuilder(), expat.ParserCreate()
        parser.StartElementHandler = start
        parser.EndElementHandler = builder.end
        parser.CharacterDataHandler = builder.data
        parser.StartDoctypeDeclHandler = _refuse_doctype
        parser.Parse(path.read_bytes(), True)
        return builder.close()
    except OSError as error:
        raise MechanismError(f"{str(path)!r} cannot be read: {error.strerror}") from None
    except (expat.ExpatError, ValueError, LookupError) as error:
        if isinstance(error, MechanismError):
            raise
        raise MechanismError(f"{path.name!r} is not XML: {error}") from None


def _refuse_doctype(*_: Any) -> NoReturn:
    raise MechanismError("the file declares a document type (<!DOCTYPE>); a robot needs none")


def _refuse_repeats(path: Path, kind: str, names: Iterable[str]) -> None:
    seen: set[str] = set()
    for name in names:
        if name in seen:
            raise MechanismError(f"{path.name!r}: more than one {kind} is called {name!r}")
        seen.add(name)


# -- links and joints -------------------------------------------------------------------------


def _link(part: Part) -> RobotLink:
    visuals = tuple(_visuals(part))
    given = part.child("inertial")
    if given is None:
        return RobotLink(part.name, visuals=visuals)
    mass = part.number(part.required("inertial/mass"), "value", None)
    if mass < 0:
        part.refuse(f"has the mass {mass}, which is negative")
    entries = given.find("inertia")
    products = 0 if entries is None else None  # of inertia, a missing moment is none of zero
    inertia = tuple(
        part.number(entries, entry, 0 if entry[1] != entry[2] else products) for entry in INERTIA
    )
    return RobotLink(part.name, mass, part.pose(given), inertia, visuals)


def _visuals(part: Part) -> Iterable[Visual]:
    """The boxes, cylinders, spheres and meshes; the files of these are not opened."""
    for number, visual in enumerate(part.element.findall("visual")):
        shape = visual.find("geometry/*")
        label = visual.get("name") or (f"{part.name} {number}" if number else part.name)
        sizes = () if shape is None else _sizes(part, shape)
        if sizes and shape is not None:
            kind = "ball" if shape.tag == "sphere" else str(shape.tag)
            yield Visual(kind, label, sizes, part.pose(visual), shape.get("filename", ""))


def _sizes(part: Part, shape: Element) -> tuple[Number, ...]:
    sizes: tuple[Number, ...] = ()
    if shape.tag == "box":
        sizes = part.vector(shape, "size")
    elif shape.tag in ("cylinder", "sphere"):
        wanted = ("radius", "length") if shape.tag == "cylinder" else ("radius",)
        sizes = tuple(part.number(shape, each, None) for each in wanted)
    elif shape.tag == "mesh":
        sizes = part.vector(shape, "scale", (1, 1, 1))
    if shape.tag != "mesh" and any(size < 0 for size in sizes):
        part.refuse(f"has a <{shape.tag}> of negative size")
    return sizes if all(sizes) else ()


def _joint(part: Part) -> RobotJoint:
    kind = part.element.get("type", "")
    if kind not in KINDS:
        part.refuse(f"has the type {kind!r}; known are {', '.join(KINDS)}")
    dynamics = part.child("dynamics")
    damping, friction = (part.number(dynamics, name, 0) for name in ("damping", "friction"))
    if damping < 0 or friction < 0:
        part.refuse("has damping or friction that is negative")
    return RobotJoint(
        part.name,
        kind,
        part.name_in("parent", "link"),
        part.name_in("child", "link"),
        part.pose(part.element),
        part.axis(part.child("axis")) if KINDS[kind].has_axis else (1, 0, 0),
        _limits(part, kind),
        damping,
        friction,
        _mimic(part, kind),
    )


def _limits(part: Part, kind: str) -> dict[str, Number]:
    given = part.child("limit")
    if given is None:
        return {}
    present = [name for name in ("velocity", "effort") if name in given.attrib]
    found: dict[str, Number] = {name: part.number(given, name, 0) for name in present}
    if kind in ("revolute", "prismatic"):
        lower, upper = (part.number(given, name, 0) for name in ("lower", "upper"))
        if lower > upper:
            part.refuse(f"has the lower limit {lower} above its upper one, {upper}")
        found |= {"lower": lower, "upper": upper}
    return found


def _mimic(part: Part, kind: str) -> Mimic | None:
    given = part.child("mimic")
    if given is None or kind == "fixed":
        return None
    if not KINDS[kind].unit:
        part.refuse(f"is {kind}, so it cannot mimic another")
    return Mimic(
        part.name_in("mimic", "joint"),
        part.number(given, "multiplier", 1),
        part.number(given, "offset", 0),
    )
