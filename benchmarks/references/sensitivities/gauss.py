"""Motions with their columns of derivatives by Gauss's collocation of order 40, in 50 digits.

The rates are evaluated in dual numbers, so that the variational equations need no derivation.
Time may run along a path in the complex plane: motions are analytic, and a path around an instant
at which equations are singular ends where the one through it does.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import mpmath
from mpmath import mpf

from ..extrapolation import DIGITS, Vector
from .dual_numbers import Dual, slopes_of, value_of

STAGES = 20
ENOUGH = mpf(10) ** (4 - DIGITS)
ITERATIONS = 200
DualRates = Callable[[Vector], Vector]


@cache
def rule() -> tuple[mpmath.matrix, Vector]:
    """A (s, s) and b (s,): Hairer, Norsett, Wanner, Solving ODEs I, section II.7."""
    with mpmath.workdps(3 * DIGITS):
        legendre = mpmath.taylor(lambda x: mpmath.legendre(STAGES, 2 * x - 1), 0, STAGES)
        nodes = sorted(
            mpmath.re(x)
            for x in mpmath.polyroots(legendre[::-1], maxsteps=500, extraprec=20 * DIGITS)
        )
        powers = mpmath.matrix([[x**j for j in range(STAGES)] for x in nodes])
        totals = [*nodes, mpf(1)]
        integrals = mpmath.matrix([[x ** (j + 1) / (j + 1) for j in range(STAGES)] for x in totals])
        found = integrals * powers**-1
    return found[:STAGES, :], list(found[STAGES, :])


def along(rates: DualRates, start: Vector, t: Any, longest: str) -> Vector:
    """Dual numbers at a time t, real or complex, from those at 0, in equal steps."""
    count = int(mpmath.ceil(abs(t) / mpf(longest)))
    y = start
    for _ in range(count):
        y = _step(rates, y, t / count)
    return y


def _step(rates: DualRates, start: Vector, h: Any) -> Vector:
    matrix, weights = rule()
    width, size = len(start[0].slopes), len(start)
    y = _flat(start, width)
    slopes = [_rates(rates, y, size, width)] * STAGES
    rows = [[h * matrix[i, j] for j in range(STAGES)] for i in range(STAGES)]
    before = None
    for _ in range(ITERATIONS):
        states = [_moved(y, row, slopes) for row in rows]
        slopes = [_rates(rates, state, size, width) for state in states]
        end = _moved(y, [h * w for w in weights], slopes)
        if before is not None and _apart(end, before) < ENOUGH:
            return _duals(end, size, width)
        before = end
    raise ArithmeticError("the iteration of a step does not converge: shorten it")


def _rates(rates: DualRates, y: Vector, size: int, width: int) -> Vector:
    return _flat(rates(_duals(y, size, width)), width)


def _moved(y: Vector, row: Vector, slopes: list[Vector]) -> Vector:
    gained = (mpmath.fdot(zip(row, each, strict=True)) for each in zip(*slopes, strict=True))
    return [a + b for a, b in zip(y, gained, strict=True)]


def _apart(a: Vector, b: Vector) -> Any:
    return max(abs(x - y) / max(1, abs(x)) for x, y in zip(a, b, strict=True))


def _flat(y: Vector, width: int) -> Vector:
    return [value_of(x) for x in y] + [d for x in y for d in slopes_of(x, width)]


def _duals(flat: Vector, size: int, width: int) -> Vector:
    return [Dual(flat[i], flat[size + i * width : size + (i + 1) * width]) for i in range(size)]
