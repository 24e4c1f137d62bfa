"""Motions with their columns of derivatives by Gauss's collocation of order 40, in 50 digits.

The rates are evaluated in dual numbers, so that the variational equations need no derivation: of
every step the stages first, in plain numbers, then their Jacobians at these stages, once.
Time may run along a path in the complex plane: motions are analytic, and a path around an instant
at which equations are singular ends where the one through it does.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any, NamedTuple

import mpmath
from mpmath import mpf

from ..arithmetic import DIGITS, Vector, dot, number, numbers, of_mpmath
from .dual_numbers import Dual, of_mpmath_dual, quick, slopes_of, value_of

STAGES = 20
ENOUGH = 10.0 ** (4 - DIGITS)
ITERATIONS = 200
Rates = Callable[[Vector], Vector]
Equations = Callable[[Vector], Rates]  # of what is given


class Rule(NamedTuple):
    """A, s rows of (s,), and b (s,)."""

    matrix: list[Vector]
    weights: Vector


@cache
def rule() -> Rule:
    """Hairer, Norsett, Wanner, Solving ODEs I, section II.7."""
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
    rows = [numbers(found[i, :]) for i in range(STAGES + 1)]
    return Rule(rows[:STAGES], rows[STAGES])


def along(equations: Equations, given: Vector, start: Vector, t: Any, longest: str) -> Vector:
    """Dual numbers at a time t, real or complex, from those at 0, in equal steps.

    ``equations(given)`` are the rates; ``start`` and ``given`` are dual numbers, or plain ones.
    """
    t = of_mpmath(t)
    count = int(mpmath.ceil(abs(t) / mpf(longest)))
    given, y = [quick(x) for x in given], [quick(x) for x in start]
    width = max((len(x.slopes) for x in (*given, *y) if isinstance(x, Dual)), default=0)
    plain, none = equations([value_of(x) for x in given]), numbers([0] * len(start))
    dual = equations([Dual(value_of(x), none + slopes_of(x, width)) for x in given])
    h = number(t / count)
    values, columns = [value_of(x) for x in y], [slopes_of(x, width) for x in y]
    for _ in range(count):
        stages, end = _stages(plain, values, h)
        columns = _columns(dual, stages, columns, h) if width else columns
        values = end
    return [of_mpmath_dual(Dual(x, slopes)) for x, slopes in zip(values, columns, strict=True)]


def _stages(rates: Rates, y: Vector, h: Any) -> tuple[list[Vector], Vector]:
    """The states at the nodes, and the end."""

    def slopes_at(states: list[Vector]) -> list[Vector]:
        return [rates(state) for state in states]

    return _iterated(slopes_at, y, h)


def _columns(rates: Rates, stages: list[Vector], columns: list[Vector], h: Any) -> list[Vector]:
    """The columns (n, k) at the end of a step: K_i = J_i (S + h sum_j a_ij K_j) + f_p,i."""
    size, width = len(columns), len(columns[0])
    linear = [_linearised(rates, stage, width) for stage in stages]

    def slopes_at(states: list[Vector]) -> list[Vector]:
        return [
            [dot(row, state[k::width]) + forced[k] for row, forced in rows for k in range(width)]
            for rows, state in zip(linear, states, strict=True)
        ]

    _, end = _iterated(slopes_at, [d for row in columns for d in row], h)
    return [end[i * width : (i + 1) * width] for i in range(size)]


def _linearised(rates: Rates, stage: Vector, width: int) -> list[tuple[Vector, Vector]]:
    """Of every rate its derivatives by the state (n,), and along the columns at this state (k,)."""
    size, zero, one = len(stage), number(0), number(1)
    unit = [[one if j == i else zero for j in range(size + width)] for i in range(size)]
    found = rates([Dual(x, slopes) for x, slopes in zip(stage, unit, strict=True)])
    slopes = [slopes_of(x, size + width) for x in found]
    return [(row[:size], row[size:]) for row in slopes]


def _iterated(
    slopes_at: Callable[[list[Vector]], list[Vector]], y: Vector, h: Any
) -> tuple[list[Vector], Vector]:
    """States at the nodes and the end, by repeated substitution."""
    matrix, weights = rule()
    rows, weights = [[h * a for a in row] for row in matrix], [h * w for w in weights]
    slopes = slopes_at([y] * STAGES)
    before = None
    for _ in range(ITERATIONS):
        states = [_moved(y, row, slopes) for row in rows]
        slopes = slopes_at(states)
        end = _moved(y, weights, slopes)
        if before is not None and _apart(end, before) < ENOUGH:
            return states, end
        before = end
    raise ArithmeticError("the iteration of a step does not converge: shorten it")


def _moved(y: Vector, row: Vector, slopes: list[Vector]) -> Vector:
    return [a + dot(row, each) for a, each in zip(y, zip(*slopes, strict=True), strict=True)]


def _apart(a: Vector, b: Vector) -> Any:
    return max(abs(x - y) / max(1, abs(x)) for x, y in zip(a, b, strict=True))
