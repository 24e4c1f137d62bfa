"""Small dense numerical algebra in plain Python: ranks, null spaces, points on constraints.

Used at random states to decide how a mechanism is described; the compiler does not use NumPy.
"""

from __future__ import annotations

import cmath
import math
import random
from collections.abc import Callable, Mapping, Sequence
from copy import copy
from typing import Any, Final

from sympy import Expr, Function, Symbol, lambdify
from sympy.core.relational import Relational

Rows = list[list[float]]
_RANK = 1e-9  # of the largest pivot
_STEP = 1e-100  # along the imaginary axis: its square is nothing beside any value
_DRAWS = 12
_COLLAPSED = 1e-2  # parameters are drawn from 0.4 to 1.7


class Evaluate:
    """A numerical function of floats, with its directional derivatives."""

    def __init__(self, arguments: Sequence[Symbol], elements: Sequence[Expr]) -> None:
        self._real: Callable[..., list[float]] = lambdify(
            arguments, elements, modules="math", cse=True
        )
        self._complex: Callable[..., list[complex]] = lambdify(
            arguments, [_with_real_bounds(e) for e in elements], modules=[dict(_COMPLEX)], cse=True
        )
        self.factors = [1.0] * len(elements)  # of the values

    def __call__(self, *x: float) -> list[float]:
        return [factor * a for factor, a in zip(self.factors, self._real(*x), strict=True)]

    def slope(self, x: Sequence[float], direction: Sequence[float]) -> list[float]:
        """The derivative in a direction, to rounding: a step along the imaginary axis (Squire &
        Trapp 1998, SIAM Review 40).  Of functions that know real numbers alone, differences."""
        try:
            values = self._complex(
                *(complex(a, _STEP * b) for a, b in zip(x, direction, strict=True))
            )
            slopes = (complex(value).imag / _STEP for value in values)
            return [factor * a for factor, a in zip(self.factors, slopes, strict=True)]
        except (TypeError, NameError):
            return self._differences(x, direction)

    def _differences(self, x: Sequence[float], direction: Sequence[float]) -> list[float]:
        """Differences of the fourth order."""
        step = 1e-3

        def at(times: float) -> list[float]:
            return self(*(a + times * step * b for a, b in zip(x, direction, strict=True)))

        inner = [a - b for a, b in zip(at(1.0), at(-1.0), strict=True)]
        outer = [a - b for a, b in zip(at(2.0), at(-2.0), strict=True)]
        return [(8 * a - b) / (12 * step) for a, b in zip(inner, outer, strict=True)]


_REAL_PART: Final = Function("_real_part")


def _with_real_bounds(expression: Expr) -> Expr:
    """The expression with comparisons of real parts, for complex arguments."""
    compared = {r: r.func(*map(_REAL_PART, r.args)) for r in expression.atoms(Relational)}
    return expression.xreplace(compared)


def _atan2(y: complex, x: complex) -> complex:
    y, x = complex(y), complex(x)
    turning = (x.real * y.imag - y.real * x.imag) / (x.real**2 + y.real**2)
    return complex(math.atan2(y.real, x.real), turning)


# Functions that are not analytic, by what they do to a real argument and its derivative.
_COMPLEX: Final[Mapping[str, Any]] = {
    **{name: value for name, value in vars(cmath).items() if not name.startswith("_")},
    "abs": lambda z: z if z.real >= 0.0 else -z,
    "atan2": _atan2,
    "_real_part": lambda z: complex(z).real,
    "copysign": lambda size, z: math.copysign(complex(size).real, complex(z).real),
    "max": lambda *z: max(z, key=lambda each: complex(each).real),
    "min": lambda *z: min(z, key=lambda each: complex(each).real),
}


def evaluator(arguments: Sequence[Expr], elements: Sequence[Expr]) -> Evaluate:
    """A numerical function that evaluates expressions of symbols."""
    stand_ins = [Symbol(f"_x{k}") for k in range(len(arguments))]
    replaced = dict(zip(arguments, stand_ins, strict=True))
    return Evaluate(stand_ins, [e.xreplace(replaced) for e in elements])


def rank(rows: Rows) -> int:
    """Rank by elimination with full pivoting, rows scaled to one."""
    return len(eliminate([scale_row(row) for row in rows])[0])


def eliminate(
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


def scale_row(row: Sequence[float]) -> list[float]:
    """The row divided by its largest entry."""
    largest = max((abs(x) for x in row), default=0.0)
    return [x / largest for x in row] if largest > 0 else list(row)


def null_space(rows: Rows, columns: int) -> Rows:
    """A basis of the null space of the rows."""
    if not rows:
        return [[float(i == j) for j in range(columns)] for i in range(columns)]
    pivots, reduced, free = eliminate([scale_row(row) for row in rows])
    basis = []
    for j in free:
        vector = [0.0] * columns
        vector[j] = 1.0
        for pivot, row in zip(pivots, reduced, strict=True):
            vector[pivot] = -row[j]
        basis.append(vector)
    return basis


def solve_least(rows: Rows, right: Sequence[float]) -> list[float]:
    """An approximate least-norm solution of an underdetermined linear system.

    From the normal equations of the rows; the caller iterates.
    """
    size = len(rows)
    square = [
        [sum(a * b for a, b in zip(one, other, strict=True)) for other in rows] for one in rows
    ]
    for i in range(size):
        square[i].append(right[i])
    pivots, reduced, _ = eliminate(square, size, 1e-13)
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
            held = [i for i in changed if moving is not None and i not in moving]
            sound = gap is None or _newton(x, gap, changed)
            if sound and (gap is None or all(abs(x[i]) > _COLLAPSED for i in held)):
                return x
    return None


def _newton(x: list[float], gap: Evaluate, changed: Sequence[int]) -> bool:
    """Change some entries of x until the gap vanishes; returns whether it does."""
    try:
        for _ in range(60):
            values = gap(*x)
            if max(map(abs, values)) < 1e-13:
                return True
            units = ([float(k == i) for k in range(len(x))] for i in changed)
            columns = [gap.slope(x, unit) for unit in units]
            rows = [list(row) for row in zip(*columns, strict=True)]
            for i, step in zip(changed, solve_least(rows, values), strict=True):
                x[i] -= step
        return all(
            abs(a) < 1e-10 * _terms(row, x, changed) for a, row in zip(gap(*x), rows, strict=True)
        )
    except (ValueError, ZeroDivisionError, OverflowError, TypeError):
        return False


def _terms(row: Sequence[float], x: Sequence[float], changed: Sequence[int]) -> float:
    """An estimate of the size of the terms in a value, from its slopes."""
    return max(1.0, sum(abs(a * x[i]) for a, i in zip(row, changed, strict=True)))


def normalise(gap: Evaluate, size: int, places: Sequence[int]) -> Evaluate:
    """Scale each row so that its largest slope at these random arguments is 1.

    So what is small does not depend on units and factors of the rows.
    """
    generator = random.Random(0)
    x = [generator.uniform(0.4, 1.7) for _ in range(size)]
    try:
        columns = [gap.slope(x, [float(k == i) for k in range(size)]) for i in places]
    except (ValueError, ZeroDivisionError, OverflowError, TypeError):
        return gap
    steepest = [max(map(abs, row)) for row in zip(*columns, strict=True)]
    scaled = copy(gap)
    scaled.factors = [1.0 / a if 0.0 < a < float("inf") else 1.0 for a in steepest]
    return scaled
