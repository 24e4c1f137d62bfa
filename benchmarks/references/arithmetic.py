"""Numbers of 50 digits: mpmath's, which starts are found in, and quick ones, which motions are
computed in: those of gmpy2 (MPFR) where it is installed, in a tenth of the time.

Functions take either; an operation takes two of one kind.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from operator import mul
from typing import Any

import mpmath
from mpmath import mpc, mpf

try:
    import gmpy2
except ImportError:  # mpmath alone: the same digits, later
    gmpy2 = None

DIGITS = 50
mpmath.mp.dps = DIGITS
Vector = list[Any]


def number(x: Any) -> Any:
    """A quick number of an int, a float, a text or a number of mpmath."""
    if gmpy2 is None:
        return mpmath.mpmathify(x)
    if isinstance(x, mpc):
        return gmpy2.mpc(number(x.real), number(x.imag))
    if not isinstance(x, mpf):
        return x if isinstance(x, QUICK) else number(mpmath.mpmathify(x))
    mantissa, exponent = x.man_exp  # without the sign
    whole = gmpy2.mpfr(int(mantissa) * int(mpmath.sign(x)))
    return gmpy2.mul_2exp(whole, exponent) if exponent >= 0 else gmpy2.div_2exp(whole, -exponent)


def numbers(xs: Iterable[Any]) -> Vector:
    return [number(x) for x in xs]


def of_mpmath(x: Any) -> Any:
    """The same number as one of mpmath."""
    if gmpy2 is None or not isinstance(x, QUICK):
        return mpmath.mpmathify(x)
    if isinstance(x, gmpy2.mpc):
        return mpc(of_mpmath(x.real), of_mpmath(x.imag))
    mantissa, exponent = x.as_mantissa_exp()
    return mpmath.ldexp(mpf(int(mantissa)), int(exponent))


def _either(name: str) -> Callable[[Any], Any]:
    slow: Callable[[Any], Any] = getattr(mpmath, name)
    if gmpy2 is None:
        return slow
    quick = getattr(gmpy2, name)
    return lambda x: quick(x) if isinstance(x, QUICK) else slow(x)


if gmpy2 is not None:
    gmpy2.get_context().precision = mpmath.mp.prec
    QUICK = (gmpy2.mpfr, gmpy2.mpc)

sin, cos, sqrt, tan = (_either(name) for name in ("sin", "cos", "sqrt", "tan"))
FUNCTIONS = {"sin": sin, "cos": cos, "sqrt": sqrt, "tan": tan}


def solution(rows: list[Vector]) -> Vector:
    """Of linear equations, right-hand side last, by elimination with the largest pivot."""
    size = len(rows)
    for k in range(size):
        best = max(range(k, size), key=lambda i: abs(rows[i][k]))
        rows[k], rows[best] = rows[best], rows[k]
        for row in rows[k + 1 :]:
            factor = row[k] / rows[k][k]
            row[k:] = [a - factor * b for a, b in zip(row[k:], rows[k][k:], strict=True)]
    x: Vector = []
    for k in range(size - 1, -1, -1):
        known = dot(rows[k][k + 1 : size], x)
        x.insert(0, (rows[k][size] - known) / rows[k][k])
    return x


def agreed(first: Iterable[Vector], second: Iterable[Vector], *, by_row: bool = False) -> int:
    """On how many digits two ways agree, of each number or of the largest in its row."""
    apart = max(
        abs(a - b) / (max(map(abs, x)) if by_row else max(1, abs(a)))
        for x, y in zip(first, second, strict=True)
        for a, b in zip(x, y, strict=True)
    )
    return min(DIGITS, int(-mpmath.log10(apart))) if apart else DIGITS


def texts(values: Vector, digits: int) -> list[str]:
    return [mpmath.nstr(x, digits, strip_zeros=False) for x in values]


def dot(a: Iterable[Any], b: Iterable[Any]) -> Any:
    return sum(map(mul, a, b))
