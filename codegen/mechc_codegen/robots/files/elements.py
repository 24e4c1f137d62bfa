"""Elements of a robot's file, read with errors that name the link or joint."""

from __future__ import annotations

import re
from math import hypot, isfinite
from pathlib import Path
from typing import Any, NoReturn
from xml.etree.ElementTree import Element

from mechc_codegen.errors import MechanismError
from mechc_codegen.robots.robot import ORIGIN, V3, Number, Pose

LONGEST = 1000  # letters of a name, of which each symbol and its code has copies
TRUE, FALSE = ("true", "1"), ("false", "0")
_NUMBER = re.compile(r"[-+]?(\d+(\.\d*)?|\.\d+)([eE][-+]?\d+)?", re.ASCII)


class Part:
    """A link or a joint, with the words that errors about it begin with."""

    def __init__(self, path: Path, kind: str, element: Element, name: str = "") -> None:
        self.element = element
        self.name = element.get("name", name)
        self._words = f"{path.name!r}: the {kind} {self.name!r}"
        if not self.name:
            raise MechanismError(f"{path.name!r}: a {kind} has no name")
        if len(self.name) > LONGEST:
            raise MechanismError(
                f"{path.name!r}: a {kind} has a name of {len(self.name)} letters, {LONGEST} at most"
            )

    def refuse(self, why: str) -> NoReturn:
        raise MechanismError(f"{self._words} {why}")

    def child(self, tag: str) -> Element | None:
        return self.element.find(tag)

    def required(self, tag: str) -> Element:
        found = self.child(tag)
        return self.refuse(f"lacks <{tag.rpartition('/')[2]}>") if found is None else found

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

    def axis(self, element: Element | None, default: V3 = (1, 0, 0), attribute: str = "xyz") -> V3:
        """A direction, of length one; the default where there is no element."""
        if element is not None and attribute not in element.attrib:
            self.refuse(f"lacks {attribute}=... in <{element.tag}>")
        return self.direction(self.vector(element, attribute, default))

    def direction(self, vector: V3) -> V3:
        x, y, z = vector
        length = hypot(x, y, z)
        if length == 0 or not isfinite(length):
            self.refuse("has an axis without direction")
        if sorted((abs(x), abs(y), abs(z)))[1] == 0:  # along x, y or z: exactly
            return _sign(x), _sign(y), _sign(z)
        return x / length, y / length, z / length

    def truth(self, text: str | None, what: str, default: bool = False) -> bool:
        """A boolean of SDFormat, in letters of either case; the default where there is no text."""
        word = (text or "").strip().lower()
        if word not in ("", *TRUE, *FALSE):
            self.refuse(f"has {what}={word[:60]!r}, neither true nor false")
        return word in TRUE if word else default

    def words_of(self, tag: str) -> str:
        """The text within an element."""
        element = self.child(tag)
        found = "" if element is None else (element.text or "").strip()
        return found or self.refuse(f"lacks <{tag}>...</{tag}>")

    def numbers_of(self, tag: str, count: int) -> list[Number]:
        """The numbers within an element; zeros where there is none."""
        element = self.child(tag)
        if element is None:
            return [0] * count
        return self._read(element, "text", (element.text or "").split(), count)

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


def _sign(x: Number) -> int:
    return (x > 0) - (x < 0)
