"""Events: zeros of functions of time and state, found on the dense output."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from mechc.errors import ValueOutOfBoundsError
from mechc.system.parameters import Array

SAMPLES = 16  # a step; where the function only comes near zero, the dip itself is looked at too
EventFunction = Callable[[float, Array], float]


@dataclass(frozen=True)
class Event:
    """A zero of ``function(t, y)`` to be found.

    Attributes
    ----------
    direction
        Positive: only where the function grows; negative: only where it falls; 0: both.
    terminal
        The run ends at the first such zero, or at the n-th for a whole number n.
    """

    function: EventFunction
    direction: float = 0.0
    terminal: bool | int = False

    @classmethod
    def of(cls, given: Any) -> Event:
        """From an Event, or a function that carries SciPy's attributes.

        Raises
        ------
        ValueOutOfBoundsError
            If it cannot be called.
        """
        if isinstance(given, cls):
            return given
        if not callable(given):
            raise ValueOutOfBoundsError(f"an event is a function of t and y, not {given!r}")
        return cls(given, getattr(given, "direction", 0.0), int(getattr(given, "terminal", False)))


@dataclass(frozen=True)
class EventRecord:
    """The zeros of one event: times ``t`` (k,) in s and states ``y`` (k, nq + nu)."""

    t: Array
    y: Array


class EventFinder:
    """Looks through a run's new steps for zeros."""

    def __init__(self, events: Sequence[Any], run: Any, width: int, first: int = 0) -> None:
        self.events = [Event.of(event) for event in events]
        self.found: list[list[float]] = [[] for _ in self.events]
        self.run, self.width = run, width
        self.looked_at = first
        self.start = float(run.times(first)[0])
        self.failure: FunctionFailedError | None = None

    def look(self) -> float | None:
        """Search the steps added since the last look; the time of a terminal event, if any."""
        for start, end in pairwise(self.run.times(self.looked_at).tolist()):
            stop = self._search(start, end)
            if stop is not None:
                return stop
            self.looked_at += 1
        return None

    def records(self) -> tuple[EventRecord, ...]:
        """What was found, in the order of the events."""
        return tuple(self._record(np.array(times)) for times in self.found)

    def _record(self, times: Array) -> EventRecord:
        if not len(times):
            return EventRecord(np.zeros(0), np.zeros((0, self.width)))
        return EventRecord(times, self.run.interpolate(times))

    def _search(self, start: float, end: float) -> float | None:
        """All zeros within one step; what comes after a terminal one did not happen."""
        grid = np.linspace(start, end, SAMPLES + 1)
        states = self.run.interpolate(grid)
        roots = [self._zeros(event, grid, states) for event in self.events]
        forwards = end > start
        stops = [
            times[int(event.terminal) - len(found) - 1]
            for event, found, times in zip(self.events, self.found, roots, strict=True)
            if event.terminal and len(found) + len(times) >= event.terminal
        ]
        stop = (min if forwards else max)(stops, default=None)
        for found, times in zip(self.found, roots, strict=True):
            found += [t for t in times if stop is None or (t <= stop) == forwards or t == stop]
        return stop

    def _zeros(self, event: Event, grid: Array, states: Array) -> list[float]:
        points = [(t, _evaluated(event, t, y)) for t, y in zip(grid.tolist(), states, strict=True)]
        points = sorted(points + self._dips(event, points), reverse=bool(grid[-1] < grid[0]))
        roots = []
        for (t0, before), (t1, after) in pairwise(points):
            crossed = before != 0 and (after == 0 or (before < 0) != (after < 0))
            if crossed and event.direction * (after - before) >= 0:
                roots.append(self._refine(event, t0, t1, before))
        # what ended the run that this one continues is not found again
        return [t for t in roots if abs(t - self.start) > located(t)]

    def _dips(self, event: Event, points: list[tuple[float, float]]) -> list[tuple[float, float]]:
        """Where three samples of one sign dip towards zero: the vertex of their parabola."""
        found = []
        for (t0, a), (t1, b), (t2, c) in zip(points, points[1:], points[2:], strict=False):
            if min(a * b, b * c) > 0 and abs(b) <= min(abs(a), abs(c)) and a - 2 * b + c != 0:
                vertex = t1 + 0.25 * (t2 - t0) * (a - c) / (a - 2 * b + c)
                found.append((vertex, self._value(event, vertex)))
        return found

    def _refine(self, event: Event, low: float, high: float, before: float) -> float:
        """Secant steps kept inside a bracket that is halved at least every third step."""
        target = 0.5 * located(max(abs(low), abs(high)))
        f_low, f_high = before, self._value(event, high)
        for attempt in range(300):
            if abs(high - low) <= target or f_high == 0:
                break
            middle = 0.5 * (low + high)
            if attempt % 3:
                secant = high - f_high * (high - low) / (f_high - f_low)
                # a hair past the secant's root, so that the bracket closes from both sides
                secant += math.copysign(0.45 * target, middle - secant)
                middle = secant if min(low, high) < secant < max(low, high) else middle
            f_middle = self._value(event, middle)
            if f_middle == 0 or (f_middle < 0) != (f_low < 0):
                high, f_high = middle, f_middle
            else:
                low, f_low = middle, f_middle
        return float(high)

    def _value(self, event: Event, t: float) -> float:
        return _evaluated(event, t, self.run.interpolate(np.array([t]))[0])


def located(t: float) -> float:
    """How exactly a zero near t is located, s."""
    return max(2e-13, 4 * math.ulp(t))


class FunctionFailedError(Exception):
    """An event function raised ``__cause__``, or gave no number; internal."""


def _evaluated(event: Event, t: float, y: Array) -> float:
    name = getattr(event.function, "__name__", repr(event.function))
    try:
        value = float(event.function(t, y))
    except Exception as error:
        raise FunctionFailedError(
            f"the event function {name} failed at t = {t:.9g} s with "
            f"{type(error).__name__}: {error}"
        ) from error
    if math.isnan(value):
        raise FunctionFailedError(f"the event function {name} gave NaN at t = {t:.9g} s")
    return value
