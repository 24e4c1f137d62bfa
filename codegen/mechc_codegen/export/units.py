"""Units in words -> exponents of SI base units, as descriptions of functional mock-up units ask."""

from __future__ import annotations

import re
from collections.abc import Mapping

BASE = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")
_DERIVED: Mapping[str, Mapping[str, int]] = {
    "N": {"kg": 1, "m": 1, "s": -2},
    "J": {"kg": 1, "m": 2, "s": -2},
    "W": {"kg": 1, "m": 2, "s": -3},
    "Pa": {"kg": 1, "m": -1, "s": -2},
    "Hz": {"s": -1},
    "C": {"A": 1, "s": 1},
    "V": {"kg": 1, "m": 2, "s": -3, "A": -1},
    "Ω": {"kg": 1, "m": 2, "s": -3, "A": -2},
    "H": {"kg": 1, "m": 2, "s": -2, "A": -2},
    "F": {"kg": -1, "m": -2, "s": 4, "A": 2},
    "Wb": {"kg": 1, "m": 2, "s": -2, "A": -1},
    "T": {"kg": 1, "s": -2, "A": -1},
    "1": {},
    **{name: {name: 1} for name in BASE},
}
_FACTOR = re.compile(r"\s*+([/*·]?)\s*+(\(?)\s*+([A-Za-zΩ]+|1)(?:\^\(?([+-]?\d+)\)?)?\s*(\)?)")


def exponents(unit: str) -> dict[str, int] | None:
    """A dict from base units to exponents, for ``"kg m^2"``, ``"1/(m s)"``; None if not known.

    A slash divides by the one factor or the one bracket after it.
    """
    found: dict[str, int] = {}
    place, divided = 0, False
    while place < len(unit.rstrip()):
        factor = _FACTOR.match(unit, place)
        if factor is None or factor[3] not in _DERIVED:
            return None
        slash, opened, name, power, closed = factor.groups()
        sign = -1 if divided or slash == "/" else 1
        divided = (divided or (slash == "/" and bool(opened))) and not closed
        for base, exponent in _DERIVED[name].items():
            found[base] = found.get(base, 0) + sign * exponent * int(power or 1)
        place = factor.end()
    return {base: found[base] for base in BASE if found.get(base)}
