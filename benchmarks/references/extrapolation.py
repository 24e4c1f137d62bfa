"""Motions in 50 digits: Gragg's midpoint rule, extrapolated, in numbers of either kind
(arithmetic.py)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import mpmath
from mpmath import mpf

from .arithmetic import DIGITS, Vector, number

Rates = Callable[[Vector], Vector]


def by_extrapolation(
    rates: Rates, start: Vector, times: Sequence[float], longest: str
) -> list[Vector]:
    """Gragg, Bulirsch and Stoer: Hairer, Norsett, Wanner, Solving ODEs I, section II.9."""
    y, now, rows = start, mpf(0), []
    kind = mpmath.mpmathify if isinstance(start[0], mpf) else number
    for t in times:
        count = int(mpmath.ceil((mpf(t) - now) / mpf(longest)))
        for _ in range(count):
            y = extrapolated(rates, y, kind((mpf(t) - now) / count))
        now = mpf(t)
        rows.append(y)
    return rows


def extrapolated(rates: Rates, y: Vector, step: Any, most: int = 22) -> Vector:
    """One step, with 2, 4, 6 ... substeps until the last two values agree; else two of half."""
    before: list[Vector] = []
    one, enough = step / step, 10.0 ** (12 - DIGITS)
    for k in range(1, most):
        row = [midpoint(rates, y, step, 2 * k)]
        for j, other in enumerate(before):
            factor = (k * one / (k - 1 - j)) ** 2 - 1
            row.append([a + (a - b) / factor for a, b in zip(row[j], other, strict=True)])
        if before:
            change = max(abs(a - b) / max(1, abs(a)) for a, b in zip(row[-1], row[-2], strict=True))
            if change < enough:
                return row[-1]
        before = row
    return extrapolated(rates, extrapolated(rates, y, step / 2), step / 2)


def midpoint(rates: Rates, y: Vector, step: Any, count: int) -> Vector:
    """The modified midpoint rule with its smoothing step, whose error is even in the step."""
    h = step / count
    old, new = y, [a + h * f for a, f in zip(y, rates(y), strict=True)]
    for _ in range(count - 1):
        old, new = new, [a + 2 * h * f for a, f in zip(old, rates(new), strict=True)]
    return [(a + b + h * f) / 2 for a, b, f in zip(old, new, rates(new), strict=True)]
