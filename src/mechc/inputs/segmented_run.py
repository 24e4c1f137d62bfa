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
    ``stops``: :meth:`advance` ends with each segment, so that what follows it, as the call of a
    controller, comes after a search for events in it.

    Attributes
    ----------
    compiled_run, whole
        The run, and the inputs of the whole span.
    """

    def __init__(
        self, run: Any, times: Sequence[float], inputs: Callable[[int, Array], Any], whole: Any,
        stops: bool = False,
    ) -> None:  # fmt: skip
        self.compiled_run, self._times, self._inputs, self.whole = run, times, inputs, whole
        self._segment, self._stops = -1, stops
        run.read_with(whole)
        if len(times) > 2:
            self._next()

    def _next(self) -> None:
        self._segment += 1
        _, y = self.compiled_run.tail(1)
        inputs = self._inputs(self._segment, y[-1])
        self.compiled_run.extend(self._times[self._segment + 1], inputs)

    @property
    def _last(self) -> bool:
        return self._segment < 0 or self._segment == len(self._times) - 2

    @property
    def status(self) -> int:
        code = int(self.compiled_run.status)
        return RUNNING if code == FINISHED and not self._last else code

    @property
    def t(self) -> float:
        return float(self.compiled_run.t)

    @property
    def count(self) -> int:
        return int(self.compiled_run.count)

    @property
    def crossings(self) -> int:
        return int(self.compiled_run.crossings)

    def advance(self, steps: int) -> int:
        """At most so many attempted steps."""
        left = steps
        while left > 0 and self.status == RUNNING:
            if self.compiled_run.status == FINISHED:
                self._next()
            before = self.compiled_run.count
            self.compiled_run.advance(left)
            left -= (
                max(self.compiled_run.count - before, 1)
                if self.compiled_run.status == FINISHED
                else left
            )
            if self._stops:
                break
        return self.status

    def keep_last(self) -> None:
        self.compiled_run.keep_last()

    def checkpoint(self) -> tuple[Any, ...]:
        return (*self.compiled_run.checkpoint(), self._segment)

    def back_to(self, checkpoint: tuple[Any, ...]) -> None:
        *saved, self._segment = checkpoint
        self.compiled_run.back_to(saved)

    @property
    def bytes_a_step(self) -> int:
        return int(self.compiled_run.bytes_a_step)

    def stats(self) -> dict[str, Any]:
        return dict(self.compiled_run.stats())

    def states(self) -> tuple[Array, Array]:
        t, y = self.compiled_run.states()
        return t, y

    def tail(self, count: int) -> tuple[Array, Array]:
        t, y = self.compiled_run.tail(count)
        return t, y

    def times(self, first: int) -> Array:
        found: Array = self.compiled_run.times(first)
        return found

    def methods(self) -> Array:
        found: Array = self.compiled_run.methods()
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
        ends, taken = self.compiled_run.vary(
            first, last, directions, start, rates, restart, project, shapes
        )
        return ends, taken

    def covary(
        self, first: int, last: int, covector: Array, sources: Array | None = None,
        shapes: Any = None, gathered: Array | None = None,
    ) -> tuple[Array, Array]:  # fmt: skip
        at, gradient = self.compiled_run.covary(first, last, covector, sources, shapes, gathered)
        return at, gradient

    def project_columns(
        self, t: Array, y: Array, directions: Array, columns: Array, shapes: Any = None
    ) -> None:
        self.compiled_run.project_columns(t, y, directions, columns, shapes)

    def change_points(self) -> tuple[Array, Array, Array]:
        t, q, gap = self.compiled_run.change_points()
        return t, q, gap

    def interpolate(self, t: Array) -> Array:
        found: Array = self.compiled_run.interpolate(t)
        return found
