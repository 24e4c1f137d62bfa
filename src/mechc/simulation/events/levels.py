"""Levels that events are compared with, numbers with a unit: what unit the other side has."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from mechc.errors import ValueOutOfBoundsError
from mechc.system.quantity import NamedQuantity
from mechc.system.units import BASES, USUAL, Unit, of_unknown_unit, read_value, unit_of

_METRE, _RADIAN = BASES.index("m"), BASES.index("rad")


def read_level(text: str, value: Any, title: str, quantities: Mapping[Any, NamedQuantity]) -> float:
    """A level in SI units, in a unit that the value compared with it has.

    ``quantities``: those of the symbols in the value, and no others.  Where one of them has no unit
    the level may have any.

    Raises :class:`ValueOutOfBoundsError` for a unit of something else, and for a sum of different
    units.
    """
    unit = _unit(value, title, quantities)
    if unit is None:
        return read_value(text, of_unknown_unit(title))
    for quantity in quantities.values():
        own = _own(quantity)
        if own is not None and own.powers == unit.powers:
            return read_value(text, quantity)
    written = " ".join(f"{b}^{n}" for b, n in zip(BASES, unit.powers, strict=True) if n) or "1"
    return read_value(text, NamedQuantity(title, written, "", -math.inf, math.inf, False))


def _own(quantity: NamedQuantity) -> Unit | None:
    return unit_of(USUAL.get(quantity.kind, (quantity.unit,))[0])


def _unit(value: Any, title: str, quantities: Mapping[Any, NamedQuantity]) -> Unit | None:
    """The unit of an expression of SymPy; None where one of its parts has none."""
    if value.is_Symbol:
        return _own(quantities[value]) if value in quantities else None
    if value.is_number:
        return Unit(1.0)
    parts = [_unit(part, title, quantities) for part in value.args if not part.is_number]
    if None in parts:
        return None
    units = [part for part in parts if part is not None]
    if value.is_Mul:
        found = Unit(1.0)
        for unit in units:
            found = found.times(unit)
        return _of_arc(found)
    if value.is_Pow:
        power = value.exp
        return units[0].times(units[0], int(power) - 1) if power.is_Integer else None
    if value.is_Add or type(value).__name__ in ("Abs", "Max", "Min"):
        if len({unit.powers for unit in units}) > 1:
            raise ValueOutOfBoundsError(
                f"{title}: its terms have different units, so it cannot be compared with one"
            )
        return units[0]
    return Unit(1.0)


def _of_arc(unit: Unit) -> Unit:
    """Radians times metres are metres."""
    if not unit.powers[_METRE]:
        return unit
    return Unit(1.0, tuple(0 if i == _RADIAN else n for i, n in enumerate(unit.powers)))
