"""A run that restarts at every kink or jump of its inputs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from mechc.native._codes import FINISHED, RUNNING
from mechc.system.parameters import Array


class SegmentedRun:
    """A compiled run over ``times[-1] - times[0]``, in which no step crosses an inner time.

    It is one run, extended from segment to segment with the inputs of each: ``inputs(k, y)``
    between ``times[k]``, where the state is y, and ``times[k + 1]``; ``whole`` for reading from it.
    """

    def __init__(
        self, run: Any, times: Sequence[float], inputs: Callable[[int, Array], Any], whole: Any
    ) -> None:
        self._run, self._times, self._inputs, self._whole = run, times, inputs, whole
        self._segment = -1
        run.read_with(whole)
        if len(times) > 2:
            self._next()

    def _next(self) -> None:
        self._segment += 1
        _, y = self._run.tail(1)
        inputs = self._inputs(self._segment, y[-1])
        self._run.extend(self._times[self._segment + 1], inputs)

    @property
    def _last(self) -> bool:
        return self._segment < 0 or self._segment == len(self._times) - 2

    @property
    def status(self) -> int:
        code = int(self._run.status)
        return RUNNING if code == FINISHED and not self._last else code

    @property
    def t(self) -> float:
        return float(self._run.t)

    @property
    def count(self) -> int:
        return int(self._run.count)

    @property
    def crossings(self) -> int:
        return int(self._run.crossings)

    def advance(self, steps: int) -> int:
        """At most so many attempted steps."""
        left = steps
        while left > 0 and self.status == RUNNING:
            if self._run.status == FINISHED:
                self._next()
            before = self._run.count
            self._run.advance(left)
            left -= max(self._run.count - before, 1) if self._run.status == FINISHED else left
        return self.status

    def stats(self) -> dict[str, Any]:
        return dict(self._run.stats())

    def states(self) -> tuple[Array, Array]:
        t, y = self._run.states()
        return t, y

    def tail(self, count: int) -> tuple[Array, Array]:
        t, y = self._run.tail(count)
        return t, y

    def times(self, first: int) -> Array:
        found: Array = self._run.times(first)
        return found

    def methods(self) -> Array:
        found: Array = self._run.methods()
        return found

    def vary(
        self,
        first: int,
        last: int,
        directions: Array,
        start: Array,
        rates: int = 0,
        restart: bool = False,
        project: bool = False,
        shapes: Any = None,
    ) -> tuple[Array, Array]:
        ends, taken = self._run.vary(
            first, last, directions, start, rates, restart, project, shapes
        )
        return ends, taken

    def covary(
        self, first: int, last: int, covector: Array, sources: Array | None = None,
        shapes: Any = None,
    ) -> tuple[Array, Array]:  # fmt: skip
        at, gradient = self._run.covary(first, last, covector, sources, shapes)
        return at, gradient

    def project_columns(
        self, t: Array, y: Array, directions: Array, columns: Array, shapes: Any = None
    ) -> None:
        self._run.project_columns(t, y, directions, columns, shapes)

    def change_points(self) -> tuple[Array, Array, Array]:
        t, q, gap = self._run.change_points()
        return t, q, gap

    def interpolate(self, t: Array) -> Array:
        found: Array = self._run.interpolate(t)
        return found
