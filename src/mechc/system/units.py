"""Values with units, as users write them: ``85deg``, ``3500 mm``, ``2 N*mm/deg``, and quantities of
pint.

A unit is a product of powers of named ones.  It fits a quantity whose own unit has the same powers
of kg, m, s, rad and A."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from functools import lru_cache
from typing import Any, NamedTuple

from mechc.errors import ValueOutOfBoundsError
from mechc.system.quantity import Kind, NamedQuantity

TURN = math.pi / 180
MOST_BARE = 4 * math.pi  # rad, of an angle that is written without a unit
USUAL: dict[Kind, tuple[str, ...]] = {  # units by which people give values, that of ours first
    Kind.ANGLE: ("rad", "deg", "°"),
    Kind.ANGULAR_SPEED: ("rad/s", "deg/s", "rpm"),
    Kind.LENGTH: ("m", "cm", "mm"),
    Kind.SPEED: ("m/s", "mm/s", "km/h"),
    Kind.PURE: ("1",),
    Kind.PURE_RATE: ("1/s",),
    Kind.MASS: ("kg", "g"),
    Kind.TIME: ("s", "ms", "min", "h"),
}
BASES = ("kg", "m", "s", "rad", "A")
DEFINED = {  # what a unit is in others
    "g": (1e-3, "kg"), "lb": (0.45359237, "kg"), "in": (0.0254, "m"),
    "ft": (0.3048, "m"), "min": (60.0, "s"), "h": (3600.0, "s"), "deg": (TURN, "rad"),
    "°": (TURN, "rad"), "rev": (2 * math.pi, "rad"), "rpm": (2 * math.pi / 60, "rad/s"),
    "N": (1.0, "kg m/s^2"), "lbf": (4.4482216152605, "N"), "Nm": (1.0, "N m"),
    "Nmm": (1e-3, "N m"), "J": (1.0, "N m"),
    "W": (1.0, "J/s"), "Pa": (1.0, "N/m^2"), "bar": (1e5, "Pa"), "Hz": (1.0, "1/s"),
    "V": (1.0, "W/A"), "ohm": (1.0, "V/A"), "Ω": (1.0, "V/A"), "H": (1.0, "V s/A"),
    "F": (1.0, "A s/V"), "C": (1.0, "A s"),
}  # fmt: skip
PREFIXES = {"n": 1e-9, "u": 1e-6, "µ": 1e-6, "m": 1e-3, "c": 1e-2, "d": 1e-1, "h": 1e2, "k": 1e3,
            "M": 1e6, "G": 1e9}  # fmt: skip
PREFIXED = ("m", "g", "s", "rad", "A", "N", "Nm", "J", "W", "Pa", "Hz", "V", "ohm", "Ω", "H", "F",
            "C")  # fmt: skip
SECONDS = NamedQuantity("time", "s", "time", -math.inf, math.inf, False, Kind.TIME)
SECOND_WORDS = ("s", "sec", "second", "seconds")  # as columns of files tell them
DATES = ("m", "M")  # the kinds of arrays of dates and durations
LONGEST = 60  # characters of a unit
_SIGNS = str.maketrans({"·": "*", "⋅": "*", "²": "2", "³": "3", "⁻": "-", "¹": "1", "μ": "µ"})
_TOKENS = re.compile(r"[^\W\d_]++|°|[-+]?+\d++|\*\*|[*/^()]")
_WORD = re.compile(r"[^\W\d]\w*+")
_TYPED = re.compile(r"([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?|[-+]?inf|nan)\s*(.*)", re.DOTALL)


def split_assignment(text: str) -> tuple[str, str]:
    """``name=value`` in two."""
    name, sign, value = text.partition("=")
    if not sign or not name.strip() or not value.strip():
        raise ValueOutOfBoundsError(f"{text!r} should read NAME=VALUE, for instance l_3=3.5")
    return name.strip(), value.strip()


class Unit(NamedTuple):
    """A unit as a factor, times powers of :data:`BASES`."""

    factor: float
    powers: tuple[int, ...] = (0,) * len(BASES)

    def times(self, other: Unit, power: int = 1) -> Unit:
        """The product with a power of another unit."""
        powers = tuple(a + power * b for a, b in zip(self.powers, other.powers, strict=True))
        return Unit(self.factor * other.factor**power, powers)

    def measures(self, own: Unit) -> bool:
        """Whether a number in this unit is one in another: Hz are not rad/s, but a torque and what
        resists turning may be told per radian or not."""
        angle = BASES.index("rad")
        others = (unit.powers[:angle] + unit.powers[angle + 1 :] for unit in (self, own))
        turning = own.powers[:2] == (1, 2)  # kg m^2, N m, N m s
        return len({*others}) == 1 and (turning or self.powers[angle] == own.powers[angle])


@lru_cache(256)
def unit_of(text: str) -> Unit | None:
    """The unit that a text is, ``N*mm/s^2``, ``kg m²`` or ``N/(m/s)``; None if it is none.

    Factors after a slash are joined by signs or parentheses: in ``J/kg K`` it is not clear what
    is divided.
    """
    joined = "".join(text.translate(_SIGNS).split())
    tokens = _tokens(text)
    if len(joined) > LONGEST or "".join(tokens) != joined:
        return None
    try:
        unit = _product(tokens)
    except (IndexError, KeyError, ValueError, OverflowError):
        return None
    return None if tokens else unit


def _tokens(text: str) -> list[str]:
    return _TOKENS.findall(text.translate(_SIGNS))


def _product(tokens: list[str]) -> Unit:
    """The product at the begin of the tokens, which are taken.

    Raises ``IndexError``, ``KeyError``, ``ValueError`` where there is none.
    """
    found, sign = _power(tokens), "*"
    while tokens and tokens[0] != ")":
        divided, sign = sign == "/", tokens.pop(0) if tokens[0] in "*/" else ""
        if divided and not sign:
            raise ValueError
        found = found.times(_power(tokens), -1 if sign == "/" else 1)
    return found


def _power(tokens: list[str]) -> Unit:
    word = tokens.pop(0)
    if word == "(":
        unit = _product(tokens)
        if tokens.pop(0) != ")":
            raise ValueError
    else:
        unit = Unit(1.0) if word == "1" else _named(word)
    raised = bool(tokens) and tokens[0] in ("^", "**") and bool(tokens.pop(0))
    if raised or (word not in "(1" and tokens and tokens[0].lstrip("-+").isdigit()):
        return Unit(1.0).times(unit, int(tokens.pop(0)))
    return unit


def _named(word: str) -> Unit:
    """A unit by its name, also with a prefix; raises ``KeyError`` if there is none."""
    if word in BASES:
        return Unit(1.0, tuple(int(word == each) for each in BASES))
    if word in DEFINED:
        factor, text = DEFINED[word]
        return Unit(factor).times(_product(_tokens(text)))
    if word[1:] not in PREFIXED:
        raise KeyError(word)
    return Unit(PREFIXES[word[0]]).times(_named(word[1:]))


def factor_of(unit: str, quantity: NamedQuantity, within: str = "") -> float:
    """What a number in a unit is multiplied by for the quantity's, which has it without one.

    Of a quantity whose unit is not known it is that to SI units.  ``within``: the number's text.

    Raises :class:`ValueOutOfBoundsError` for a unit of something else.
    """
    ours = USUAL.get(quantity.kind, (quantity.unit,))[0]
    if unit in ("", ours):
        return 1.0
    told, own = unit_of(unit), unit_of(ours)
    if told is not None and not ours:
        return told.factor
    if told is None or own is None or not told.measures(own):
        where = f" in {within!r}" if within else ""
        raise ValueOutOfBoundsError(
            f"{quantity.name}: {unit!r}{where} is not one of its units; {_choices(quantity)}"
        )
    return told.factor / own.factor


def read_value(text: str, quantity: NamedQuantity) -> float:
    """A typed number in SI units; without a unit it is in the quantity's unit.

    Raises :class:`ValueOutOfBoundsError` if it is not a number, if the unit is not one of the
    quantity's, and for an angle of more than two turns without a unit: it may be in degrees.
    """
    match = _TYPED.fullmatch(text.strip())
    if match is None:
        raise ValueOutOfBoundsError(f"{quantity.name}: {text!r} is not a number")
    number, unit = match.groups()
    factor = factor_of(unit, quantity, text)
    if quantity.kind is Kind.ANGLE and not unit and MOST_BARE < abs(float(number)) < math.inf:
        raise ValueOutOfBoundsError(
            f"{quantity.name}: {number} rad = {float(number) / TURN:.6g} deg; for degrees write "
            f"{number}deg, for radians {number}rad"
        )
    return float(number) * factor


def refuse_names(what: str, text: str, known: Iterable[str]) -> None:
    """Refuse ``2 g``, two grams or twice g, where the unit is not known.

    Raises :class:`ValueOutOfBoundsError` for a word of the text that is a name of the model.
    """
    for word in sorted({*_WORD.findall(text)} & {*known}):
        raise ValueOutOfBoundsError(
            f"{what}: {word} in {text.strip()!r} is a unit and a name of the model: write a sign "
            "before it for the latter, or give units where the model is made, "
            "mechc.compile(..., units={'x': 'm'})"
        )


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
    """A quantity of which no unit is known: values with a unit are converted to SI units."""
    return NamedQuantity(name, "", "", -math.inf, math.inf, False)


def read_seconds(text: str) -> float:
    """A typed duration: ``20``, ``20s``, ``1500ms``, ``2min``."""
    return read_value(text, SECONDS)


def _choices(quantity: NamedQuantity) -> str:
    """In words, the units that a quantity may be given in."""
    usual = USUAL.get(quantity.kind)
    if usual:
        return f"use {' or '.join(usual)}"
    if not quantity.unit:
        return f"use products of {', '.join((*BASES, *DEFINED))}, also with prefixes, mm and kN"
    more = ", or another of the same kind" if unit_of(quantity.unit) else ""
    return f"use {quantity.unit}{more}"
