"""Piecewise polynomials of one or two arguments, evaluated for numbers and arrays."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import perm
from typing import Any

import numpy as np

from mechc.errors import ValueOutOfBoundsError
from mechc.system.parameters import Array


def within_doubles(what: str, fit: Callable[[], tuple[Any, Array]]) -> tuple[Any, Array]:
    """The starts and coefficients of the polynomials that ``fit`` finds through samples.

    Raises :class:`ValueOutOfBoundsError` where doubles do not hold them.
    """
    try:
        with np.errstate(over="raise", divide="raise", invalid="raise"):
            starts, coefficients = fit()
    except FloatingPointError:
        coefficients = np.array(np.nan)
    if not np.isfinite(coefficients).all():
        raise ValueOutOfBoundsError(
            f"the samples of a {what} are too large, or too far from each other or too near: "
            "differences between them, and slopes, must be within the range of doubles"
        )
    return starts, coefficients


class Pieces:
    """``coefficients``: (pieces of x, [pieces of y,] degree + 1, [degree + 1]), powers from each
    piece's start; ``periods``: of each argument, None where it is not periodic."""

    def __init__(self, starts: Sequence[Any], degree: int, coefficients: Any, periods: Any) -> None:
        self.starts = [np.asarray(axis, dtype=np.float64) for axis in starts]
        shape = [len(axis) for axis in self.starts] + [degree + 1] * len(self.starts)
        self.coefficients = np.asarray(coefficients, dtype=np.float64).reshape(shape)
        self.degree, self.periods = degree, tuple(periods)

    def __call__(self, orders: Sequence[int], *arguments: Any) -> Any:
        """A derivative, by the operations of compiled code: floats for floats, else arrays.

        Raises
        ------
        TypeError
            For complex arguments.
        """
        if any(map(np.iscomplexobj, arguments)):
            raise TypeError("a table is a function of real numbers")
        given = [np.asarray(x, dtype=np.float64) for x in np.broadcast_arrays(*arguments)]
        places, since = [], []
        for axis, x, period in zip(self.starts, given, self.periods, strict=True):
            at = x if period is None else x - period * np.floor((x - axis[0]) / period)
            piece = np.maximum(np.searchsorted(axis, at, side="right") - 1, 0)
            places.append(np.where(np.isnan(at), 0, piece))
            since.append(at - axis[places[-1]])
        value = self.coefficients[tuple(places)]  # (..., powers of each argument)
        for k in range(len(since) - 1, -1, -1):
            value = _polynomial(value, orders[k], since[k][(..., *[None] * k)])
        return float(value) if value.ndim == 0 else value


def _polynomial(factors: Array, order: int, h: Array) -> Array:
    """A derivative of polynomials whose factors are along the last axis."""
    powers = range(factors.shape[-1] - 1, order - 1, -1)
    value = np.zeros(factors.shape[:-1])
    for n in powers:
        value = value * h + perm(n, order) * factors[..., n]
    return value
