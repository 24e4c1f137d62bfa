"""Events and resets that are compiled, looked for and applied along a run of compiled code.

The same search and the same rules as those of functions of Python
(:mod:`mechc.simulation.events.event`, :mod:`mechc.simulation.events.resets`), with exact rates of
the events; batches use this code too.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from mechc.native._codes import METHODS, RESETS_ACCUMULATE, RUNNING
from mechc.native._events import Watch
from mechc.native._run import Run
from mechc.simulation.chain import Chain
from mechc.simulation.events.event import Event, EventFinder, FunctionFailedError, Side
from mechc.simulation.events.expressions import compiled_functions
from mechc.simulation.events.resets import Resets
from mechc.simulation.settings import Policy
from mechc.system.parameters import Array
from mechc.system.system import System


def compiled_finder(
    events: Sequence[Any], system: System, chain: Chain, span: tuple[float, float], values: Array,
    policy: Policy,
) -> CompiledFinder | None:  # fmt: skip
    """What looks for compiled events in the last run; None where they are not compiled, or it is
    not one of compiled code."""
    functions = compiled_functions(events)
    if functions is None or not may_compile(chain):
        return None
    return CompiledFinder(events, functions, system, chain.last, span, values, policy)


def may_compile(chain: Chain) -> bool:
    """Whether the last run is one of compiled code."""
    return isinstance(_compiled(chain.last), Run)


def _compiled(part: Any) -> Any:
    """The compiled run of a part; one with inputs restarts at their kinks."""
    return getattr(part, "compiled_run", part)


def directions_of(events: Sequence[Event]) -> tuple[Array, Array]:
    """The directions of events (k,), and how many zeros of each end a run (k,), 0 for none."""
    directions = np.array([float(event.direction) for event in events])
    return directions, np.array([int(event.terminal) for event in events], np.int_)


class CompiledFinder(EventFinder):
    """An :class:`EventFinder` that searches in compiled code."""

    steps = 6  # as in a batch: counters are then equal too

    def __init__(
        self, events: Sequence[Any], functions: Any, system: System, run: Any,
        span: tuple[float, float], values: Array, policy: Policy,
    ) -> None:  # fmt: skip
        directions, terminal = directions_of(events)
        self.watch = Watch(
            _compiled(run), functions, directions, terminal, values, system.scale(values),
            policy.rtol, *span, METHODS[policy.method], getattr(run, "whole", None),
        )  # fmt: skip
        super().__init__(events, run, system.scene.width, policy.rtol)

    def enter(self, run: Any, sides: Sequence[Side] | None = None) -> None:
        """Go on in a run, from its start."""
        t, y = run.steps.ends()
        self.run, self.looked_at, self.found = run.steps, 0, [[] for _ in self.events]
        self.watch.enter(_compiled(run), float(t[0]), y[0])

    def look(self) -> float | None:
        try:
            stop: float | None = self.watch.look()
        except ArithmeticError as error:
            raise FunctionFailedError(f"the value of an event has failed: {error}") from None
        for number, t in self.watch.zeros():
            self.found[number].append(t)
        self.stopped_by = self.watch.stopped_by
        return stop

    def notes(self) -> tuple[str, ...]:
        for number, (grazing, too_fast) in enumerate(self.watch.notes()):
            if not math.isnan(grazing):
                self.grazing[number] = grazing
            if not math.isnan(too_fast):
                self.too_fast[number] = too_fast
        return super().notes()


class CompiledResets(Resets):
    """:class:`Resets` of compiled code."""

    finder: CompiledFinder

    def _sides(self, t: float, state: Array) -> list[Side]:
        return []  # compiled code has them when the motion is entered

    def _reset(self, t: float, state: Array, number: int) -> tuple[Array, bool]:
        code, after, causes, before = self.finder.watch.reset(t, state)
        if code not in (RUNNING, RESETS_ACCUMULATE):
            raise FunctionFailedError(
                f"the reset of event {causes[-1]} at t = {t:.9g} s gives a state that is not "
                "finite, or does not close the loops"
            )
        for number, at in zip(causes[1:], before[1:], strict=True):
            self.finder.add(number, t, at)
        self.caused_by = list(causes)
        return after, code == RESETS_ACCUMULATE
