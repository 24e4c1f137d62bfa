"""Kinds of quantities, and named numbers of a model: unit, kind and bounds.

Kinds decide in code; unit texts are only printed.  The compiler gives each quantity its kind, as
part of the metadata of a scene.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, Any

import numpy as np

from mechc.errors import ValueOutOfBoundsError

if TYPE_CHECKING:
    from numpy.typing import NDArray

ENERGIES = ("kinetic_energy", "potential_energy")
SUMS = {"energy": ENERGIES}  # outputs that are sums of others


class Kind(StrEnum):
    """Kinds of quantities, with the members of the compiler's ``mechc.Kind``."""

    ANGLE = "angle"
    ANGULAR_SPEED = "angular speed"
    LENGTH = "length"
    SPEED = "speed"
    PURE = "pure number"
    PURE_RATE = "rate of a pure number"
    MASS = "mass"
    TIME = "time"
    OTHER = "other"


ANGULAR = frozenset((Kind.ANGLE, Kind.ANGULAR_SPEED))
DIMENSIONLESS = ANGULAR | {Kind.PURE, Kind.PURE_RATE}
# Angles are in radians in the API; people read degrees.
_IN_DEGREES = {Kind.ANGLE: "°", Kind.ANGULAR_SPEED: "°/s"}


def shown_in(kind: Kind, unit: str) -> tuple[str, float]:
    """The unit for display, and the factor that values are multiplied by for it."""
    if kind in _IN_DEGREES:
        return _IN_DEGREES[kind], math.degrees(1.0)
    return unit, 1.0


@dataclass(frozen=True)
class NamedQuantity:
    """A named number: unit, description, bounds (finite ones excluded unless ``closed``), kind."""

    name: str
    unit: str
    description: str
    lower: float
    upper: float
    closed: bool
    kind: Kind = Kind.OTHER

    @classmethod
    def from_metadata(cls, data: Mapping[str, Any]) -> NamedQuantity:
        lower = -math.inf if data["lower"] is None else data["lower"]
        upper = math.inf if data["upper"] is None else data["upper"]
        texts = (data["name"], data["unit"], data["description"])
        return cls(*texts, lower, upper, data["closed"], Kind(data["kind"]))

    @property
    def bounds_in_words(self) -> str:
        """The bounds in words: ``> 0``, ``>= 0``, ``between 0 and 1`` or ``any``."""
        sign = "=" if self.closed else ""
        words = []
        if math.isfinite(self.lower):
            words.append(f">{sign} {self.lower:g}")
        if math.isfinite(self.upper):
            words.append(f"<{sign} {self.upper:g}")
        return " and ".join(words) or "any"

    @property
    def any_value(self) -> float:
        """A value within the bounds: 1 where it is."""
        if self.lower < 1.0 < self.upper:
            return 1.0
        if math.isfinite(self.lower) and math.isfinite(self.upper):
            return 0.5 * (self.lower + self.upper)
        return self.lower + 1.0 if math.isfinite(self.lower) else self.upper - 1.0

    def check(self, value: NDArray[np.float64]) -> None:
        """Raise :class:`ValueOutOfBoundsError` unless every value is finite and within bounds."""
        inside = np.isfinite(value) & (value >= self.lower) & (value <= self.upper)
        if not self.closed:
            inside &= (value > self.lower) & (value < self.upper)
        if not np.all(inside):
            bad = float(np.ravel(value)[np.argmin(np.ravel(inside))])
            unit = f" {self.unit}" if self.unit and self.kind is not Kind.PURE else ""
            told = f" ({self.description})" if self.description else ""
            raise ValueOutOfBoundsError(
                f"{self.name} = {bad:g}{unit}{told} must be finite"
                + (f" and {self.bounds_in_words}" if self.bounds_in_words != "any" else "")
            )
