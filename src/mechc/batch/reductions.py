"""Reductions of a trajectory to a number, from text: ``max(theta_2)``, ``first(omega_0 < 0)``.

The grammar::

    reduction  = ("mean" | "final") "(" quantity ")"
               | ("min" | "max" | "range") "(" quantity ["," "away" "=" time] ")"
               | "first" "(" quantity (">" | "<" | "=") number [unit] ")"
    quantity   = entry | "abs" "(" entry ")" | "norm" "(" name ")"
    entry      = name [ "[" index { "," index } "]" ]

A name is a coordinate, a speed, ``energy``, or an output of the model; ``away`` leaves out that
time before and after each change point, where constraint forces may be infinite.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

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
from mechc.system.kinds import Kind
from mechc.system.parameters import Array
from mechc.system.quantity import NamedQuantity
from mechc.system.system import System
from mechc.system.units import read_seconds, read_value

KINDS = {"min": MINIMUM, "max": MAXIMUM, "mean": MEAN, "final": LAST}
DIRECTIONS = {">": 1, "<": -1, "=": 0}
EXAMPLE = "for instance max(theta_2), mean(energy), range(abs(omega_0)) or first(theta_0 > 180deg)"
_CALL = re.compile(r"\s*(\w+)\s*\((.*)\)\s*", re.DOTALL)
ENTRY = re.compile(r"\s*([^\W\d]\w*)\s*+(?:\[\s*(\d+(?:\s*,\s*\d+)*)\s*\])?\s*")
_AWAY = re.compile(r"([^=]*),\s*+away\s*+=([^=]*)")
_LEVEL = re.compile(r"(.*)([<>=])([^<>=]*)", re.DOTALL)


class Primitive(NamedTuple):
    """What the compiled loop computes: the fields of ``mechc_quantity``, in order."""

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
    """

    text: str
    unit: str
    kind: Kind
    primitives: tuple[Primitive, ...]

    def combine(self, values: Array) -> Array:
        """The reduction (n,) from its primitives (n, k)."""
        return values[:, 0] if values.shape[1] == 1 else values[:, 1] - values[:, 0]


@dataclass(frozen=True)
class _ReducedQuantity:
    form: int
    output: int
    second: int
    component: int
    meaning: NamedQuantity
    of_motion: bool = False

    def primitive(
        self, kind: int, direction: int = 0, level: float = 0.0, away: float = 0.0
    ) -> Primitive:
        return Primitive(
            kind, self.form, self.output, self.second, self.component, self.of_motion, direction,
            level, away,
        )  # fmt: skip


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
    quantity = _quantity(system, inside)
    kinds = (MINIMUM, MAXIMUM) if kind == "range" else (KINDS[kind],)
    unit, kind_of_it = quantity.meaning.unit, quantity.meaning.kind
    primitives = tuple(quantity.primitive(k, away=away) for k in kinds)
    return Reduction(short, unit, kind_of_it, primitives)


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
    quantity = _quantity(system, typed)
    value = read_value(level, quantity.meaning)
    if not math.isfinite(value):
        raise MechcError(f"{short!r}: the level must be finite")
    return Reduction(
        short, "s", Kind.TIME, (quantity.primitive(FIRST_CROSSING, DIRECTIONS[sign], value),)
    )


def _split_away(short: str, kind: str, inside: str) -> tuple[str, float]:
    """What is reduced, and the time around change points that does not count, s."""
    match = _AWAY.fullmatch(inside)
    if match is None:
        return inside, 0.0
    if kind not in ("min", "max", "range"):
        raise MechcError(f"{short!r}: away= is for min, max and range")
    seconds = read_seconds(match[2])
    if not 0.0 < seconds < math.inf:
        raise MechcError(f"{short!r}: away= is a time above zero")
    return match[1], seconds


def _quantity(system: System, text: str) -> _ReducedQuantity:
    call = _CALL.fullmatch(text)
    if call is None:
        return _entry(system, text, COMPONENT)
    function, inside = call.groups()
    if function not in ("abs", "norm"):
        raise UnknownNameError("function of a quantity", function, ("abs", "norm"))
    return _entry(system, inside, ABSOLUTE if function == "abs" else NORM)


def _entry(system: System, text: str, form: int) -> _ReducedQuantity:
    match = ENTRY.fullmatch(text)
    if match is None:
        raise MechcError(f"{text.strip()!r} is not the name of a quantity; {EXAMPLE}")
    name, indices = match.groups()
    if name in (*system.coordinates, *system.speeds):
        if indices is not None or form == NORM:
            raise MechcError(f"{name} is one number: it has no entries and no norm")
        told = system.quantities[name]
        return _ReducedQuantity(form, -1, -1, system.state_index(name), told)
    return _output(system, name, indices, form)


def _output(system: System, name: str, indices: str | None, form: int) -> _ReducedQuantity:
    order = list(system.scene.outputs)
    known = (*system.coordinates, *system.speeds, "energy", *order)
    told = NamedQuantity(name, "J" if "energy" in name else "", name, -math.inf, math.inf, False)
    if name == "energy" and "kinetic_energy" in order:
        if indices is not None or form != COMPONENT:
            raise MechcError("energy is one number: write energy")
        if "potential_energy" not in order:
            system.refuse_output("potential_energy")
        kinetic, potential = order.index("kinetic_energy"), order.index("potential_energy")
        return _ReducedQuantity(COMPONENT, kinetic, potential, 0, told)
    if name not in order:
        raise UnknownNameError("quantity", name, known)
    shape = system.data["shapes"].get(name, [system.scene.outputs[name]])
    place, of_motion = _flat(name, indices, shape, form), name in system.data["of_motion"]
    return _ReducedQuantity(form, order.index(name), -1, place, told, of_motion)


def _flat(name: str, indices: str | None, shape: list[int], form: int) -> int:
    """The entry requested, counted in C order."""
    if form == NORM:
        if indices is not None:
            raise MechcError(f"norm({name}) takes all its entries: omit the index")
        return 0
    given = [int(i) for i in indices.split(",")] if indices else []
    inside = len(given) == len(shape) and all(i < n for i, n in zip(given, shape, strict=True))
    if not inside:
        words = f"{name} has the shape {tuple(shape)}" if shape else f"{name} is one number"
        sample = f"{name}[{','.join('0' for _ in shape)}]" if shape else name
        raise MechcError(f"{words}: request one entry of it, as in {sample}")
    return int(np.ravel_multi_index(given, shape)) if shape else 0
