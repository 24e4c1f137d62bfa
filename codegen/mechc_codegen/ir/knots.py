"""Knots of lookup tables, at which equations change their form or narrow features begin.

Input: an optimised program.  Output: the arguments of its tables, each with the knots at which
steps end.  These are corners and jumps of the derivatives that the equations hold, and of the other
knots as many as make the table, between two of them, a polynomial that a step sees.
Invariant: where a table is one polynomial but for rounding, there is no knot.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import pairwise
from math import cos, pi

from sympy import Expr

from mechc_codegen.description.tables import Lookup, TableData
from mechc_codegen.ir.definitions import Definitions
from mechc_codegen.ir.program import Knots

_CONTINUOUS = 1e-9  # of the largest derivative: a smaller jump is rounding
_SEEN = 1e-6  # of the largest value: what the polynomial may miss of a feature
_DEGREE = 7  # of that polynomial: nodes of a step see it
_PLACES = 3  # in each piece, where the two are compared
_FARTHEST = 1e200  # where the constant piece before a held end begins


def table_knots(values: Iterable[Expr], definitions: Definitions) -> Iterator[Knots]:
    """The knots of the tables in expressions, for each argument that is not fixed."""
    highest = dict[tuple[str, int, Expr], tuple[type[Lookup], int]]()
    for value in values:
        for found in sorted(value.atoms(Lookup), key=str):
            for axis, argument in enumerate(found.args):
                key = (found.table.digest, axis, argument)
                order = max(found.orders[axis], highest.get(key, (None, 0))[1])
                if not definitions.is_fixed(argument):
                    highest[key] = (type(found), order)
    for (_, axis, argument), (function, order) in highest.items():
        table = function.table
        corners, smooth = _sorted_knots(table, axis, order)
        knots = {*corners, *_features(table, axis, order, corners, smooth)}
        if knots:
            yield Knots(argument, tuple(sorted(knots)), table.periods[axis])


def _sorted_knots(
    table: TableData, axis: int, order: int
) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Knots where that derivative or the next one jumps; those where a higher one does."""
    starts, period = table.starts[axis], table.periods[axis]
    largest = [0.0] * (table.degree + 1)
    pieces = [_piece(table, axis, n) for n in range(len(starts))]
    for rows in pieces:
        for row in rows:
            largest = [max(a, abs(b)) for a, b in zip(largest, row, strict=True)]
    corners, smooth = list[float](), list[float]()
    for n in range(1 if period is None else 0, len(starts)):
        before = n - 1 if n else len(starts) - 1
        width = (starts[n] if n else starts[0] + (period or 0.0)) - starts[before]
        jumps = [
            any(
                abs(_shifted(left, width, m) - right[m]) > _CONTINUOUS * largest[m]
                for left, right in zip(pieces[before], pieces[n], strict=True)
            )
            for m in range(table.degree + 1)
        ]
        if any(jumps[order : order + 2]):
            corners.append(starts[n])
        elif any(jumps[order + 2 :]):
            smooth.append(starts[n])
    return tuple(corners), tuple(smooth)


def _piece(table: TableData, axis: int, n: int) -> list[list[float]]:
    """The coefficients of a piece of an axis, for each piece and power of the other one."""
    size, counts = table.degree + 1, [len(s) for s in table.starts]
    c = table.coefficients
    if len(counts) == 1:
        return [list(c[n * size : (n + 1) * size])]
    if axis == 0:
        return [
            [c[((n * counts[1] + j) * size + i) * size + m] for i in range(size)]
            for j in range(counts[1])
            for m in range(size)
        ]
    return [
        [c[((j * counts[1] + n) * size + m) * size + i] for i in range(size)]
        for j in range(counts[0])
        for m in range(size)
    ]


def _shifted(row: list[float], width: float, m: int) -> float:
    """The coefficient of a power m of a polynomial that is written about another place."""
    if width > _FARTHEST:  # a constant
        return row[m]
    total, factor = 0.0, 1.0
    for power in range(m, len(row)):
        total += row[power] * factor
        factor *= width * (power + 1) / (power + 1 - m)
    return total


def _features(
    table: TableData, axis: int, order: int, corners: tuple[float, ...], smooth: tuple[float, ...]
) -> tuple[float, ...]:
    """The smooth knots between which, and corners, one polynomial is seen for the table."""
    if not smooth:
        return ()
    knots, period = sorted({*corners, *smooth}), table.periods[axis]
    first = table.starts[axis][0]
    bounds = knots if first < -_FARTHEST or period else [first, *knots]
    after = bounds[0] + period if period else 2 * bounds[-1] - bounds[-2] if bounds[1:] else None
    bounds = [*bounds, bounds[-1] + 1.0 if after is None else after]
    kept, begin, largest = list[float](), 0, _largest(table, axis, order)
    for n in range(1, len(bounds)):
        if n == len(bounds) - 1 or bounds[n] in corners:
            kept += _divided(table, axis, order, bounds[begin : n + 1], largest)
            begin = n
    return (*kept, *(bounds[:1] if period else []))


def _divided(
    table: TableData, axis: int, order: int, bounds: list[float], largest: float
) -> list[float]:
    """The knots between the first and the last bound at which one is divided into those seen."""
    if len(bounds) == 2 or _is_seen(table, axis, order, bounds, largest):
        return []
    n = len(bounds) // 2
    parts = (_divided(table, axis, order, part, largest) for part in (bounds[: n + 1], bounds[n:]))
    return [bounds[n], *(knot for part in parts for knot in part)]


def _slices(table: TableData, axis: int) -> Iterator[float | None]:
    """Places of the other argument, or None where there is none."""
    if len(table.starts) == 1:
        yield None
    else:
        yield from (x for x in table.starts[1 - axis] if x > -_FARTHEST)


def _values(
    table: TableData, axis: int, order: int, places: list[float], other: float | None
) -> list[float]:
    if other is None:
        return [float(x) for x in table.evaluate((order,), places)]
    orders = (order, 0) if axis == 0 else (0, order)
    arguments = (places, other) if axis == 0 else (other, places)
    return [float(x) for x in table.evaluate(orders, *arguments)]


def _largest(table: TableData, axis: int, order: int) -> float:
    places = [x for x in table.starts[axis] if x > -_FARTHEST]
    return max(
        abs(x) for other in _slices(table, axis) for x in _values(table, axis, order, places, other)
    )


def _is_seen(table: TableData, axis: int, order: int, bounds: list[float], largest: float) -> bool:
    """Whether one polynomial through as many places is near the table between these bounds."""
    middle, half = 0.5 * (bounds[0] + bounds[-1]), 0.5 * (bounds[-1] - bounds[0])
    nodes = [middle - half * cos(pi * n / _DEGREE) for n in range(_DEGREE + 1)]
    weights = [(-1) ** n * (0.5 if n in (0, _DEGREE) else 1.0) for n in range(_DEGREE + 1)]
    places = [
        a + (b - a) * (k + 0.5) / _PLACES for a, b in pairwise(bounds) for k in range(_PLACES)
    ]
    places = [x for x in places if x not in nodes]
    for other in _slices(table, axis):
        known = _values(table, axis, order, nodes, other)
        for x, value in zip(places, _values(table, axis, order, places, other), strict=True):
            parts = [w / (x - node) for w, node in zip(weights, nodes, strict=True)]
            near = sum(p * v for p, v in zip(parts, known, strict=True)) / sum(parts)
            if abs(near - value) > _SEEN * largest:
                return False
    return True
