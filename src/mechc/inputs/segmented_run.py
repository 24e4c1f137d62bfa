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
        if len(times) > 2:
            self._next()

    def _next(self) -> None:
        self._segment += 1
        inputs = self._inputs(self._segment, self.compiled_run.state())
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
    def met_critical(self) -> bool:
        return bool(self.compiled_run.met_critical)

    @property
    def steps(self) -> Any:
        """What it has recorded, read with the inputs of the whole span."""
        steps = self.compiled_run.steps
        steps.read_with(self.whole)
        return steps

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
