"""A named number of a model: its unit, kind and bounds."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from mechc.errors import ValueOutOfBoundsError
from mechc.system.kinds import Kind

if TYPE_CHECKING:
    from numpy.typing import NDArray

ENERGIES = ("kinetic_energy", "potential_energy")
SUMS = {"energy": ENERGIES}  # outputs that are sums of others


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
