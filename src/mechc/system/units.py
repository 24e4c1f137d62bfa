"""Values as users type them: ``theta_0=85deg``, ``l_3=3500mm``."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable

from mechc.errors import MechcError
from mechc.system.kinds import Kind
from mechc.system.parameters import NamedQuantity

TURN = math.pi / 180
UNITS: dict[Kind, dict[str, float]] = {
    Kind.ANGLE: {"rad": 1.0, "deg": TURN, "°": TURN},
    Kind.ANGULAR_SPEED: {"rad/s": 1.0, "deg/s": TURN, "°/s": TURN, "rpm": 2 * math.pi / 60},
    Kind.LENGTH: {"m": 1.0, "cm": 1e-2, "mm": 1e-3},
    Kind.MASS: {"kg": 1.0, "g": 1e-3},
    Kind.TIME: {"s": 1.0, "ms": 1e-3, "min": 60.0, "h": 3600.0},
}
_TYPED = re.compile(r"([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?|[-+]?inf|nan)\s*(.*)", re.DOTALL)


def split_assignment(text: str) -> tuple[str, str]:
    """``name=value`` in two."""
    name, sign, value = text.partition("=")
    if not sign or not name.strip() or not value.strip():
        raise MechcError(f"{text!r} should read NAME=VALUE, for instance l_3=3.5")
    return name.strip(), value.strip()


def read_value(text: str, quantity: NamedQuantity) -> float:
    """A typed number in SI units; without a unit it is in the quantity's unit.

    Raises :class:`MechcError` if it is not a number, or the unit is not one of the quantity's.
    """
    match = _TYPED.fullmatch(text.strip())
    if match is None:
        raise MechcError(f"{quantity.name}: {text!r} is not a number")
    number, unit = match.groups()
    known = UNITS.get(quantity.kind, {quantity.unit: 1.0})
    if unit and unit not in known:
        raise MechcError(
            f"{quantity.name}: {unit!r} in {text!r} is not one of its units; {_choices(known)}"
        )
    return float(number) * (known[unit] if unit else 1.0)


def is_with_unit(text: str) -> bool:
    """Whether a text is a number with something after it that is no operator: ``300deg``."""
    match = _TYPED.fullmatch(text.strip())
    return match is not None and (match[2][:1].isalpha() or match[2].startswith("°"))


def read_seconds(text: str) -> float:
    """A typed duration: ``20``, ``20s``, ``1500ms``, ``2min``."""
    return read_value(
        text, NamedQuantity("time", "s", "time", -math.inf, math.inf, False, Kind.TIME)
    )


def _choices(units: Iterable[str]) -> str:
    named = " or ".join(filter(None, units))
    return f"use {named}" if named else "it has none"
