"""Small dense numerical algebra in plain Python: ranks, null spaces, points on constraints.

Used at random states to decide how a mechanism is described; the compiler does not use NumPy.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Sequence

from sympy import Expr, Symbol, lambdify

Rows = list[list[float]]
Evaluate = Callable[..., list[float]]
_RANK = 1e-9  # of the largest pivot
_DRAWS = 12
_COLLAPSED = 1e-2  # parameters are drawn from 0.4 to 1.7


def evaluator(arguments: Sequence[Expr], elements: Sequence[Expr]) -> Evaluate:
    """A numerical function that evaluates expressions of symbols."""
    stand_ins = [Symbol(f"_x{k}") for k in range(len(arguments))]
    replaced = dict(zip(arguments, stand_ins, strict=True))
    plain = [e.xreplace(replaced) for e in elements]
    evaluate: Evaluate = lambdify(stand_ins, plain, modules="math", cse=True)
    return evaluate


def rank(rows: Rows) -> int:
    """Rank by elimination with full pivoting, rows scaled to one."""
    return len(eliminated([scaled(row) for row in rows])[0])


def eliminated(
    rows: Rows, columns: int | None = None, tiny: float = _RANK
) -> tuple[list[int], Rows, list[int]]:
    """(pivot columns, reduced rows, columns without pivot); entries to the right of
    ``columns`` are transformed too.  Pivots below ``tiny`` times the largest entry are zero."""
    work = [row[:] for row in rows]
    width = columns if columns is not None else len(work[0]) if work else 0
    largest = max((abs(x) for row in work for x in row[:width]), default=0.0)
    free, pivots = list(range(width)), list[int]()
    while len(pivots) < len(work) and free:
        done = len(pivots)
        places = ((i, j) for i in range(done, len(work)) for j in free)
        i, j = max(places, key=lambda place: abs(work[place[0]][place[1]]))
        if not abs(work[i][j]) > tiny * largest:
            break
        work[done], work[i] = work[i], work[done]
        _clear_column(work, done, j)
        free.remove(j)
        pivots.append(j)
    return pivots, work[: len(pivots)], free


def _clear_column(work: Rows, pivot_row: int, column: int) -> None:
    pivot = work[pivot_row][column]
    work[pivot_row] = [x / pivot for x in work[pivot_row]]
    for k, row in enumerate(work):
        if k != pivot_row and row[column]:
            factor = row[column]
            work[k] = [x - factor * y for x, y in zip(row, work[pivot_row], strict=True)]


def scaled(row: Sequence[float]) -> list[float]:
    """The row divided by its largest entry."""
    largest = max((abs(x) for x in row), default=0.0)
    return [x / largest for x in row] if largest > 0 else list(row)


def null_space(rows: Rows, columns: int) -> Rows:
    """A basis of the null space of the rows."""
    if not rows:
        return [[float(i == j) for j in range(columns)] for i in range(columns)]
    pivots, reduced, free = eliminated([scaled(row) for row in rows])
    basis = []
    for j in free:
        vector = [0.0] * columns
        vector[j] = 1.0
        for pivot, row in zip(pivots, reduced, strict=True):
            vector[pivot] = -row[j]
        basis.append(vector)
    return basis


def solve_least(rows: Rows, right: Sequence[float]) -> list[float]:
    """An approximate least-norm solution of an underdetermined system.

    From the normal equations of the rows; the caller iterates.
    """
    size = len(rows)
    square = [
        [sum(a * b for a, b in zip(one, other, strict=True)) for other in rows] for one in rows
    ]
    for i in range(size):
        square[i].append(right[i])
    pivots, reduced, _ = eliminated(square, size, 1e-13)
    multiples = [0.0] * size
    for pivot, row in zip(pivots, reduced, strict=True):
        multiples[pivot] = row[size]
    columns = len(rows[0])
    return [sum(multiples[i] * rows[i][j] for i in range(size)) for j in range(columns)]


def random_point(
    gap: Evaluate | None, size: int, seed: int, moving: Sequence[int] | None = None
) -> list[float] | None:
    """Values of ``size`` arguments at which the gap vanishes, found by changing the movable ones.

    If that fails, all arguments are changed, parameters too; solutions in which many arguments
    vanish are refused, since any loop closes with lengths of zero.  None if no solution is found:
    the constraints may contradict each other.
    """
    generator = random.Random(seed)
    for changed in (list(range(size)) if moving is None else list(moving), list(range(size))):
        for _ in range(_DRAWS):
            x = [generator.uniform(0.4, 1.7) for _ in range(size)]
            if gap is None or (_newton(x, gap, changed) and _sound(x, changed, moving)):
                return x
    return None


def _sound(x: Sequence[float], changed: Sequence[int], moving: Sequence[int] | None) -> bool:
    held = [i for i in changed if moving is not None and i not in moving]
    return all(abs(x[i]) > _COLLAPSED for i in held)


def _newton(x: list[float], gap: Evaluate, changed: Sequence[int]) -> bool:
    """Change some entries of x until the gap vanishes; returns whether it does."""
    try:
        for _ in range(60):
            values = gap(*x)
            if max(map(abs, values)) < 1e-13:
                return True
            units = ([float(k == i) for k in range(len(x))] for i in changed)
            columns = [slope(gap, x, unit, 1e-6) for unit in units]
            rows = [list(row) for row in zip(*columns, strict=True)]
            for i, step in zip(changed, solve_least(rows, values), strict=True):
                x[i] -= step
        return all(
            abs(a) < 1e-10 * _terms(row, x, changed) for a, row in zip(gap(*x), rows, strict=True)
        )
    except (ValueError, ZeroDivisionError, OverflowError, TypeError):
        return False


def _terms(row: Sequence[float], x: Sequence[float], changed: Sequence[int]) -> float:
    """The size of the terms whose sum a value with these slopes is."""
    return max(1.0, sum(abs(a * x[i]) for a, i in zip(row, changed, strict=True)))


def normalised(gap: Evaluate, size: int, places: Sequence[int]) -> Evaluate:
    """The same rows, each with 1 as its largest slope by these arguments, where they are random.

    So what is small does not depend on units and factors of the rows.
    """
    generator = random.Random(0)
    x = [generator.uniform(0.4, 1.7) for _ in range(size)]
    try:
        columns = [slope(gap, x, [float(k == i) for k in range(size)]) for i in places]
    except (ValueError, ZeroDivisionError, OverflowError, TypeError):
        return gap
    steepest = [max(map(abs, row)) for row in zip(*columns, strict=True)]
    factors = [1.0 / a if 0.0 < a < float("inf") else 1.0 for a in steepest]

    def in_units(*arguments: float) -> list[float]:
        return [f * value for f, value in zip(factors, gap(*arguments), strict=True)]

    return in_units


def slope(
    function: Evaluate, x: Sequence[float], direction: Sequence[float], step: float = 1e-3
) -> list[float]:
    """Directional derivative by fourth-order differences, accurate to about 1e-12."""

    def at(times: float) -> list[float]:
        return function(*(a + times * step * b for a, b in zip(x, direction, strict=True)))

    inner = [a - b for a, b in zip(at(1.0), at(-1.0), strict=True)]
    outer = [a - b for a, b in zip(at(2.0), at(-2.0), strict=True)]
    return [(8 * a - b) / (12 * step) for a, b in zip(inner, outer, strict=True)]
