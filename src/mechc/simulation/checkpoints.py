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
    """A state of the integrator before step number ``step``; ``crossed``: change points before."""

    step: int
    t: float
    y: Array
    crossed: int
    saved: Any


class CheckpointedRun:
    """A run with checkpoints, over one that has begun.

    Checkpoints are multiples of 64 steps apart: what compiled code computes of several steps at
    once it computes of the same ones, whether or not a run is in parts.
    """

    def __init__(self, run: Any, max_bytes: float) -> None:
        self._run, self._max_bytes = run, max_bytes
        self._length = GROUP  # steps between two checkpoints
        self._step_count, self._bytes = 0, 0
        self._open = -1  # the part that the run holds now
        self._crossed = run.steps.change_points()
        self._points: list[Checkpoint] = []
        self._note()
        self._add()

    def _note(self) -> None:
        """Store the status, the last state and the statistics of the run on its way forwards."""
        self._status, self._t = int(self._run.status), float(self._run.t)
        self._last: Array = self._run.steps.ends()[1][1]
        self._stats = dict(self._run.stats())

    def _add(self) -> None:
        point = Checkpoint(
            self._step_count, self._t, self._last, len(self._crossed[0]), self._run.checkpoint()
        )
        self._points.append(point)
        self._bytes += size_of(point)

    # -- forwards ----------------------------------------------------------------------------

    def advance(self, steps: int) -> int:
        """Attempt at most so many steps."""
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
        """Count the steps that the run holds, then drop them."""
        self._note()
        self._step_count += self._run.count - 1
        steps = self._run.steps
        if steps.crossings:
            both = zip(self._crossed, steps.change_points(), strict=True)
            self._crossed = tuple(np.concatenate(each) for each in both)
        self._run.keep_last()

    def _keep(self) -> None:
        """Add a checkpoint where one is due."""
        if self._status == RUNNING and self._step_count % self._length == 0:
            self._add()
            while self._bytes > SHARE * self._max_bytes and self._status == RUNNING:
                self._thin()

    def _thin(self) -> None:
        """Keep every second checkpoint, if there is room for the steps between two of them."""
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

    def stats(self) -> dict[str, Any]:
        return dict(self._stats)

    @property
    def pieces(self) -> list[tuple[Any, ...]]:
        """Pieces as :class:`mechc.native._motion.Motion` has them, one between two checkpoints."""
        p = self._run.request.p
        count = len(self._points)
        return [(RunPart(self, number), p, False, (), (), None) for number in range(count)]

    def ends(self, number: int) -> tuple[Array, Array]:
        """The first and last time of a part (2,) and the states there (2, nq + nu)."""
        begin, last = self._points[number], number + 1 == len(self._points)
        end = (self._t, self._last) if last else self._points[number + 1][1:3]
        return np.array([begin.t, end[0]]), np.stack([begin.y, end[1]])

    def change_points_of(self, number: int) -> tuple[Array, Array, Array]:
        """The change points crossed in a part."""
        first, after = self._points[number].crossed, self._points[number + 1 : number + 2]
        last = after[0].crossed if after else None
        t, q, gap = (each[first:last] for each in self._crossed)
        return t, q, gap

    def open(self, number: int) -> Any:
        """The steps of one part; they hold until the next part is asked for.

        Raises
        ------
        MechcError
            Where the motion is not the same again: of inputs that depend on more than their
            arguments.
        """
        if self._open != number:
            self._repeat(number)
        return self._run.steps

    def _repeat(self, number: int) -> None:
        run, begin = self._run, self._points[number]
        last = number + 1 == len(self._points)
        step, t = (self._step_count, self._t) if last else self._points[number + 1][:2]
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


class RunPart:
    """The steps of a part between two checkpoints, as :class:`mechc.simulation.record.Steps`.

    All but their ends is computed again when it is read.
    """

    def __init__(
        self, run: CheckpointedRun, number: int, reader: tuple[Any, Any] | None = None
    ) -> None:
        self._run, self._number, self._reader = run, number, reader

    def __getattr__(self, name: str) -> Any:
        steps = self._run.open(self._number)
        return getattr(steps if self._reader is None else steps.read_by(*self._reader), name)

    def read_by(self, scene: Any, inputs: Any) -> RunPart:
        """This part, read by the functions of another scene of the same mechanism."""
        return RunPart(self._run, self._number, (scene, inputs))

    def ends(self) -> tuple[Array, Array]:
        """The first and last time (2,) and the states there (2, nq + nu)."""
        return self._run.ends(self._number)

    @property
    def span(self) -> tuple[float, float]:
        """The first and last time."""
        first, last = self.ends()[0].tolist()
        return first, last

    @property
    def crossings(self) -> int:
        return len(self.change_points()[0])

    def change_points(self) -> tuple[Array, Array, Array]:
        """The change points crossed in the part."""
        return self._run.change_points_of(self._number)


def size_of(point: Checkpoint) -> int:
    """Bytes of a checkpoint."""
    return int(point.saved[0].nbytes)
