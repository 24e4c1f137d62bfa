"""Events: zeros of functions of time and state, found on the dense output."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from mechc.errors import ValueOutOfBoundsError
from mechc.system.parameters import Array

SAMPLES = 16  # a step, at least; a function that changes faster is sampled more often
MOST_SAMPLES = 4096  # a step
BENT = 0.1  # of all change over a step: a sample farther off the chord beside it is coarse
COARSE = 0.25  # of the samples: where more are, the function changes faster than it is sampled
# Fractions of a step, all unevenly spaced: a function in step with even samples would seem slow.
_NUMBERS = np.arange(SAMPLES + 1)
FRACTIONS = (_NUMBERS + 0.8 * ((_NUMBERS**2 * math.sqrt(2.0)) % 1.0 - 0.5)) / SAMPLES
FRACTIONS[0], FRACTIONS[-1] = 0.0, 1.0
EventFunction = Callable[[float, Array], float]
Reset = Callable[[float, Array, Array], tuple[Any, Any]]
SMALLEST = 5e-324
GRAZES = 10.0  # times rtol of an event's largest value: a touch so small may not be one


@dataclass(frozen=True)
class Event:
    """A zero of ``function(t, y)`` to be found.

    Attributes
    ----------
    function
        A function of t and y (nq + nu,), or an expression of time, coordinates, speeds and
        parameters: of SymPy, or a text of the grammar, ``"q - l/2"``; also with a direction,
        ``"q > l/2"``.
    direction
        Positive: only where the function grows; negative: only where it falls; 0: both.
    terminal
        The run ends at the first such zero, or at the n-th for a whole number n; with a reset,
        after it.
    reset
        ``f(t, q, u)`` that returns new coordinates (nq,) and speeds (nu,), with which the motion
        continues.  They are put onto the constraints: coordinates to the nearest that close the
        loops, speeds by the impulse of the constraints through the mass matrix.  A reset that
        leaves the rate of the function with its sign is a switch: the zero is not found again.
        It may return names of coordinates, speeds and parameters with their values after the event
        instead; all others stay.  Or a mapping of names to expressions of what was before,
        ``{"u": "-e*u"}``.  Where all events of a run and their resets are expressions, and none
        changes parameters, they run in compiled code, in batches too.
    """

    function: EventFunction | Any
    direction: float = 0.0
    terminal: bool | int = False
    reset: Reset | Any = None

    def with_values(self, p: Array) -> Event:
        """The same event where the parameters of its expressions are p (np,)."""
        function, reset = (getattr(x, "with_values", None) for x in (self.function, self.reset))
        return replace(
            self, function=function(p) if function else self.function,
            reset=reset(p) if reset else self.reset,
        )  # fmt: skip

    @classmethod
    def of(cls, given: Any) -> Event:
        """From an Event, or a function with SciPy's attributes.

        Raises
        ------
        ValueOutOfBoundsError
            If it is not callable.
        """
        if isinstance(given, cls):
            if not (given.reset is None or callable(given.reset)):
                raise ValueOutOfBoundsError(
                    "a reset is a function of t, q and u that returns q and u, or a mapping of "
                    f"coordinates and speeds to expressions, not {given.reset!r}"
                )
            return given
        if not callable(given):
            raise ValueOutOfBoundsError(
                f"an event is a function of t and y, or an expression of SymPy that is zero there, "
                f"not {given!r}"
            )
        return cls(given, getattr(given, "direction", 0.0), int(getattr(given, "terminal", False)))


@dataclass(frozen=True)
class EventRecord:
    """The zeros of one event: times ``t`` (k,) in s and states ``y`` (k, nq + nu)."""

    t: Array
    y: Array


def event_titles(events: Sequence[Any]) -> tuple[str, ...]:
    """What each event is called: its expression, the name of its function, or its number."""
    return tuple(_title(event, number) for number, event in enumerate(events))


def _title(event: Any, number: int) -> str:
    function = event.function if isinstance(event, Event) else event
    given = getattr(function, "title", "") or getattr(function, "__name__", "")
    return given if given not in ("", "<lambda>", "expression") else f"event {number}"


class Side(NamedTuple):
    """How an event begins that is zero at the start of a motion.

    ``sign``: that of its value right after, 0 where it is not zero; ``near``: so long its value may
    be rounding, s.
    """

    sign: float = 0.0
    near: float = 0.0


class EventFinder:
    """Searches a run's new steps for zeros.

    Attributes
    ----------
    stopped_by
        The number of the event that ended the search.
    sizes
        The largest magnitude of each event's function met so far.
    lowered
        Impacts at which less than the whole restitution counted: times, and the part that did.
    """

    steps = 50  # attempted between two searches

    def __init__(self, events: Sequence[Any], run: Any, width: int, rtol: float = 0.0) -> None:
        self.events = [Event.of(event) for event in events]
        self.width, self.rtol = width, rtol
        self.kept: list[list[tuple[Array, Array]]] = [[] for _ in self.events]
        self.sizes = [0.0] * len(self.events)
        self.stopped_by = -1
        self.lowered: list[tuple[float, float]] = []
        self.grazing: dict[int, float] = {}  # event: the first time that it may only touch zero
        self.enter(run)
        self.failure: FunctionFailedError | None = None
        self.too_fast: dict[int, float] = {}  # event: time from which it changes too fast to follow

    def enter(self, run: Any, sides: Sequence[Side] | None = None) -> None:
        """Go on in a run from its start.

        ``sides``: of each event whether it is zero there, and what it is right after.
        """
        self.run, self.looked_at, self.sides = getattr(run, "steps", run), 0, sides
        self.found: list[list[float]] = [[] for _ in self.events]
        self.start = float(self.run.times(0)[0])

    def take_values(self, p: Array) -> None:
        """From here on the parameters are p (np,)."""
        self.events = [event.with_values(p) for event in self.events]

    def keep(self) -> None:
        """Read the states of the zeros found in the present run."""
        for kept, times in zip(self.kept, self.found, strict=True):
            if times:
                kept.append((np.array(times), self.run.interpolate(np.array(times))))
        self.found = [[] for _ in self.events]

    def add(self, number: int, t: float, state: Array) -> None:
        """A zero that was found otherwise."""
        self.kept[number].append((np.array([t]), state[None]))

    def count(self, number: int) -> int:
        """How many zeros of an event were found."""
        return len(self.found[number]) + sum(len(times) for times, _ in self.kept[number])

    def look(self) -> float | None:
        """Search the steps added since the last search; the time of a terminal event, if any."""
        for start, end in pairwise(self.run.times(self.looked_at).tolist()):
            stop = self._search(start, end)
            if stop is not None:
                return stop
            self.looked_at += 1
        return None

    def records(self) -> tuple[EventRecord, ...]:
        """The zeros found, in the order of the events."""
        self.keep()
        return tuple(map(self._record, self.kept))

    def _record(self, kept: list[tuple[Array, Array]]) -> EventRecord:
        if not kept:
            return EventRecord(np.zeros(0), np.zeros((0, self.width)))
        return EventRecord(
            np.concatenate([t for t, _ in kept]), np.vstack([states for _, states in kept])
        )

    def _search(self, start: float, end: float) -> float | None:
        """All zeros within one step; zeros after a terminal one are omitted."""
        grid = start + (end - start) * self._fractions(start, end)
        grid[-1] = end
        states = self.run.interpolate(grid)
        roots = [self._zeros(n, grid, states) for n in range(len(self.events))]
        forwards = end > start
        stops = [
            (times[0 if event.reset else int(event.terminal) - self.count(n) - 1], n)
            for n, (event, times) in enumerate(zip(self.events, roots, strict=True))
            if times and (event.reset or 0 < event.terminal <= self.count(n) + len(times))
        ]
        stop, self.stopped_by = min(
            stops, key=lambda each: each[0] if forwards else -each[0], default=(None, -1)
        )
        for found, times in zip(self.found, roots, strict=True):
            found += [t for t in times if stop is None or (t <= stop) == forwards or t == stop]
        return stop

    def _fractions(self, start: float, end: float) -> Array:
        """Where a step is sampled; after a reset ever more densely towards its start."""
        if self.sides is None or start != self.start:
            return FRACTIONS
        nearest = located(start) / abs(end - start)
        halvings = max(int(math.log2(FRACTIONS[1] / nearest)), 0) if nearest > 0.0 else 0
        close = FRACTIONS[1] * 0.5 ** np.arange(halvings, 0, -1)
        return np.concatenate([FRACTIONS[:1], close, FRACTIONS[1:]])

    def _zeros(self, number: int, grid: Array, states: Array) -> list[float]:
        event = self.events[number]
        points = [(t, evaluated(event, t, y)) for t, y in zip(grid.tolist(), states, strict=True)]
        self.sizes[number] = max(self.sizes[number], *(abs(value) for _, value in points))
        begins = self.sides is not None and points[0][0] == self.start
        side = self.sides[number] if begins and self.sides is not None else Side()
        if side.sign:
            points[0] = (self.start, side.sign * SMALLEST)
        close = points[1 : len(points) - SAMPLES]  # only where the motion began with a reset
        close = [point for point in close if abs(point[0] - self.start) >= side.near]
        points = points[:1] + points[len(points) - SAMPLES :]
        while _changes_fast(points):
            if len(points) > MOST_SAMPLES:
                self.too_fast.setdefault(number, points[0][0])
                break
            points = self._twice_as_many(event, points)
        points += close + self._dips(event, points)
        points = sorted(points, reverse=bool(grid[-1] < grid[0]))
        roots = []
        for (t0, before), (t1, after) in pairwise(points):
            crossed = before != 0 and (after == 0 or (before < 0) != (after < 0))
            if crossed and event.direction * (after - before) >= 0:
                roots.append(self._refine(event, t0, t1, before))
        if event.reset:
            self._watch_grazing(number, points)
        if self.sides is not None:
            return roots
        # the event that ended the run before is not found again
        return [t for t in roots if abs(t - self.start) > located(t)]

    def _twice_as_many(
        self, event: Event, points: list[tuple[float, float]]
    ) -> list[tuple[float, float]]:
        """The points, and one in the middle of each two."""
        times = np.array([t for t, _ in points])
        middles = 0.5 * (times[1:] + times[:-1])
        states = self.run.interpolate(middles)
        added = [evaluated(event, t, y) for t, y in zip(middles.tolist(), states, strict=True)]
        between = zip(middles.tolist(), added, strict=True)
        return [
            *(point for both in zip(points, between, strict=False) for point in both), points[-1]
        ]  # fmt: skip

    def notes(self) -> tuple[str, ...]:
        """Warnings about events whose zeros could not all be resolved."""
        grazing = tuple(
            f"Event {number} only touches its zero at t = {t:.9g} s, to within what is tolerated: "
            "whether it is crossed, and the reset applied, depends on less (grazing)"
            for number, t in self.grazing.items()
        )
        return (
            self._lowered_note()
            + grazing
            + tuple(
                f"Event {number} changes so fast from t = {t:.9g} s on that {MOST_SAMPLES} samples "
                "a step do not follow it: zeros may be missing. Shorten the steps with max_step"
                for number, t in self.too_fast.items()
            )
        )

    def _lowered_note(self) -> tuple[str, ...]:
        if not self.lowered:
            return ()
        (t, part), count = self.lowered[0], len(self.lowered)
        times = "an impact" if count == 1 else f"{count} impacts"
        return (
            f"At {times}, first at t = {t:.9g} s, Newton's law of restitution with friction would "
            f"have given energy: {part:.3g} of the restitution was taken there, which gives none. "
            "mechc.Stop(..., law='poisson') gives none by itself",
        )

    def _dips(self, event: Event, points: list[tuple[float, float]]) -> list[tuple[float, float]]:
        """The minimum of three samples of one sign, towards zero: the vertex of their parabola."""
        found = []
        for (t0, a), (t1, b), (t2, c) in zip(points, points[1:], points[2:], strict=False):
            if min(a * b, b * c) > 0 and abs(b) <= min(abs(a), abs(c)):
                left, right = (t1 - t0) * (b - c), (t2 - t1) * (b - a)
                if left + right == 0:
                    continue
                vertex = t1 - 0.5 * ((t1 - t0) * left - (t2 - t1) * right) / (left + right)
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
                # a little past the secant's root, so that the bracket closes from both sides
                secant += math.copysign(0.45 * target, middle - secant)
                middle = secant if min(low, high) < secant < max(low, high) else middle
            f_middle = self._value(event, middle)
            if f_middle == 0 or (f_middle < 0) != (f_low < 0):
                high, f_high = middle, f_middle
            else:
                low, f_low = middle, f_middle
        if event.reset and f_high != f_low:  # to the last digit, for errors add up over resets
            exact = high - f_high * (high - low) / (f_high - f_low)
            return float(min(max(exact, min(low, high)), max(low, high)))
        return float(high)

    def _watch_grazing(self, number: int, points: list[tuple[float, float]]) -> None:
        """Of an event with a reset, minima towards zero that may be zeros or none."""
        event, small = self.events[number], GRAZES * self.rtol * self.sizes[number]
        for (t0, a), (_, b), (t2, c) in zip(points, points[1:], points[2:], strict=False):
            sign = math.copysign(1.0, -event.direction if event.direction else a)
            low = sign * b
            if not (sign * a > low < sign * c and sign * a > 0.0 and sign * c > 0.0):
                continue
            if low <= 0.1 * self.sizes[number] and number not in self.grazing:
                t, least = self._least(event, sign, t0, t2)
                if abs(least) <= small:
                    self.grazing[number] = t

    def _least(self, event: Event, sign: float, low: float, high: float) -> tuple[float, float]:
        """The minimum of sign * g between two times: its time and value.  Golden section."""
        share = 0.5 * (math.sqrt(5.0) - 1.0)
        left, right = high - share * (high - low), low + share * (high - low)
        at_left, at_right = sign * self._value(event, left), sign * self._value(event, right)
        for _ in range(40):
            if at_left < at_right:
                high, right, at_right = right, left, at_left
                left = high - share * (high - low)
                at_left = sign * self._value(event, left)
            else:
                low, left, at_left = left, right, at_right
                right = low + share * (high - low)
                at_right = sign * self._value(event, right)
        return (left, at_left) if at_left < at_right else (right, at_right)

    def _value(self, event: Event, t: float) -> float:
        return evaluated(event, t, self.run.interpolate(np.array([t]))[0])


def _changes_fast(points: list[tuple[float, float]]) -> bool:
    """Whether samples lie too far off the chords between their neighbours."""
    t, values = np.array(points).T
    change = float(np.ptp(values))
    if not 0.0 < change < math.inf or np.abs(values).min() > 4.0 * change:  # far from zero
        return False
    share = (t[1:-1] - t[:-2]) / (t[2:] - t[:-2])
    bend = np.abs(values[1:-1] - (1.0 - share) * values[:-2] - share * values[2:])
    return float(np.mean(bend > BENT * change)) > COARSE


def located(t: float) -> float:
    """How exactly a zero near t is located, s."""
    return max(2e-13, 4 * math.ulp(t))


class FunctionFailedError(Exception):
    """An event function raised ``__cause__``, or gave no number; internal."""


def evaluated(event: Event, t: float, y: Array) -> float:
    try:
        value = float(event.function(t, y))
    except Exception as error:
        raise FunctionFailedError(
            f"the event function {_name_of(event)} failed at t = {t:.9g} s with "
            f"{type(error).__name__}: {error}"
        ) from error
    if math.isnan(value):
        raise FunctionFailedError(f"the event function {_name_of(event)} gave NaN at t = {t:.9g} s")
    return value


def _name_of(event: Event) -> str:
    return str(getattr(event.function, "__name__", repr(event.function)))
