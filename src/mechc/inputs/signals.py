"""Sampled signals: the values of an input between its samples."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from copy import copy
from math import comb, factorial, perm
from typing import Any

import numpy as np

from mechc.errors import ValueOutOfBoundsError
from mechc.system.names import checked_word
from mechc.system.parameters import Array, doubles
from mechc.system.tables import within_doubles
from mechc.system.units import SECONDS

DEGREES = {"previous": 0, "linear": 1, "cubic": 3, "quintic": 5}
SMOOTHNESS = {"previous": -1, "linear": 0, "cubic": 2, "quintic": 4}  # continuous derivatives
HIGHEST = 5
CONTINUOUS = 1e-9  # of the largest value of a derivative
FAR = 1e300  # s; the begin of a piece that is held


PARTS = ("times", "values", "knots", "coefficients")  # the arrays that a signal consists of


class Signal:
    """A function of time that is known at samples.

    Parameters
    ----------
    times : (n,)
        In s, strictly increasing; texts with a unit and quantities of pint are converted.
    values : (n,)
        In the unit of the input; texts with a unit and quantities of pint are converted.
    kind
        Between the samples: ``"previous"`` keeps each value until the next sample, ``"linear"``
        joins them by lines, ``"cubic"`` and ``"quintic"`` by the spline of that degree with 2 and
        4 continuous derivatives ("not a knot" at the ends; de Boor 1978, chapters IV and XIII).
    outside
        ``"refuse"``: a run must stay within the samples; ``"hold"``: before the first and after
        the last sample their values continue.
    breaks
        ``"kinks"``: steps of a run end at the samples where the signal has kinks; ``"samples"``: at
        all of them, as gradients by the values need it.

    Raises
    ------
    UnknownNameError
        For a kind or a rule that does not exist.
    ValueOutOfBoundsError
        For samples that are not finite, not in order, or too few: 2, and 4 for a cubic, 6 for a
        quintic spline.
    """

    def __init__(
        self, times: Array, values: Array, kind: str = "cubic", *, outside: str = "refuse",
        breaks: str = "kinks",
    ) -> None:  # fmt: skip
        checked_word("kind of signal", kind, DEGREES)
        checked_word("rule outside the samples", outside, ("refuse", "hold"))
        checked_word("rule for breaks", breaks, ("kinks", "samples"))
        self.kind, self.outside, self._at_samples = kind, outside, breaks == "samples"
        self.times, self.values = _checked_samples(times, values, kind)
        self._smoothness = SMOOTHNESS[kind]
        self._knots, self._coefficients = within_doubles(
            "signal", lambda: _pieces(self.times, self.values, kind)
        )
        if outside == "hold":
            self._hold()

    _smoothness: int
    _at_samples = False

    @classmethod
    def of_interpolant(cls, interpolant: Any) -> Signal | None:
        """The signal that an interpolant of SciPy is, kinks and all; None for anything else.

        Taken are ``PPoly`` (``CubicSpline``, ``PchipInterpolator``, ``Akima1DInterpolator``),
        ``BSpline`` (``make_interp_spline``) and ``interp1d`` of lines or steps, of one value at
        each time and up to degree 5.  A run must stay within its knots.
        """
        pieces = _pieces_of(interpolant)
        if pieces is None:
            return None
        knots, coefficients = within_doubles("signal", lambda: pieces)
        signal = object.__new__(cls)
        signal.kind, signal.outside = f"degree {coefficients.shape[1] - 1}", "refuse"
        signal._knots, signal._coefficients = knots[:-1].copy(), coefficients
        last = _shift(coefficients[-1:], np.diff(knots[-2:]), 0)
        signal.times, signal.values = knots, np.append(coefficients[:, 0], last)
        signal._smoothness = signal._continuous_derivatives()
        return signal

    @classmethod
    def of_interpolants(cls, interpolant: Any) -> list[Signal] | None:
        """The signals of an interpolant of SciPy of several values at each time (n, k)."""
        scipy = sys.modules.get("scipy.interpolate")
        if scipy is None:
            return None
        if isinstance(interpolant, scipy.BSpline) and interpolant.c.ndim == 2:
            columns = [scipy.BSpline(interpolant.t, c, interpolant.k) for c in interpolant.c.T]
        elif isinstance(interpolant, scipy.PPoly) and interpolant.c.ndim == 3:
            x, outside = interpolant.x, interpolant.extrapolate
            columns = [scipy.PPoly(c, x, outside) for c in np.moveaxis(interpolant.c, 2, 0)]
        else:
            return None
        found = [signal for signal in map(cls.of_interpolant, columns) if signal is not None]
        return found if len(found) == len(columns) else None

    @property
    def parts(self) -> tuple[dict[str, Any], dict[str, Array]]:
        """The contents of the signal for a file: data for JSON, and arrays."""
        words = {"kind": self.kind, "outside": self.outside, "at_samples": self._at_samples}
        arrays = {"times": self.times, "values": self.values}
        arrays |= {"knots": self._knots, "coefficients": self._coefficients}
        return {**words, "smoothness": self._smoothness}, arrays

    @classmethod
    def from_parts(cls, words: Mapping[str, Any], arrays: Mapping[str, Array]) -> Signal:
        """The signal of :attr:`parts`, with the same values to the last bit.

        Raises ``ValueError`` if no signal has such parts.
        """
        signal = object.__new__(Signal)
        signal.kind, signal.outside = str(words["kind"]), words["outside"]
        signal._at_samples, signal._smoothness = words["at_samples"], words["smoothness"]
        signal.times, signal.values = arrays["times"], arrays["values"]
        signal._knots, signal._coefficients = arrays["knots"], arrays["coefficients"]
        knots, factors = signal._knots, signal._coefficients
        rows = (signal.times, signal.values, knots)
        fits = all(row.dtype == np.float64 and row.ndim == 1 and len(row) for row in rows)
        fits = fits and factors.dtype == np.float64 and factors.ndim == 2
        fits = fits and len(factors) == len(knots) and 1 <= factors.shape[1] <= HIGHEST + 1
        known = signal.outside in ("hold", "refuse") and type(signal._at_samples) is bool
        known = known and type(signal._smoothness) is int
        if not (fits and known and (np.diff(knots) > 0).all() and np.isfinite(factors).all()):
            raise ValueError("a signal whose parts do not fit")
        return signal

    def _continuous_derivatives(self) -> int:
        """The number of continuous derivatives, by the jumps at the knots, to rounding."""
        widths, degree = np.diff(self._knots), self._coefficients.shape[1] - 1
        for n in range(degree + 1):
            before, after = _shift(self._coefficients[:-1], widths, n), self._coefficients[1:, n]
            size = np.abs(self._coefficients[:, n]).max(initial=0.0)
            if (np.abs(after - before) > CONTINUOUS * size).any():
                return n - 1
        return int(degree)

    @property
    def smoothness(self) -> int:
        """The number of continuous derivatives; -1: the value itself jumps."""
        return min(self._smoothness, 0) if self.outside == "hold" else self._smoothness

    def breaks(self, rtol: float, order: int = 0) -> Array:
        """Times in s of the knots that a run which tolerates a relative error must not step over.

        ``order``: the highest derivative that the equations hold.  Where no knot is left out a
        pulse, however short, is not missed either: between two of these times the signal is one
        polynomial but for less than a hundredth of what is tolerated.
        """
        if self._at_samples:
            return np.array(self._knots[1:])
        noise = max(1e-2 * rtol, 1e-14)
        largest = np.abs(factorial(order) * self._coefficients[:, order]).max(initial=0.0)
        breaks: Array = self._knots[1:][self._roughness(order) > noise * largest]
        return breaks

    def _roughness(self, order: int) -> Array:
        """The largest jump of a derivative at each inner knot, measured by its effect on the
        derivative of an order within a piece."""
        widths = np.minimum(np.diff(self._knots), np.ptp(self.times))
        reach = np.maximum(widths, np.append(widths[1:], 0.0))
        roughness = np.zeros(len(widths))
        for n in range(order, self._coefficients.shape[1]):
            jump = np.abs(_shift(self._coefficients[:-1], widths, n) - self._coefficients[1:, n])
            roughness = np.maximum(roughness, perm(n, order) * jump * reach ** (n - order))
        return roughness

    def broken_at_samples(self) -> Signal:
        """A copy of the signal with ``breaks="samples"``."""
        other = copy(self)
        other._at_samples = True
        return other

    @property
    def pieces(self) -> tuple[Array, Array]:
        """Knots (n,) and coefficients (n, degree + 1) in powers of the time since the knot."""
        return self._knots, self._coefficients

    @property
    def span(self) -> tuple[float, float]:
        """Times in s between which it is known."""
        if self.outside == "hold":
            return -np.inf, np.inf
        return float(self.times[0]), float(self.times[-1])

    def __call__(self, t: float | Array, order: int = 0) -> Array:
        """The value, or the derivative of an order, at times within :attr:`span`; at a jump the
        value after it."""
        times = np.asarray(t, dtype=np.float64)
        low, high = self.span
        if not ((times >= low) & (times <= high)).all():
            raise ValueOutOfBoundsError(f"the signal is known for {low:g} ... {high:g} s only")
        return polynomials_at(*self.pieces, times, order)

    def _hold(self) -> None:
        width = self._coefficients.shape[1]
        ends = np.zeros((2, width))
        ends[:, 0] = self.values[[0, -1]]
        last = slice(None, -1) if self.kind == "previous" else slice(None)
        inner, knots = self._coefficients[last], self._knots[last]
        self._knots = np.concatenate([[-FAR], knots, [self.times[-1]]])
        self._coefficients = np.vstack([ends[:1], inner, ends[1:]])

    def __repr__(self) -> str:
        low, high = self.times[[0, -1]]
        return f"<mechc.Signal, {self.kind}, {len(self.times)} samples in {low:g} ... {high:g} s>"


def polynomials_at(knots: Array, coefficients: Array, t: Array, order: int) -> Array:
    """The derivative of an order of piecewise polynomials, in powers of the time since a knot."""
    piece = np.maximum(np.searchsorted(knots, t, side="right") - 1, 0)
    since, value = t - knots[piece], np.zeros(t.shape)
    for n in range(coefficients.shape[1] - 1, order - 1, -1):
        value = value * since + np.prod(np.arange(n, n - order, -1.0)) * coefficients[piece, n]
    return value


def _shift(coefficients: Array, by: Array, order: int) -> Array:
    """The coefficient of an order of the same polynomials about a later time (Taylor)."""
    value = np.zeros(len(coefficients))
    for n in range(coefficients.shape[1] - 1, order - 1, -1):
        value = value * by + comb(n, order) * coefficients[:, n]
    return value


def _checked_samples(times: Any, values: Any, kind: str) -> tuple[Array, Array]:
    try:
        t = doubles(times, "the times of a signal", of=SECONDS)
        x = doubles(values, "the values of a signal")
    except TypeError:
        raise ValueOutOfBoundsError("the samples of a signal must be numbers") from None
    if t.ndim != 1 or x.shape != t.shape:
        raise ValueOutOfBoundsError(
            f"a signal needs one value for each time; the shapes are {t.shape} and {x.shape}"
        )
    least = max(DEGREES[kind] + 1, 2)
    if len(t) < least:
        raise ValueOutOfBoundsError(f"a {kind} signal needs {least} samples, not {len(t)}")
    if not np.isfinite(x).all():
        raise ValueOutOfBoundsError("the samples of a signal must be finite")
    if not (np.abs(t) < FAR).all():
        raise ValueOutOfBoundsError(f"the times of a signal must be within {FAR:g} s of 0")
    if not (t[1:] > t[:-1]).all():
        raise ValueOutOfBoundsError("the times of a signal must strictly increase")
    return t, x


def _pieces(t: Array, x: Array, kind: str) -> tuple[Array, Array]:
    """Knots (n,) and coefficients (n, degree + 1) in powers of the time since the knot."""
    if kind == "previous":
        return t, x[:, None].copy()
    if kind == "linear":
        return t[:-1].copy(), np.column_stack([x[:-1], np.diff(x) / np.diff(t)])
    from scipy.interpolate import PPoly, make_interp_spline

    found = PPoly.from_spline(make_interp_spline(t, x, DEGREES[kind]))
    real = np.diff(found.x) > 0  # a spline's outer knots are repeated
    coefficients = np.ascontiguousarray(found.c[::-1, real].T)
    return np.ascontiguousarray(found.x[:-1][real]), coefficients


def _pieces_of(interpolant: Any) -> tuple[Array, Array] | None:
    """Knots (n + 1,) and coefficients (n, degree + 1) of an interpolant of SciPy."""
    scipy = sys.modules.get("scipy.interpolate")
    if scipy is None:  # then there is none
        return None
    if isinstance(interpolant, scipy.interp1d):
        return _pieces_of_samples(interpolant)
    if isinstance(interpolant, scipy.BSpline) and interpolant.c.ndim == 1:
        interpolant = scipy.PPoly.from_spline(interpolant)
    if not isinstance(interpolant, scipy.PPoly) or interpolant.c.ndim != 2:
        return None
    if interpolant.extrapolate == "periodic" or len(interpolant.c) > HIGHEST + 1:
        return None
    real = np.diff(interpolant.x) > 0  # a spline's outer knots are repeated
    knots = np.append(interpolant.x[:-1][real], interpolant.x[-1])
    return knots, np.ascontiguousarray(interpolant.c[::-1, real].T)


def _pieces_of_samples(interpolant: Any) -> tuple[Array, Array] | None:
    """Lines or steps of ``interp1d``."""
    kind, times = interpolant._kind, np.array(interpolant.x, dtype=np.float64)
    values = np.array(interpolant.y, dtype=np.float64)
    if values.ndim != 1 or kind not in ("linear", "previous"):
        return None
    knots = np.append(times, times[-1]) if kind == "previous" else times
    return knots, _pieces(times, values, kind)[1]
