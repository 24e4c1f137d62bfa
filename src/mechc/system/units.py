"""Values with units, as users write them: ``85deg``, ``3500 mm``, and quantities of pint."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from typing import Any

from mechc.errors import ValueOutOfBoundsError
from mechc.system.quantity import Kind, NamedQuantity

TURN = math.pi / 180
MOST_BARE = 4 * math.pi  # rad, of an angle that is written without a unit
UNITS: dict[Kind, dict[str, float]] = {
    Kind.ANGLE: {"rad": 1.0, "deg": TURN, "°": TURN},
    Kind.ANGULAR_SPEED: {"rad/s": 1.0, "deg/s": TURN, "°/s": TURN, "rpm": 2 * math.pi / 60},
    Kind.LENGTH: {"m": 1.0, "cm": 1e-2, "mm": 1e-3},
    Kind.SPEED: {"m/s": 1.0, "cm/s": 1e-2, "mm/s": 1e-3, "km/h": 1 / 3.6},
    Kind.MASS: {"kg": 1.0, "g": 1e-3},
    Kind.TIME: {"s": 1.0, "ms": 1e-3, "min": 60.0, "h": 3600.0},
}
SECONDS = NamedQuantity("time", "s", "time", -math.inf, math.inf, False, Kind.TIME)
SECOND_WORDS = ("s", "sec", "second", "seconds")  # as columns of files tell them
DATES = ("m", "M")  # the kinds of arrays of dates and durations
_TYPED = re.compile(r"([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?|[-+]?inf|nan)\s*(.*)", re.DOTALL)


def split_assignment(text: str) -> tuple[str, str]:
    """``name=value`` in two."""
    name, sign, value = text.partition("=")
    if not sign or not name.strip() or not value.strip():
        raise ValueOutOfBoundsError(f"{text!r} should read NAME=VALUE, for instance l_3=3.5")
    return name.strip(), value.strip()


def read_value(text: str, quantity: NamedQuantity) -> float:
    """A typed number in SI units; without a unit it is in the quantity's unit.

    Raises :class:`ValueOutOfBoundsError` if it is not a number, if the unit is not one of the
    quantity's, and for an angle of more than two turns without a unit: it may be in degrees.
    """
    match = _TYPED.fullmatch(text.strip())
    if match is None:
        raise ValueOutOfBoundsError(f"{quantity.name}: {text!r} is not a number")
    number, unit = match.groups()
    known = UNITS.get(quantity.kind, {quantity.unit: 1.0})
    if unit and unit not in known:
        raise ValueOutOfBoundsError(
            f"{quantity.name}: {unit!r} in {text!r} is not one of its units; {_choices(known)}"
        )
    if quantity.kind is Kind.ANGLE and not unit and MOST_BARE < abs(float(number)) < math.inf:
        raise ValueOutOfBoundsError(
            f"{quantity.name}: {number} rad = {float(number) / TURN:.6g} deg; for degrees write "
            f"{number}deg, for radians {number}rad"
        )
    return float(number) * (known[unit] if unit else 1.0)


def in_si(value: Any, quantity: NamedQuantity) -> Any:
    """A value as given, in SI units: texts are read, quantities of pint converted, others kept.

    Raises :class:`ValueOutOfBoundsError` as :func:`read_value`, and for a quantity of pint that is
    of another kind.
    """
    if type(value) is float:
        return value
    if isinstance(value, str):
        return read_value(value, quantity)
    if isinstance(value, (list, tuple)) and any(map(has_unit, value)):
        return [in_si(each, quantity) for each in value]
    return _magnitude(value, quantity) if has_unit(value) else value


def has_unit(value: Any) -> bool:
    """Whether a value may have a unit: a text, or a quantity of pint."""
    return isinstance(value, str) or (hasattr(value, "magnitude") and hasattr(value, "to"))


def plain_numbers(value: Any, quantity: NamedQuantity) -> Any:
    """Numbers in SI units of what may have a unit: a text, quantities of pint, alone or in a list.

    Raises :class:`ValueOutOfBoundsError` as :func:`in_si`; for dates and durations of NumPy, whose
    numbers are in a unit of their own; for columns whose ``attrs`` tell another unit.
    """
    first = value[0] if isinstance(value, (list, tuple)) and value else value
    dtype = getattr(first, "dtype", None)
    if getattr(dtype, "kind", None) in DATES:
        raise ValueOutOfBoundsError(
            f"{quantity.name} are in {str(dtype)!r}: give numbers in SI units; of datetime64 "
            "values (t - t[0]) / np.timedelta64(1, 's')"
        )
    told: Any = getattr(value, "attrs", None)
    unit = str(told.get("units", "")) if hasattr(told, "get") else ""
    own = SECOND_WORDS if quantity.kind is Kind.TIME else (quantity.unit,)
    if unit and quantity.unit and unit not in own:
        verb = "are" if quantity.kind is Kind.TIME else "is"
        raise ValueOutOfBoundsError(
            f"{quantity.name} {verb} in {unit!r}: give numbers in {quantity.unit}"
        )
    return in_si(value, quantity)


def _magnitude(value: Any, quantity: NamedQuantity) -> Any:
    """The number, or the numbers, of a quantity of pint in the unit of ours."""
    try:
        if quantity.kind is Kind.OTHER and not quantity.unit:
            return value.to_base_units().magnitude
        return value.to(quantity.unit).magnitude
    except Exception as error:
        raise ValueOutOfBoundsError(f"{quantity.name} [{quantity.unit}]: {error}") from None


def is_with_unit(text: str) -> bool:
    """Whether a text is a number with something after it that is no operator: ``300deg``."""
    match = _TYPED.fullmatch(text.strip())
    return match is not None and (match[2][:1].isalpha() or match[2].startswith("°"))


def is_number(text: str) -> bool:
    """Whether a text is a number, perhaps with a unit, and no expression."""
    match = _TYPED.fullmatch(text.strip())
    return match is not None and (not match[2] or is_with_unit(text))


def of_unknown_unit(name: str) -> NamedQuantity:
    """A quantity of which no unit is known: it takes quantities of pint in SI units."""
    return NamedQuantity(name, "", "", -math.inf, math.inf, False)


def read_seconds(text: str) -> float:
    """A typed duration: ``20``, ``20s``, ``1500ms``, ``2min``."""
    return read_value(text, SECONDS)


def _choices(units: Iterable[str]) -> str:
    named = " or ".join(filter(None, units))
    if named:
        return f"use {named}"
    return (
        "the model gives it none: write the number alone, or give coordinates, speeds and "
        "parameters units where it is made, mechc.compile(..., units={'x': 'm'})"
    )
