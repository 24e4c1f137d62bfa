"""One trajectory without C: Dormand & Prince of order 8(5,3), every stage on the constraints.

A stage closes the loops and projects the speeds before accelerations are evaluated; step control
after Hairer, Norsett & Wanner (1993), section II.4, as in the compiled pair.

It does not pass change points.  It monitors the conditioning of the rows instead: a step over which
their smallest singular value changes by more than twice its least value may hide a zero, and is
halved; where the value is less than a thousandth of that at ordinary configurations, the run ends.
So the motion never takes another branch unnoticed.
"""

from __future__ import annotations

from bisect import bisect_right
from typing import Any, NamedTuple

import numpy as np

from mechc.native._codes import (
    FINISHED,
    MEMORY_LIMIT,
    NEARLY_DEPENDENT,
    NOT_CLOSED,
    NOT_FINITE,
    RUNNING,
    SINGULAR_MASS,
    STEP_TOO_SMALL,
    TOO_MANY_STEPS,
)
from mechc.numpy_backend.conditioning import Conditioning
from mechc.numpy_backend.linear import EPS, massless
from mechc.numpy_backend.projection import Manifold
from mechc.system.parameters import Array

ORDER, STAGES, RATES, DENSE_ROWS = 8, 12, 16, 7
SHARE = 0.03  # of the tolerance that one step may use: local errors accumulate over a run
MOST_GROWTH, LEAST_SHRINK, SAFETY = 6.0, 0.2, 0.9


class RunLimits(NamedTuple):
    """Span, tolerances and limits of steps."""

    t1: float
    rtol: float
    atol: Array | None
    max_step: float
    max_steps: int
    dense: bool
    max_bytes: float = np.inf


class _Pair:
    """The tableau, as SciPy has it."""

    def __init__(self) -> None:
        from scipy.integrate import DOP853  # slow to import

        self.nodes = np.concatenate([DOP853.C, [1.0], DOP853.C_EXTRA])
        self.matrix = np.zeros((RATES, RATES))
        self.matrix[:STAGES, :STAGES] = DOP853.A
        self.matrix[STAGES, :STAGES] = DOP853.B
        self.matrix[STAGES + 1 :] = DOP853.A_EXTRA
        self.errors = np.stack([DOP853.E5, DOP853.E3])
        self.dense = DOP853.D


