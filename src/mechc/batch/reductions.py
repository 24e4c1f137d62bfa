"""Reductions of a trajectory to a number, from text: ``max(theta_2)``, ``first(omega_0 < 0)``.

The grammar::

    reduction  = ("mean" | "final") "(" quantity ")"
               | ("min" | "max" | "range") "(" quantity ["," "away" "=" time] ")"
               | "first" "(" quantity (">" | "<" | "=") number [unit] ")"
    quantity   = one | "abs" "(" one ")" | "norm" "(" output ")"

``one`` is a quantity as :mod:`mechc.system.quantities` reads it; ``away`` leaves out that time
before and after each change point, where constraint forces may be infinite.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mechc.errors import MechcError, UnknownNameError
from mechc.native._codes import (
    ABSOLUTE,
    COMPONENT,
    FIRST_CROSSING,
    LAST,
    MAXIMUM,
    MEAN,
    MINIMUM,
    NORM,
)
from mechc.system.parameters import Array
from mechc.system.quantities import NAME, Quantity, quantities_of, read_quantity, shape_of
from mechc.system.quantity import Kind, NamedQuantity
from mechc.system.system import System
from mechc.system.units import read_seconds, read_value

KINDS = {"min": MINIMUM, "max": MAXIMUM, "mean": MEAN, "final": LAST}
DIRECTIONS = {">": 1, "<": -1, "=": 0}
EXAMPLE = "for instance max(theta_2), mean(energy), range(abs(omega_0)) or first(theta_0 > 180deg)"
_CALL = re.compile(r"\s*(\w+)\s*\((.*)\)\s*", re.DOTALL)
_AWAY = re.compile(r"([^=]*),\s*+away\s*+=([^=]*)")
_LEVEL = re.compile(r"(.*)([<>=])([^<>=]*)", re.DOTALL)


class Primitive(NamedTuple):
    """A number that the compiled loop computes: the fields of ``mechc_quantity``, in order."""

    reduction: int
    form: int
    output: int
    second: int
    component: int
    of_motion: bool
    direction: int
    level: float
    away: float


@dataclass(frozen=True)
class Reduction:
    """One number per member.

    Attributes
    ----------
    text
        The text as given, without spaces.
    unit, kind
        Unit and kind of the number, where known.
    primitives
        What the compiled loop computes; ``range`` needs two.
    quantities
        What is reduced; of a norm each number of the output.
    """

    text: str
    unit: str
    kind: Kind
    primitives: tuple[Primitive, ...]
    quantities: tuple[Quantity, ...]

    def combine(self, values: Array, whole: NDArray[np.bool_]) -> Array:
        """The reduction (n,) from its primitives (n, k); NaN of members whose motion is not
        ``whole``, except a first crossing that it has."""
        found = values[:, 0] if values.shape[1] == 1 else values[:, 1] - values[:, 0]
        if self.primitives[0].reduction == FIRST_CROSSING:
            return found
        return np.where(whole, found, np.nan)


def read_reduction(system: System, text: str) -> Reduction:
    """Parse one reduction.

    Raises
    ------
    MechcError
        If it is not of the grammar above.
    UnknownNameError
        If the model has no such coordinate, speed or output.
    """
    match = _CALL.fullmatch(text) if isinstance(text, str) else None
    if match is None:
        raise MechcError(f"{text!r} is not a reduction; {EXAMPLE}")
    kind, inside = match.groups()
    short = re.sub(r"\s+", "", text)
    if kind == "first":
        return _first(system, short, inside)
    if kind != "range" and kind not in KINDS:
        raise UnknownNameError("reduction", kind, (*KINDS, "range", "first"))
    inside, away = _split_away(short, kind, inside)
    quantity = _form(system, inside)
    kinds = (MINIMUM, MAXIMUM) if kind == "range" else (KINDS[kind],)
    unit, kind_of_it = quantity.meaning.unit, quantity.meaning.kind
    primitives = tuple(quantity.primitive(k, away=away) for k in kinds)
    return Reduction(short, unit, kind_of_it, primitives, quantity.quantities)


def read_stop(system: System, text: str) -> Primitive:
    """Parse ``first(theta_0 > 360deg)``, or the text in its brackets, as an end of runs.

    Raises :class:`MechcError` if it is not a crossing.
    """
    typed = text.strip() if isinstance(text, str) else ""
    crossing = read_reduction(system, typed if typed.startswith("first") else f"first({typed})")
    return crossing.primitives[0]


def _first(system: System, short: str, inside: str) -> Reduction:
    match = _LEVEL.fullmatch(inside)
    if match is None:
        raise MechcError(f"{short!r} needs a level to cross; {EXAMPLE}")
    typed, sign, level = match.groups()
    quantity = _form(system, typed)
    value = read_value(level, quantity.meaning)
    if not math.isfinite(value):
        raise MechcError(f"{short!r}: the level must be finite")
    primitive = quantity.primitive(FIRST_CROSSING, DIRECTIONS[sign], value)
    return Reduction(short, "s", Kind.TIME, (primitive,), quantity.quantities)


def _split_away(short: str, kind: str, inside: str) -> tuple[str, float]:
    """The text of the quantity, and the time around change points that does not count, s."""
    match = _AWAY.fullmatch(inside)
    if match is None:
        return inside, 0.0
    if kind not in ("min", "max", "range"):
        raise MechcError(f"{short!r}: away= is for min, max and range")
    seconds = read_seconds(match[2])
    if not 0.0 < seconds < math.inf:
        raise MechcError(f"{short!r}: away= is a time above zero")
    return match[1], seconds


class _Form(NamedTuple):
    """A quantity, and what of it is reduced: its value, its size, or the norm of an output."""

    form: int
    meaning: NamedQuantity
    outputs: tuple[int, int]
    component: int
    of_motion: bool
    quantities: tuple[Quantity, ...]

    def primitive(
        self, kind: int, direction: int = 0, level: float = 0.0, away: float = 0.0
    ) -> Primitive:
        return Primitive(
            kind, self.form, *self.outputs, self.component, self.of_motion, direction, level, away
        )


def _form(system: System, text: str) -> _Form:
    call = _CALL.fullmatch(text)
    function, inside = call.groups() if call else ("", text)
    if function not in ("", "abs", "norm"):
        raise UnknownNameError("function of a quantity", function, ("abs", "norm"))
    if function == "norm":
        return _norm(system, inside.strip())
    one, order = read_quantity(system, inside), list(system.scene.outputs)
    if len(one.parts) > 1 and function:
        raise MechcError(f"{one.output} is a sum of outputs: write {one.output}")
    form = ABSOLUTE if function else COMPONENT
    if one.of_state:
        return _Form(form, one.meaning, (-1, -1), one.entry, False, (one,))
    parts, entry = one.parts, one.entry
    if one.output in system.array_outputs:
        parts, entry = (system.array_elements(one.output)[entry],), 0
    first, second = (*map(order.index, parts), -1)[:2]
    of_motion = bool({*parts} & {*system.data["of_motion"]})
    return _Form(form, one.meaning, (first, second), entry, of_motion, (one,))


def _norm(system: System, name: str) -> _Form:
    order = list(system.scene.outputs)
    if name not in order:
        if not NAME.fullmatch(name):
            raise MechcError(f"norm({name}): it takes all numbers of an output, without an index")
        shape_of(system, name)  # raises for what there is not
        raise MechcError(
            f"norm({name}): it takes the numbers of one output of the model, not a coordinate, a "
            "speed, a sum, or an output that you gave as an array"
        )
    meaning = NamedQuantity(name, "", name, -math.inf, math.inf, False)
    _, numbers = quantities_of(system, name)
    of_motion = name in system.data["of_motion"]
    return _Form(NORM, meaning, (order.index(name), -1), 0, of_motion, tuple(numbers))
