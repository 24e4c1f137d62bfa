"""A run that keeps states of the integrator in place of its trajectory, within a bound of memory.

What lies between two checkpoints is computed again when it is asked for, to the last bit.  Where
the checkpoints take too much room every second one is dropped: the memory that a run of n steps
needs is in proportion to the root of n, at the cost of a second run.  Griewank & Walther (2000),
ACM TOMS 26, 19-45, have the general case.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from mechc.errors import MechcError
from mechc.native._codes import MEMORY_LIMIT, RUNNING
from mechc.system.parameters import Array

GROUP = 64  # steps that are computed without a checkpoint between them
SHARE = 0.5  # of the memory, for the checkpoints; the rest for the steps between two of them


class Checkpoint(NamedTuple):
    """A state of the integrator before step number ``step``."""

    step: int
    t: float
    saved: Any


class Checkpointed:
    """A run as :class:`mechc.simulation.segments.Segment` has it, over one that has begun.

    Checkpoints are multiples of 64 steps apart: what compiled code computes of several steps at
    once it computes of the same ones, whether or not a run is in parts.
    """

    def __init__(self, run: Any, max_bytes: float) -> None:
        self._run, self._max_bytes = run, max_bytes
        self._points = [Checkpoint(0, float(run.t), run.checkpoint())]
        self._bytes = size_of(self._points[0])
        self._length = GROUP  # steps between two checkpoints
        self._steps = 0
        self._open = -1  # the part that the run holds now
        self.first_state: Array = run.states()[1][0]
        self._crossed: list[tuple[Array, Array, Array]] = []
        self._note()

    def _note(self) -> None:
        """What the run tells on its way forwards."""
        self._status, self._t = int(self._run.status), float(self._run.t)
        self._last: Array = self._run.tail(1)[1][0]
        self._stats = dict(self._run.stats())

    # -- forwards ----------------------------------------------------------------------------

    def advance(self, steps: int) -> int:
        """At most so many attempted steps."""
        left = steps
        while left > 0 and self._status == RUNNING:
            made = min(left, GROUP - (self._run.count - 1))
            left -= made
            try:
                self._run.advance(made)
            except KeyboardInterrupt:
                self._take()
                raise
            self._note()
            if self._run.count - 1 == GROUP or self._status != RUNNING:
                self._take()
                self._keep()
        return self._status

    def _take(self) -> None:
        """The steps that the run holds are counted, and forgotten."""
        self._note()
        self._steps += self._run.count - 1
        if self._run.crossings:
            self._crossed.append(self._run.change_points())
        self._run.keep_last()

    def _keep(self) -> None:
        """A checkpoint, where one is due."""
        if self._status == RUNNING and self._steps % self._length == 0:
            self._points.append(Checkpoint(self._steps, self._t, self._run.checkpoint()))
            self._bytes += size_of(self._points[-1])
            while self._bytes > SHARE * self._max_bytes and self._status == RUNNING:
                self._thin()

    def _thin(self) -> None:
        """Every second checkpoint alone, as far as the steps between two of them have room."""
        if 2 * self._length * self._run.bytes_a_step > (1.0 - SHARE) * self._max_bytes:
            self._status = MEMORY_LIMIT
            return
        self._points, self._length = self._points[::2], 2 * self._length
        self._bytes = sum(size_of(point) for point in self._points)

    # -- what was passed ---------------------------------------------------------------------

    @property
    def status(self) -> int:
        return self._status

    @property
    def t(self) -> float:
        return self._t

    @property
    def count(self) -> int:
        return self._steps + 1 + (self._run.count - 1 if self._status == RUNNING else 0)

    @property
    def crossings(self) -> int:
        return sum(len(times) for times, _, _ in self._crossed)

    def stats(self) -> dict[str, Any]:
        return dict(self._stats)

    def change_points(self) -> tuple[Array, Array, Array]:
        none = tuple(part[:0] for part in self._run.change_points())
        parts = self._crossed or [none]
        t, q, gap = (np.concatenate(part) for part in zip(*parts, strict=True))
        return t, q, gap

    @property
    def span(self) -> Array:
        """Its first and last time (2,)."""
        return np.array([self._points[0].t, self._t])

    @property
    def parts(self) -> int:
        """How many parts there are between checkpoints."""
        return len(self._points)

    def part(self, number: int) -> Any:
        """The run with the steps of one part alone; it holds until the next part is asked for.

        Raises
        ------
        MechcError
            Where the motion is not the same again: of inputs that depend on more than their
            arguments.
        """
        number = number % len(self._points)
        if self._open != number:
            self._repeat(number)
        return self._run

    def _repeat(self, number: int) -> None:
        run, begin = self._run, self._points[number]
        last = number + 1 == len(self._points)
        step, t = (self._steps, self._t) if last else self._points[number + 1][:2]
        run.back_to(begin.saved)
        self._open = -1
        while run.count - 1 < step - begin.step and run.status == RUNNING:
            run.advance(step - begin.step - (run.count - 1))
        if run.count - 1 != step - begin.step or run.t != t:
            raise MechcError(
                f"the motion between {begin.t:.9g} and {t:.9g} s is another one when it is "
                "computed again: inputs have to be functions of their arguments alone"
            )
        self._open = number

    # -- its trajectory ----------------------------------------------------------------------

    def states(self) -> tuple[Array, Array]:
        parts = [self.part(k).states() for k in range(self.parts)]
        cut = [int(k > 0) for k in range(self.parts)]
        t = np.concatenate([times[n:] for (times, _), n in zip(parts, cut, strict=True)])
        return t, np.vstack([states[n:] for (_, states), n in zip(parts, cut, strict=True)])

    def times(self, first: int) -> Array:
        """Accepted times from the index ``first`` on."""
        parts = [self.part(k).times(int(k > 0)) for k in range(self.parts)]
        return np.concatenate(parts)[first:]

    def tail(self, count: int) -> tuple[Array, Array]:
        """The last accepted times and states, at most so many."""
        if count == 1:
            return np.array([self._t]), self._last[None]
        number = self.parts - 1
        while number > 0 and self._steps + 1 - self._points[number].step < count:
            number -= 1
        t, y = self.part(number).states()
        for k in range(number + 1, self.parts):
            more = self.part(k).states()
            t, y = np.append(t, more[0][1:]), np.vstack([y, more[1][1:]])
        return t[-count:], y[-count:]

    def interpolate(self, t: Array) -> Array:
        """Dense output at the times t, projected onto the constraints: (len(t), width)."""
        forwards = 1.0 if self._t >= self._points[0].t else -1.0
        starts = np.array([forwards * point.t for point in self._points[1:]])
        numbers = np.searchsorted(starts, forwards * t, side="right")
        found = [
            (own := np.flatnonzero(numbers == k), self.part(k).interpolate(t[own]))
            for k in np.unique(numbers)
        ]
        if not found:
            return np.asarray(self.part(0).interpolate(t))
        out = np.empty((len(t), found[0][1].shape[1]))
        for own, rows in found:
            out[own] = rows
        return out


def size_of(point: Checkpoint) -> int:
    """Bytes of a checkpoint."""
    return int(point.saved[0].nbytes)


def with_checkpoints(run: Any, max_bytes: float) -> Checkpointed:
    """A run that has begun, from now on with checkpoints.

    Raises
    ------
    MechcError
        For one that cannot have them.
    """
    if not hasattr(run, "checkpoint"):
        raise MechcError(
            "runs that begin at a change point, and those without compiled code, keep no "
            "checkpoints: leave checkpoints= away"
        )
    return Checkpointed(run, max_bytes)


def ends_of(run: Any) -> tuple[Array, Array]:
    """The first and the last time of a run (2,) and its states there (2, nq + nu)."""
    if isinstance(run, Checkpointed):
        return run.span, np.stack([run.first_state, run.tail(1)[1][0]])
    t, y = run.states()
    return t[[0, -1][: len(t)]], y[[0, -1][: len(t)]]