class NumpyRun:
    """A run under way or finished, with the interface of :class:`mechc.native._run.Run`."""

    crossings = 0

    def __init__(
        self, manifold: Manifold, t0: float, y0: Array, scale: Array, first_step: float,
        limits: RunLimits,
    ) -> None:  # fmt: skip
        self.manifold = self.whole = manifold
        self.limits, self.pair = limits, _Pair()
        self.width = manifold.listing.coordinates
        self.t, self.status, self.failure = float(t0), RUNNING, RUNNING
        self.y = np.array(y0, dtype=np.float64)
        self.direction = 1.0 if limits.t1 >= t0 else -1.0
        self.rates = np.zeros((RATES, len(self.y)))
        self.counts = {"steps": 0, "rejected": 0, "rhs_evaluations": 0, "closure_iterations": 0}
        self.speed, self.refused = -1, False
        self.watch = Conditioning(manifold, self.t, self.y)
        self.status = self.watch.status or self._stage(self.t, self.y, 0)
        self._times, self._states, self._dense = [self.t], [self.y.copy()], list[Array]()
        self._ordered = [self.direction * self.t]  # times in the direction of the run
        if self.status != RUNNING:
            return
        self.scale = self._first_scale(np.asarray(scale))
        self.step = first_step or self._first_step()
        if t0 == limits.t1:
            self.status = FINISHED

    def extend(self, t1: float, inputs: Any = None) -> None:
        """Go on to t1, from the end of the run or before it, with other inputs where given."""
        if self.status not in (RUNNING, FINISHED):
            return
        self.limits = self.limits._replace(t1=t1)
        last = np.abs(np.diff(self._times[-3:]))  # of two steps: the last may have been cut short
        self.step = max(self.step, float(last.max(initial=0.0)))
        self.status = RUNNING
        if inputs is not None:
            self.manifold = self.manifold.with_inputs(inputs)
            self.status = self._stage(self.t, self.y, 0)

    met_critical = False

    def state(self) -> Array:
        """The last accepted state (nq + nu,)."""
        return self._states[-1].copy()

    def read_with(self, inputs: Any) -> None:
        """The inputs that :meth:`interpolate` takes, of the whole run."""
        self.whole = self.manifold.with_inputs(inputs)

    # -- stages ------------------------------------------------------------------------------

    def _stage(self, t: float, y: Array, rate: int) -> int:
        """Move y onto the constraints, in place, and evaluate its rates."""
        time = np.array([t])
        settled, closed = self.manifold.settle(time, y[None])
        self.counts["rhs_evaluations"] += 1
        self.counts["closure_iterations"] += closed.iterations
        if closed.status[0] != RUNNING:
            return self._fail(int(closed.status[0]), closed.place.mass[0])
        y[:] = settled[0]
        self.rates[rate] = self.manifold.accelerate(time, y[None, self.width :], closed)[0]
        self.watch.meet(t, closed.rows)
        if np.isfinite(self.rates[rate]).all():
            return RUNNING
        return self._fail(NOT_FINITE, closed.place.mass[0])

    def _fail(self, status: int, mass: Array) -> int:
        """The status: a mass matrix that is not positive definite has its own, with the speed."""
        if status == NOT_CLOSED or not np.isfinite(mass).all():
            return status
        self.speed = massless(mass)
        return SINGULAR_MASS if self.speed >= 0 else status

    def _rates(self, first: int, last: int, h: float) -> tuple[int, Array]:
        """Rates first .. last of the tableau; the state of the last."""
        end = self.y
        for i in range(first, last + 1):
            end = self.y + h * (self.pair.matrix[i, :i] @ self.rates[:i])
            status = self._stage(self.t + self.pair.nodes[i] * h, end, i)
            if status != RUNNING:
                return status, end
        return RUNNING, end

    # -- errors and steps ----------------------------------------------------------------------

    def _tolerance(self, end: Array) -> Array:
        limits, size = self.limits, np.maximum(np.abs(self.y), np.abs(end))
        asked = limits.rtol * self.scale
        if limits.atol is not None:
            asked = limits.atol + limits.rtol * size
        return np.maximum(SHARE * asked, EPS * size)

    def _error(self, h: float, end: Array) -> float:
        """Root mean square of the step's error over the tolerance."""
        errors = h * (self.pair.errors @ self.rates[: STAGES + 1]) / self._tolerance(end)
        first, second = np.mean(errors**2, axis=1).tolist()
        return float(first / np.sqrt(first + 0.01 * second)) if first > 0 else 0.0

    def _first_scale(self, scale: Array) -> Array:
        """Scale of the speeds: what the first accelerations reach in one unit of a coordinate."""
        found, speeds = scale.copy(), slice(self.width, None)
        reached = np.sqrt(self._accelerations() * scale[speeds])
        found[speeds] = np.maximum(self._speeds(), reached)
        largest = float((found[speeds] / scale[speeds]).max(initial=0.0))
        least = scale[speeds] * (1e-3 * largest if largest > 0 else 1.0)
        found[speeds] = np.maximum(found[speeds], least)
        return found

    def _accelerations(self) -> Array:
        """Their size at the start (nu,)."""
        return np.abs(self.rates[0, self.width :])

    def _speeds(self) -> Array:
        """Their size at the start (nu,)."""
        return np.abs(self.y[self.width :])

    def _first_step(self) -> float:
        """After Hairer, Norsett & Wanner (1993), section II.4."""
        span, most = abs(self.limits.t1 - self.t), self.limits.max_step
        tolerance = self._tolerance(self.y)
        state = float(np.sum((self.y / tolerance) ** 2))
        first = float(np.sum((self.rates[0] / tolerance) ** 2))
        guess = 1e-6 * span if min(state, first) < 1e-10 else 0.01 * (state / first) ** 0.5
        guess = min(guess, most, span)
        end = self.y + self.direction * guess * self.rates[0]
        if guess == 0 or self._stage(self.t + self.direction * guess, end, 1) != RUNNING:
            return 1e-3 * guess
        change = (self.rates[1] - self.rates[0]) / (guess * tolerance)
        largest = (max(first, float(np.sum(change**2))) / len(self.y)) ** 0.5
        step = max(1e-6 * span, 1e-3 * guess)
        if largest > 1e-15:
            step = (0.01 / largest) ** (1 / ORDER)
        return min(100 * guess, step, most)

    def _next_step(self) -> tuple[float, bool]:
        """The signed step to attempt, and whether it is the last."""
        left, step = self.limits.t1 - self.t, min(self.step, self.limits.max_step)
        if abs(left) <= 1.01 * step:
            return left, True
        return (0.5 * left if abs(left) < 2 * step else self.direction * step), False

    def advance(self, steps: int) -> int:
        """At most so many further attempted steps; returns the status code."""
        for _ in range(steps):
            if self.status != RUNNING:
                break
            if self.counts["steps"] + self.counts["rejected"] >= self.limits.max_steps:
                self.status = TOO_MANY_STEPS
            elif self.count * self._bytes_a_state() >= self.limits.max_bytes:
                self.status = MEMORY_LIMIT
            else:
                self.status = self._attempt()
        return self.status

    def _bytes_a_state(self) -> int:
        rows = DENSE_ROWS if self.limits.dense else 0
        return 8 * (1 + len(self.y) * (1 + rows))

    def _attempt(self) -> int:
        h, last = self._next_step()
        if abs(h) < 16 * EPS * max(abs(self.t), abs(self.limits.t1 - self.t)) and not last:
            return self._too_small()
        self.watch.begin_step()
        self.step = abs(h)
        status, end = self._rates(1, STAGES, h)
        if status != RUNNING:
            self.failure = status
            return self._refuse(0.3, last)
        self.watch.end_step()
        error = self._error(h, end)
        factor = SAFETY * error ** (-1 / ORDER) if error > 0 else MOST_GROWTH
        if not error <= 1.0:
            return self._refuse(max(LEAST_SHRINK, factor) if error > 1.0 else LEAST_SHRINK, last)
        if self.watch.may_hide_a_zero():
            return self._refuse(0.5, last)
        if self.watch.poor():
            return NEARLY_DEPENDENT
        return self._accept(h, end, factor, last)

    def _refuse(self, factor: float, last: bool) -> int:
        self.counts["rejected"] += 1
        self.refused = True
        if last and self.step < 16 * EPS * abs(self.t):
            return self._too_small()
        self.step *= factor
        return RUNNING

    def _too_small(self) -> int:
        if self.watch.fading():
            return NEARLY_DEPENDENT
        return self.failure or STEP_TOO_SMALL

    def _accept(self, h: float, end: Array, factor: float, last: bool) -> int:
        if self.limits.dense:
            status, _ = self._rates(STAGES + 1, RATES - 1, h)
            if status != RUNNING:
                return self._refuse(0.5, last)
            self._dense.append(self._dense_rows(h, end))
        self.t = self.limits.t1 if last else self.t + h
        self.y, self.rates[0] = end, self.rates[STAGES]
        self.step *= max(LEAST_SHRINK, min(1.0 if self.refused else MOST_GROWTH, factor))
        self.refused, self.failure = False, RUNNING
        speeds = slice(self.width, None)
        self.scale[speeds] = np.maximum(self.scale[speeds], np.abs(end[speeds]))
        self.watch.accept()
        self.counts["steps"] += 1
        self._times.append(self.t)
        self._ordered.append(self.direction * self.t)
        self._states.append(end.copy())
        return FINISHED if last else RUNNING

    # -- results -------------------------------------------------------------------------------

    def _dense_rows(self, h: float, end: Array) -> Array:
        rows = np.empty((DENSE_ROWS, len(end)))
        rows[0] = end - self.y
        rows[1] = h * self.rates[0] - rows[0]
        rows[2] = rows[0] - h * self.rates[STAGES] - rows[1]
        rows[3:] = h * (self.pair.dense @ self.rates)
        return rows

    @property
    def steps(self) -> NumpyRun:
        """Its own."""
        return self

    def ends(self) -> tuple[Array, Array]:
        """The first and last time (2,) and the states there (2, nq + nu)."""
        last = [0, -1]
        return np.array(self._times)[last], np.array(self._states)[last]

    @property
    def count(self) -> int:
        """Number of accepted states, the start included."""
        return len(self._times)

    def times(self, first: int) -> Array:
        """Accepted times from the index ``first`` on."""
        return np.array(self._times[first:])

    def states(self) -> tuple[Array, Array]:
        """Accepted times (nt,) and states (nt, nq + nu)."""
        return np.array(self._times), np.array(self._states)

    def tail(self, count: int) -> tuple[Array, Array]:
        """The last accepted times and states, at most so many."""
        return np.array(self._times[-count:]), np.array(self._states[-count:])

    def change_points(self) -> tuple[Array, Array, Array]:
        """Always empty."""
        return np.zeros(0), np.zeros((0, self.width)), np.zeros(0)

    def stats(self) -> dict[str, Any]:
        """Counters and the least conditioning met."""
        return {
            **self.counts, "least_singular": self.watch.least_met,
            "least_singular_time": self.watch.least_time, "coordinate": self.speed, "examined": 0,
            "critical_gap": np.inf, "critical_time": 0.0, "rounding": 0.0,
        }  # fmt: skip

    def interpolate(self, t: Array) -> Array:
        """Dense output at the times t, projected onto the constraints: (len(t), nq + nu)."""
        if self.count == 1 or not len(t):
            return np.repeat(self._states[0][None], len(t), axis=0)
        found = [bisect_right(self._ordered, x) - 1 for x in (self.direction * t).tolist()]
        steps = [min(max(i, 0), self.count - 2) for i in found]
        starts = np.array([self._times[i] for i in steps])
        ends = np.array([self._times[i + 1] for i in steps])
        states, rows = (np.array([kept[i] for i in steps]) for kept in (self._states, self._dense))
        s = ((t - starts) / (ends - starts))[:, None]
        settled, closed = self.whole.settle(t, states + dense_output(rows, s))
        settled[closed.status != RUNNING] = np.nan
        return np.asarray(np.where(s == 0.0, states, settled))


def dense_output(rows: Array, s: Array) -> Array:
    """What is added to the starts of steps with these rows (n, 7, nq + nu) at the parts s (n, 1)
    of them."""
    out = np.zeros((len(rows), rows.shape[2]))
    for row in reversed(range(DENSE_ROWS)):
        out = (1 - s if row % 2 else s) * (out + rows[:, row])
    return out
