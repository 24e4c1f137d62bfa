"""Derivatives of reductions of a run, from those of its states.

Each is a weighted sum of derivatives of the reduced quantity q at some times: an extreme has that
of q at its own time (the envelope theorem), a mean has an integral, and the time of a crossing
moves by -q_p / q'.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from mechc.batch.reductions import Primitive, Reduction
from mechc.errors import MechcError
from mechc.native._codes import ABSOLUTE, FIRST_CROSSING, LAST, MEAN, MINIMUM, NORM
from mechc.sensitivities.events import GRAZES, difference
from mechc.system.parameters import Array
from mechc.system.quantities import slopes_of, values_of

SAMPLES = 8  # of a step, as many as the compiled reductions take
POINTS, WEIGHTS = (0.5 * each for each in np.polynomial.legendre.leggauss(SAMPLES))
SAME = 1e-4  # of the largest value: compiled reductions place a corner so well
AT_ONCE = 1e-6  # of the time of the run


def slopes_of_reduction(
    sol: Any, reduction: Reduction, value: float, names: Sequence[str]
) -> Array:
    """Derivatives (k,) of a reduction, which has this value, by names of ``sol.sensitivity``.

    NaN where the motion has none.  Raises :class:`MechcError`, with the reason, where the
    reduction has none.
    """
    if not np.isfinite(value):
        raise MechcError("the nominal motion has no value of it")
    if reduction.primitives[0].away:
        raise MechcError("what away= leaves out moves with the parts: omit away=")
    reduced = Reduced(sol, reduction)
    if reduction.primitives[0].reduction == FIRST_CROSSING:
        reduced.refuse_jump(value)
        return np.asarray(-reduced.along(np.array([value]), names)[0] / reduced.rate(value))
    parts = [reduced.places(primitive) for primitive in reduction.primitives]
    signs = [1.0] if len(parts) == 1 else [-1.0, 1.0]
    times = np.concatenate([t for t, _ in parts])
    weights = np.concatenate([sign * each for sign, (_, each) in zip(signs, parts, strict=True)])
    apart = abs(weights @ reduced.values(times) - value)
    if reduction.primitives[0].reduction != MEAN and apart > SAME * reduced.size:
        raise MechcError("it lies at a jump of the quantity")
    return np.asarray(weights @ reduced.along(times, names))


@dataclass
class Reduced:
    """What a reduction reduces, along a run."""

    sol: Any
    reduction: Reduction

    def _numbers(self, t: Array) -> Array:
        """The numbers (n, j) before their size or norm is taken."""
        sol = self.sol
        return values_of(self.reduction.quantities, sol.system, sol(t), sol.params, t)

    def values(self, t: Array) -> Array:
        """The reduced quantity (n,)."""
        numbers = self._numbers(t)
        form = self.reduction.primitives[0].form
        return np.asarray(
            np.linalg.norm(numbers, axis=1) if form in (ABSOLUTE, NORM) else numbers[:, 0]
        )

    def _turn(self, t: Array) -> Array:
        """Derivatives (n, j) of the reduced quantity by its numbers."""
        numbers = self._numbers(t)
        if self.reduction.primitives[0].form not in (ABSOLUTE, NORM):
            return np.ones_like(numbers)
        sizes = np.linalg.norm(numbers, axis=1, keepdims=True)
        return np.asarray(np.divide(numbers, sizes, out=np.zeros_like(numbers), where=sizes > 0.0))

    def along(self, t: Array, names: Sequence[str]) -> Array:
        """Derivatives (n, k) of the reduced quantity at fixed times."""
        each = [self.sol.sensitivity_of(q.name, list(names), t) for q in self.reduction.quantities]
        return np.asarray(np.einsum("nj,jnk->nk", self._turn(t), np.stack(each)))

    def _rate(self, t: float) -> tuple[float, float]:
        """The rate of the reduced quantity along the motion, and the size of its terms."""
        sol, quantities, at = self.sol, self.reduction.quantities, np.array([t])
        y, p = sol(at), sol.params
        by_state = slopes_of(quantities, "state", sol.system, y, p, at)[0]
        rates, turn = sol.system.rates(y, p, at)[0], self._turn(at)[0]
        by_time = difference(lambda e: values_of(quantities, sol.system, y, p, at + e)[0], 1.0)
        found = float(turn @ (by_state @ rates + by_time))
        return found, float(np.abs(turn) @ np.abs(by_state) @ np.abs(rates))

    def rate(self, t: float) -> float:
        """The rate of the reduced quantity along the motion.

        Raises :class:`MechcError` where it is zero.
        """
        found, terms = self._rate(t)
        if not abs(found) > GRAZES * terms:
            raise MechcError("the quantity only touches its level in the nominal motion")
        return found

    @cached_property
    def _grid(self) -> Array:
        """Times in every step, and the end."""
        t = self.sol.t
        inner = t[:-1, None] + np.diff(t)[:, None] * np.arange(SAMPLES) / SAMPLES
        return np.append(inner.ravel(), t[-1])

    @cached_property
    def size(self) -> float:
        """The largest size of the reduced quantity."""
        return float(np.abs(self.values(self._grid)).max())

    @property
    def _zeros(self) -> Array:
        """The times at which the number whose size is reduced changes its sign."""
        from scipy.optimize import brentq

        if self.reduction.primitives[0].form != ABSOLUTE:
            return np.zeros(0)
        seen = self._numbers(self._grid)[:, 0]
        changes = np.flatnonzero(seen[1:] * seen[:-1] < 0.0)
        number = lambda t: self._numbers(np.array([t]))[0, 0]  # noqa: E731
        return np.array([brentq(number, *self._grid[k : k + 2], xtol=1e-15) for k in changes])

    def places(self, primitive: Primitive) -> tuple[Array, Array]:
        """The times and weights of a primitive that is no crossing."""
        begin, end = self.sol.span
        if primitive.reduction == LAST:
            return np.array([end]), np.ones(1)
        if primitive.reduction == MEAN:
            if len(self._jumps):
                raise MechcError("a mean over impacts or resets moves with their times")
            ends = np.sort(np.concatenate([self.sol.t, self._zeros]))
            steps = np.diff(ends)
            times = ends[:-1, None] + steps[:, None] * (POINTS + 0.5)
            return times.ravel(), np.outer(steps / (end - begin), WEIGHTS).ravel()
        least = primitive.reduction == MINIMUM
        if least and len(zeros := self._zeros):  # the least size is 0, and stays 0
            return zeros[:1], np.zeros(1)
        at = self._time_of_least(1.0 if least else -1.0)
        self.refuse_jump(at)
        return np.array([at]), np.ones(1)

    def _time_of_least(self, sign: float) -> float:
        """The time of the least value of ``sign`` times the quantity: a zero of its rate beside the
        least of samples, or an end of the run."""
        from scipy.optimize import brentq

        t, k = self._grid, int(np.argmin(sign * self.values(self._grid)))
        low, high = t[max(k - 1, 0)], t[min(k + 1, len(t) - 1)]
        if low < high and sign * self._rate(low)[0] < 0.0 < sign * self._rate(high)[0]:
            return float(brentq(lambda s: self._rate(s)[0], low, high, xtol=1e-15))
        return float(t[k])

    @property
    def _jumps(self) -> Array:
        return np.array([part.t0 for part in self.sol.record.smooth_parts()[1:]])

    def refuse_jump(self, at: float) -> None:
        """Raises :class:`MechcError` where an impact or a reset is at this time."""
        begin, end = self.sol.span
        if np.any(np.abs(self._jumps - at) <= AT_ONCE * abs(end - begin)):
            raise MechcError("it lies at an impact or a reset, whose time moves too")
