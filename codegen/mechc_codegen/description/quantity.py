"""Quantities: the kind, unit and bounds of a number of a mechanism."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from math import inf


class Kind(StrEnum):
    """The kind of a quantity, where code depends on it; everything else is ``OTHER``.

    Angles may be reduced by whole turns, lengths set the scale of a mechanism, pure numbers have
    the scale 1.
    """

    ANGLE = "angle"
    ANGULAR_SPEED = "angular speed"
    LENGTH = "length"
    SPEED = "speed"
    PURE = "pure number"
    PURE_RATE = "rate of a pure number"
    MASS = "mass"
    TIME = "time"
    OTHER = "other"


_KINDS = {
    "rad": Kind.ANGLE,
    "rad/s": Kind.ANGULAR_SPEED,
    "m": Kind.LENGTH,
    "m/s": Kind.SPEED,
    "1": Kind.PURE,
    "1/s": Kind.PURE_RATE,
    "kg": Kind.MASS,
    "s": Kind.TIME,
}


@dataclass(frozen=True)
class Quantity:
    """A quantity: its unit, its bounds, a description in one line, and its kind.

    ``lower`` and ``upper`` bound the value; finite bounds are themselves excluded unless
    ``closed``.  ``kind`` follows from the unit by default; only this class reads the unit.
    """

    unit: str
    description: str
    lower: float = -inf
    upper: float = inf
    closed: bool = False
    kind: Kind = None  # type: ignore[assignment]  # a Kind once the object is made

    def __post_init__(self) -> None:
        kind = _KINDS.get(self.unit, Kind.OTHER) if self.kind is None else Kind(self.kind)
        object.__setattr__(self, "kind", kind)

    def with_unit(self, unit: str) -> Quantity:
        """The same in another unit, with the kind that follows from it."""
        return Quantity(unit, self.description, self.lower, self.upper, self.closed)
