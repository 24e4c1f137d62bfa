"""Mechanism and values -> tables for people: symbol, meaning, unit, bounds, default, value.

Input: a mechanism and some parameter values in SI units.  Output: rows of cells, each a text or
a formula, that both documents print.  Invariant: angles are in degrees here and only here.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import degrees, isinf
from typing import Any

from sympy import sympify

from mechc_codegen.description.mechanism import Coordinate, Mechanism, Speed, printed_name
from mechc_codegen.description.quantity import Kind, Quantity
from mechc_codegen.typeset.formula import Formula, formula, name

_MOVING = ("symbol", "meaning", "unit", "bounds", "start")
_CONSTANT = ("symbol", "meaning", "unit", "bounds", "default", "value")
_DEGREES = {Kind.ANGLE: "°", Kind.ANGULAR_SPEED: "°/s"}

Cell = str | Formula


@dataclass(frozen=True)
class ValueTable:
    """A table for people: a title, the columns' heads and rows of cells, texts or formulas."""

    title: str
    head: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]


def all_values(mechanism: Mechanism, given: Mapping[str, float] | None) -> dict[str, float]:
    """The values of parameters; a default that follows others follows the values given.

    Parameters with neither value nor default are omitted.
    """
    known = dict(given or {})
    names = {p.symbol: printed_name(p.symbol) for p in mechanism.parameters}
    defaults = {p.symbol: sympify(p.default) for p in mechanism.parameters if p.default is not None}
    for _ in defaults:  # one may follow another that follows a third
        numbers = {symbol: sympify(known[n]) for symbol, n in names.items() if n in known}
        for symbol, default in defaults.items():
            if (value := default.xreplace(numbers)).is_number:
                known.setdefault(names[symbol], float(value))
    return known


def value_tables(mechanism: Mechanism, values: Mapping[str, float]) -> list[ValueTable]:
    """The tables of coordinates and speeds, and of parameters with their values."""
    things: list[Coordinate | Speed] = [*mechanism.coordinates, *mechanism.speeds]
    moving = [
        _row(thing.symbol, thing.quantity, mechanism.start.get(printed_name(thing.symbol)))
        for thing in things
    ]
    constant = [
        (
            *_row(p.symbol, p.quantity, p.default),
            _default(values.get(printed_name(p.symbol)), p.quantity),
        )
        for p in mechanism.parameters
    ]
    tables = [
        ValueTable("Coordinates and speeds", _MOVING, tuple(moving)),
        ValueTable("Parameters", _CONSTANT, tuple(constant)),
    ]
    return [table for table in tables if table.rows]


def _row(symbol: Any, quantity: Quantity, default: Any) -> tuple[Cell, ...]:
    return (
        name(printed_name(symbol)),
        quantity.description,
        _unit(quantity),
        _bounds(quantity),
        _default(default, quantity),
    )


def _default(value: Any, quantity: Quantity) -> Cell:
    """A number in the unit shown, or the formula that it follows."""
    if value is None:
        return "–"
    shown = sympify(value)
    return _number(float(shown), quantity) if shown.is_number else formula(shown)


def _unit(quantity: Quantity) -> str:
    shown = _DEGREES.get(quantity.kind, quantity.unit)
    return shown.replace("^2", "²").replace("^3", "³").replace(" ", "⋅")


def _number(value: float, quantity: Quantity) -> str:
    shown = degrees(value) if quantity.kind in _DEGREES else value
    return f"{shown:.6g}".replace("-", "−")


def _bounds(quantity: Quantity) -> str:
    lower, upper = (_number(b, quantity) for b in (quantity.lower, quantity.upper))
    sign = "≤" if quantity.closed else "<"
    if isinf(quantity.lower) and isinf(quantity.upper):
        return "any"
    if isinf(quantity.upper):
        return f"{'≥' if quantity.closed else '>'} {lower}"
    if isinf(quantity.lower):
        return f"{sign} {upper}"
    return f"{lower} {sign} … {sign} {upper}"
