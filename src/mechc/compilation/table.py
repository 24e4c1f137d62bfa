"""Lookup tables of one and two arguments for expressions: :class:`Table`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from mechc.errors import ValueOutOfBoundsError, brief
from mechc.inputs.signals import Signal
from mechc.system.parameters import Array, doubles
from mechc.system.tables import Pieces, within_doubles

DEGREES = {"linear": 1, "cubic": 3}
OUTSIDE = ("extend", "hold", "repeat")
FAR = 1e300  # where the piece before the samples begins


class Table:
    """A function known by samples on a grid, for expressions, and for numbers.

    Parameters
    ----------
    x : (n,)
        Where it is known, strictly increasing.
    y : (m,), optional
        Of a second argument: then values are (n, m).
    values : (n,) or (n, m)
        These and the places in SI units, as quantities of pint are taken.
    kind : ``"cubic"`` or ``"linear"``
        A spline with two continuous derivatives, in both arguments (not-a-knot ends; it takes at
        least four samples), or lines, whose slope jumps at the samples.
    outside : ``"extend"``, ``"hold"`` or ``"repeat"``
        Beyond the samples the first and the last polynomial go on, or the first and the last value
        is held (the slope jumps there), or the samples are one period, the last value equal to the
        first.  One word, or one for each argument.

    ``table(q)`` with a symbol, a function of time or an expression is an expression of SymPy that
    may stand in loads, constraints, inputs, outputs and the lift of a cam; SymPy differentiates it
    exactly.  ``table(0.3)`` and arrays give numbers.  Compiled code keeps the samples' polynomials
    as data, and a value costs a search for the piece.

    Raises
    ------
    ValueOutOfBoundsError
        For samples of the wrong shape, not finite or not increasing, and unknown words.

    Examples
    --------
    >>> street = Table([0.0, 1.0, 2.0, 3.0], [0.0, 0.1, 0.0, -0.1])
    >>> round(street(1.5), 6)
    0.0625
    """

    def __init__(
        self, x: Any, *more: Any, kind: str = "cubic", outside: str | Sequence[str] = "extend"
    ) -> None:
        if len(more) not in (1, 2) or kind not in DEGREES:
            raise ValueOutOfBoundsError(
                "a table takes (x, values) or (x, y, values), with kind 'linear' or 'cubic', not "
                f"{len(more) + 1} arrays and {kind!r}"
            )
        axes, values = _check([x, *more[:-1]], more[-1], DEGREES[kind] + 1)
        words = (outside,) * len(axes) if isinstance(outside, str) else tuple(outside)
        if len(words) != len(axes) or not set(words) <= set(OUTSIDE):
            raise ValueOutOfBoundsError(f"outside is one of {OUTSIDE}, not {brief(outside)}")
        self.kind, self.arguments = kind, len(axes)
        spans: list[float] = []

        def fit() -> tuple[list[Array], Array]:
            spans.extend(float(np.ptp(axis)) for axis in axes)
            return _fit(axes, values, kind, words)

        starts, coefficients = within_doubles("table", fit)
        periods = [x if word == "repeat" else None for x, word in zip(spans, words, strict=True)]
        self._pieces = Pieces(starts, DEGREES[kind], coefficients, periods)

    @classmethod
    def of_signal(cls, signal: Signal) -> Table:
        """The table with the polynomials of a signal of any kind, the first and last of which go
        on."""
        table, (knots, coefficients) = object.__new__(cls), signal.pieces
        table.kind, table.arguments = signal.kind, 1
        table._pieces = Pieces([knots], coefficients.shape[1] - 1, coefficients, [None])
        return table

    def __call__(self, *arguments: Any) -> Any:
        """An expression, where an argument is one; else numbers."""
        if len(arguments) != self.arguments:
            raise TypeError(f"the table takes {self.arguments} arguments, not {len(arguments)}")
        if any(hasattr(x, "free_symbols") for x in arguments):
            return self._function()(*arguments)
        return self._pieces((0,) * self.arguments, *arguments)

    def _function(self) -> Any:
        from mechc_codegen.description.tables import TableData, lookup

        pieces = self._pieces
        starts = tuple(tuple(axis.tolist()) for axis in pieces.starts)
        factors = tuple(pieces.coefficients.ravel().tolist())
        data = TableData(starts, pieces.degree, factors, pieces.periods, pieces)
        return lookup(data, (0,) * self.arguments)

    def __repr__(self) -> str:
        size = " x ".join(str(len(axis)) for axis in self._pieces.starts)
        return f"<mechc.Table, {self.kind}, {size} pieces>"


def _check(axes: Sequence[Any], values: Any, least: int) -> tuple[list[Array], Array]:
    try:
        grids = [doubles(axis, "the places of a table") for axis in axes]
        samples = doubles(values, "the values of a table")
    except TypeError:
        raise ValueOutOfBoundsError("the samples of a table must be numbers") from None
    shape = tuple(axis.size for axis in grids)
    if any(axis.ndim != 1 for axis in grids) or samples.shape != shape:
        raise ValueOutOfBoundsError(
            f"a table needs a value for each place, of the shape {shape}, not {samples.shape}"
        )
    if min(shape) < least:
        raise ValueOutOfBoundsError(f"a table needs {least} samples an argument, not {min(shape)}")
    if not all(np.isfinite(part).all() for part in (*grids, samples)):
        raise ValueOutOfBoundsError("the samples of a table must be finite")
    if not all((axis[1:] > axis[:-1]).all() for axis in grids):
        raise ValueOutOfBoundsError("the places of a table must strictly increase")
    return grids, samples


def _fit(
    axes: Sequence[Array], values: Array, kind: str, words: Sequence[str]
) -> tuple[list[Array], Array]:
    """Starts of pieces, and coefficients (pieces of each argument, powers of each argument)."""
    starts, coefficients = [], values
    for k, (axis, word) in enumerate(zip(axes, words, strict=True)):
        # axis k has samples; it becomes pieces, and powers come last
        found = _along(axis, np.moveaxis(coefficients, k, 0), kind, word)
        axis_starts = axis[:-1]
        if word == "hold":  # a constant piece before and after
            samples = np.moveaxis(coefficients, k, 0)
            ends = np.zeros((len(found), 2, *samples.shape[1:]))
            ends[0] = samples[[0, -1]]
            found = np.concatenate([ends[:, :1], found, ends[:, 1:]], axis=1)
            axis_starts = np.concatenate([[min(-FAR, 2.0 * axis[0])], axis])
        starts.append(axis_starts)
        coefficients = np.moveaxis(np.moveaxis(found, 0, -1), 0, k)
    return starts, np.ascontiguousarray(coefficients)


def _along(axis: Array, values: Array, kind: str, word: str) -> Array:
    """Polynomials along the first axis: (powers, pieces, ...)."""
    if word == "repeat" and not np.array_equal(values[0], values[-1]):
        raise ValueOutOfBoundsError("a table that repeats needs its last value equal to its first")
    if kind == "linear":
        widths = np.diff(axis).reshape(-1, *[1] * (values.ndim - 1))
        return np.stack([values[:-1], np.diff(values, axis=0) / widths])
    from scipy.interpolate import CubicSpline

    ends = "periodic" if word == "repeat" else "not-a-knot"
    return np.asarray(CubicSpline(axis, values, bc_type=ends).c[::-1])
