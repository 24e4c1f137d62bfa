"""Dual numbers: a value and its derivatives along some directions, carried through
every operation (forward mode; Griewank & Walther 2008, chapter 3)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import mpmath

from .. import arithmetic
from ..arithmetic import Vector, number, numbers, of_mpmath


class Dual:
    """A number with derivatives (k,)."""

    __slots__ = ("slopes", "value")

    def __init__(self, value: Any, slopes: Sequence[Any]) -> None:
        self.value, self.slopes = value, slopes

    def chain(self, value: Any, slope: Any) -> Dual:
        """A function's value here, by its derivative."""
        return Dual(value, [slope * d for d in self.slopes])

    def __add__(self, other: Any) -> Dual:
        if not isinstance(other, Dual):
            return Dual(self.value + other, self.slopes)
        pairs = zip(self.slopes, other.slopes, strict=True)
        return Dual(self.value + other.value, [a + b for a, b in pairs])

    def __mul__(self, other: Any) -> Dual:
        if not isinstance(other, Dual):
            return self.chain(self.value * other, other)
        x, y = self.value, other.value
        pairs = zip(self.slopes, other.slopes, strict=True)
        return Dual(x * y, [a * y + x * b for a, b in pairs])

    def __pow__(self, power: Any) -> Dual:
        return self.chain(self.value**power, power * self.value ** (power - 1))

    def __neg__(self) -> Dual:
        return self.chain(-self.value, -1)

    def __sub__(self, other: Any) -> Dual:
        return self + -other

    def __rsub__(self, other: Any) -> Dual:
        return -self + other

    def __truediv__(self, other: Any) -> Dual:
        if isinstance(other, Dual):
            return self * other**-1
        return Dual(self.value / other, [d / other for d in self.slopes])

    def __rtruediv__(self, other: Any) -> Dual:
        return self**-1 * other

    __radd__, __rmul__ = __add__, __mul__


def _of(value: Callable[[Any], Any], slope: Callable[[Any], Any]) -> Callable[[Any], Any]:
    def function(x: Any) -> Any:
        return x.chain(value(x.value), slope(x.value)) if isinstance(x, Dual) else value(x)

    return function


sin = _of(arithmetic.sin, arithmetic.cos)
cos = _of(arithmetic.cos, lambda x: -arithmetic.sin(x))
sqrt = _of(arithmetic.sqrt, lambda x: 1 / (2 * arithmetic.sqrt(x)))
tan = _of(arithmetic.tan, lambda x: 1 / arithmetic.cos(x) ** 2)
FUNCTIONS = {"sin": sin, "cos": cos, "sqrt": sqrt, "tan": tan}


def slopes_of(x: Any, count: int) -> Vector:
    """The derivatives of a number, zeros of one that has none."""
    return list(x.slopes) if isinstance(x, Dual) else [x * 0] * count


def value_of(x: Any) -> Any:
    return x.value if isinstance(x, Dual) else x


def quick(x: Any) -> Any:
    """The same dual number over quick ones."""
    return Dual(number(x.value), numbers(x.slopes)) if isinstance(x, Dual) else number(x)


def of_mpmath_dual(x: Dual) -> Dual:
    return Dual(of_mpmath(x.value), [of_mpmath(d) for d in x.slopes])


def solved(residual: Callable[[Vector, Vector], Vector], unknowns: Vector, given: Vector) -> Vector:
    """Unknowns at a root as dual numbers, of given dual numbers: the implicit function theorem.

    ``residual``: of the unknowns and of what is given.
    """
    count, size = len(given[0].slopes), len(unknowns)
    gaps = [slopes_of(x, count) for x in residual(unknowns, given)]
    unit = mpmath.eye(size)
    around = [Dual(x, list(unit[i, :])) for i, x in enumerate(unknowns)]
    held = [value_of(x) for x in given]
    rows = mpmath.matrix([slopes_of(x, size) for x in residual(around, held)])
    columns = [mpmath.lu_solve(rows, mpmath.matrix([gap[k] for gap in gaps])) for k in range(count)]
    return [Dual(x, [-column[i] for column in columns]) for i, x in enumerate(unknowns)]
