"""A URDF file -> Robot.

The file is untrusted: a document type, by which entities are declared, is refused, nothing else is
opened, and every number is finite.  Errors name the link or joint.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from math import hypot, isfinite
from pathlib import Path
from typing import Any, NoReturn
from xml.etree.ElementTree import Element, TreeBuilder
from xml.parsers import expat

from mechc_codegen.errors import MechanismError
from mechc_codegen.robots.robot import (
    ORIGIN,
    URDF_KINDS,
    V3,
    WITH_AXIS,
    Mimic,
    Number,
    Pose,
    Robot,
    RobotJoint,
    RobotLink,
    Visual,
)

LARGEST = 2**25  # bytes: the largest public robots have less than a hundredth of it
_NUMBER = re.compile(r"[-+]?(\d+(\.\d*)?|\.\d+)([eE][-+]?\d+)?", re.ASCII)
_INERTIA = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")


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
    links = [_link(_Part(path, "link", each)) for each in root.findall("link")]
    joints = [_joint(_Part(path, "joint", each)) for each in root.findall("joint")]
    _refuse_repeats(path, "link", [link.name for link in links])
    _refuse_repeats(path, "joint", [joint.name for joint in joints])
    name = root.get("name") or path.stem
    return Robot(name, {link.name: link for link in links}, tuple(joints))


# -- the document -----------------------------------------------------------------------------


def parse(path: Path) -> Element:
    """The outermost element of a file in XML.

    Raises
    ------
    MechanismError
        If it cannot be read, is larger than ``LARGEST``, declares a document type or is no XML.
    """
    try:
        if path.stat().st_size > LARGEST:
            raise MechanismError(f"{path.name!r} is larger than {LARGEST >> 20} MiB")
        builder, parser = TreeBuilder(), expat.ParserCreate()
        parser.StartElementHandler = builder.start
        parser.EndElementHandler = builder.end
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


class _Part:
    """A link or a joint, with the words that errors about it begin with."""

    def __init__(self, path: Path, kind: str, element: Element) -> None:
        self.element = element
        self.name = element.get("name", "")
        self._words = f"{path.name!r}: the {kind} {self.name!r}"
        if not self.name:
            raise MechanismError(f"{path.name!r}: a {kind} has no name")

    def refuse(self, why: str) -> NoReturn:
        raise MechanismError(f"{self._words} {why}")

    def child(self, tag: str) -> Element | None:
        return self.element.find(tag)

    def name_in(self, tag: str, attribute: str) -> str:
        element = self.child(tag)
        found = None if element is None else element.get(attribute)
        if not found:
            self.refuse(f"lacks <{tag} {attribute}=...>")
        return found

    def number(self, element: Element | None, attribute: str, default: Number | None) -> Any:
        """A number, the default where there is none; without a default it is required."""
        text = None if element is None else element.get(attribute)
        if text is None:
            if default is None:
                self.refuse(f"lacks {attribute}=... in <{getattr(element, 'tag', '')}>")
            return default
        return self._read(element, attribute, text.split(), 1)[0]

    def vector(self, element: Element | None, attribute: str, default: V3 = ORIGIN) -> V3:
        text = None if element is None else element.get(attribute)
        if text is None:
            return default
        x, y, z = self._read(element, attribute, text.split(), 3)
        return x, y, z

    def pose(self, element: Element | None) -> Pose:
        """The <origin> within an element."""
        origin = None if element is None else element.find("origin")
        return Pose(self.vector(origin, "xyz"), self.vector(origin, "rpy"))

    def _read(
        self, element: Element | None, attribute: str, words: list[str], count: int
    ) -> list[Number]:
        tag = getattr(element, "tag", "")
        if len(words) != count or not all(map(_NUMBER.fullmatch, words)):
            numbers = "a number" if count == 1 else f"{count} numbers"
            self.refuse(f"has {attribute}={' '.join(words)[:60]!r} in <{tag}>, not {numbers}")
        values = [float(word) for word in words]
        if not all(map(isfinite, values)):
            self.refuse(f"has a number without bounds in {attribute}=... of <{tag}>")
        return [int(x) if x in (-1.0, 0.0, 1.0) else x for x in values]


def _link(part: _Part) -> RobotLink:
    visuals = tuple(_visuals(part))
    given = part.child("inertial")
    if given is None:
        return RobotLink(part.name, visuals=visuals)
    mass = part.number(given.find("mass"), "value", 0)
    if mass < 0:
        part.refuse(f"has the mass {mass}, which is negative")
    entries = given.find("inertia")
    inertia = tuple(part.number(entries, entry, 0) for entry in _INERTIA)
    return RobotLink(part.name, mass, part.pose(given), inertia, visuals)


def _visuals(part: _Part) -> Iterable[Visual]:
    """The boxes, cylinders and spheres; meshes are files, which are not opened."""
    for number, visual in enumerate(part.element.findall("visual")):
        shape = visual.find("geometry/*")
        label = visual.get("name") or (f"{part.name} {number}" if number else part.name)
        sizes = () if shape is None else _sizes(part, shape)
        if sizes and shape is not None:
            kind = "ball" if shape.tag == "sphere" else str(shape.tag)
            yield Visual(kind, label, sizes, part.pose(visual))


def _sizes(part: _Part, shape: Element) -> tuple[Number, ...]:
    sizes: tuple[Number, ...] = ()
    if shape.tag == "box":
        sizes = part.vector(shape, "size")
    elif shape.tag in ("cylinder", "sphere"):
        wanted = ("radius", "length") if shape.tag == "cylinder" else ("radius",)
        sizes = tuple(part.number(shape, each, None) for each in wanted)
    if any(size < 0 for size in sizes):
        part.refuse(f"has a <{shape.tag}> of negative size")
    return sizes if all(sizes) else ()


def _joint(part: _Part) -> RobotJoint:
    kind = part.element.get("type", "")
    if kind not in URDF_KINDS:
        part.refuse(f"has the type {kind!r}; known are {', '.join(URDF_KINDS)}")
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
        _axis(part) if kind in WITH_AXIS else (1, 0, 0),
        _limits(part, kind),
        damping,
        friction,
        _mimic(part, kind),
    )


def _axis(part: _Part) -> V3:
    x, y, z = part.vector(part.child("axis"), "xyz", (1, 0, 0))
    length = hypot(x, y, z)
    if length == 0 or not isfinite(length):
        part.refuse("has an axis without direction")
    if sorted((abs(x), abs(y), abs(z)))[1] == 0:  # along x, y or z: exactly
        return _sign(x), _sign(y), _sign(z)
    return x / length, y / length, z / length


def _sign(x: Number) -> int:
    return (x > 0) - (x < 0)


def _limits(part: _Part, kind: str) -> dict[str, Number]:
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


def _mimic(part: _Part, kind: str) -> Mimic | None:
    given = part.child("mimic")
    if given is None or kind == "fixed":
        return None
    if kind in ("floating", "planar"):
        part.refuse(f"is {kind}, so it cannot mimic another")
    return Mimic(
        part.name_in("mimic", "joint"),
        part.number(given, "multiplier", 1),
        part.number(given, "offset", 0),
    )
