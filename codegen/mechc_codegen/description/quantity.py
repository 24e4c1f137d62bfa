"""Quantities: the kind, unit and bounds of a number of a mechanism."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from math import inf
from typing import Any

from sympy import Symbol

from mechc_codegen.errors import MechanismError


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


PURE = (Kind.ANGLE, Kind.ANGULAR_SPEED, Kind.PURE, Kind.PURE_RATE)  # their scale is 1
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
        if not isinstance(self.unit, str):
            raise MechanismError(f"a unit is a text, such as 'm/s', not {str(self.unit)[:60]}")
        kind = _KINDS.get(self.unit, Kind.OTHER) if self.kind is None else Kind(self.kind)
        object.__setattr__(self, "kind", kind)

    def of_sign(self, symbol: Symbol) -> Quantity:
        """A copy with the bounds that the symbol's assumptions have; zero is within them.

        SymPy writes Abs(k*x) as k*Abs(x) where k is positive, which is wrong of another value.
        """
        lower = max(self.lower, 0.0) if symbol.is_nonnegative else self.lower
        upper = min(self.upper, 0.0) if symbol.is_nonpositive else self.upper
        if (lower, upper) == (self.lower, self.upper):
            return self
        sign = "non-negative" if symbol.is_nonnegative else "non-positive"
        told = self.description or f"declared {sign}"
        closed = self.closed or (self.lower, self.upper) == (-inf, inf)
        return Quantity(self.unit, told, lower, upper, closed, self.kind)

    def of_rod(self, name: str) -> Quantity:
        """A copy that is positive, and in metres where it had no unit."""
        told, unit = self.description or f"length of the rod {name}", self.unit or "m"
        return Quantity(unit, told, max(self.lower, 0.0), self.upper, False)

    def with_unit(self, unit: str) -> Quantity:
        """A copy with another unit, and with the kind that follows from that unit."""
        return Quantity(unit, self.description, self.lower, self.upper, self.closed)


_NUMBER = re.compile(r"\s*+[-+]?+\.?+\d")
_readers: list[Callable[[Any, str, Quantity], Any]] = []


def read_values_with(reader: Callable[[Any, str, Quantity], Any]) -> None:
    """Read values with units by a program's own function of value, name and quantity, which this
    package cannot import."""
    _readers[:] = [reader]


def in_si(value: Any, name: str, quantity: Quantity) -> Any:
    """A number in SI units of a text, "30 mm", or of a quantity of pint; all else is kept.

    Raises
    ------
    MechanismError
        For a number with a unit that is not one of the quantity's.
    """
    typed = isinstance(value, str) and _NUMBER.match(value)
    if not _readers or not (typed or (hasattr(value, "magnitude") and hasattr(value, "to"))):
        return value
    try:
        return _readers[0](value, name, quantity)
    except ValueError as error:
        raise MechanismError(str(error)) from None


# Units that are multiples of SI units, which is what all values are in.
_SCALED = {
    **dict.fromkeys(("deg", "degree", "degrees", "°", "rev", "turn", "turns", "grad"), "rad"),
    **dict.fromkeys(("mm", "cm", "dm", "km", "um", "µm", "nm", "inch", "ft", "feet"), "m"),
    **dict.fromkeys(("g", "mg", "lb", "lbs", "oz"), "kg"),
    **dict.fromkeys(("ms", "us", "µs", "ns", "min", "h", "hour", "hours", "day", "days"), "s"),
    **dict.fromkeys(("kN", "MN", "lbf", "kgf"), "N"),
    **dict.fromkeys(("kPa", "MPa", "GPa", "hPa", "bar", "psi"), "Pa"),
    **dict.fromkeys(("kW", "MW", "hp"), "W"),
    "kJ": "J",
    "kHz": "Hz",
    "rpm": "rad/s",
}


def refuse_scaled(name: str, unit: str) -> None:
    """Refuse a unit that is a multiple of an SI unit: values are not converted.

    Raises
    ------
    MechanismError
        The message names the SI unit.
    """
    for word in re.findall(r"[^\W\d_]+|°", unit):
        if word in _SCALED:
            raise MechanismError(
                f"units: {name} in {unit!r}: all values are in SI units, and they are not "
                f"converted. Give its values in {_SCALED[word]} instead of {word}, and "
                "write that unit (pictures show angles in degrees by themselves)"
            )
