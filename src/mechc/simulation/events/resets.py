"""Resets by events: a run stopped at an instant, changed, and continued as one motion."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from mechc.native._codes import (
    FINISHED,
    MEMORY_LIMIT,
    RESETS_ACCUMULATE,
    RUNNING,
    STOPPED_BY_EVENT,
    TOO_MANY_STEPS,
)
from mechc.simulation.chain import Chain
from mechc.simulation.events.event import (
    Event,
    EventFinder,
    FunctionFailedError,
    Side,
    evaluated,
    located,
)
from mechc.simulation.events.expressions import rounding_of
from mechc.simulation.events.friction import FrictionLaw
from mechc.simulation.initialise import begin
from mechc.simulation.settings import Policy
from mechc.system.names import by_name
from mechc.system.parameters import Array
from mechc.system.system import System

CHANGE = 1e-6  # of the state's size: over such a change rates of events are taken
SETTLED = 1e-12  # of the largest rate at an instant: an approach so slow is none
PLASTIC = 1e-9  # of the rate before: what is left after a reset that does not turn the motion back
TOUCHING = 10.0  # times rtol of an event's largest value: it may be zero
SHORTEST = 64.0  # times the exactness of an event's time: resets nearer to each other accumulate
MOST_AT_ONCE = 1000  # resets at one instant
ROUNDS = 4.0  # times the rounding of an event's terms: its value may be zero
NEAR = 16.0  # times it: a value that tells its sign
FLIGHT = 64.0  # times it: how far it goes where a zero is told from the last
LEAST_STATES, ROWS_A_STEP = 64, 12  # room of a piece: states; rows of the dense output a step


class Resets:
    """Goes on after events with a reset: the state is changed and a new piece of the run begun.

    Parameters
    ----------
    chain
        The run so far; pieces are added to it.
    finder
        Searches for the events in the chain's last piece.
    """

    def __init__(
        self, system: System, values: Array, policy: Policy, t_end: float, chain: Chain,
        finder: EventFinder,
    ) -> None:  # fmt: skip
        self.system, self.policy, self.t_end = system, policy, t_end
        self.values = values
        self.chain, self.finder = chain, finder
        self.last: dict[int, float] = {}  # event: the time of its last reset
        self.rate_after: dict[int, float] = {}  # event: its rate after that
        self.passed: dict[int, float] = {}  # the same, of a reset that let the zero be crossed
        self.caused_by: list[int] = []  # the events whose resets made the last jump, in order
        self.fastest = np.zeros(len(finder.events))  # largest rate of each event at a reset
        self.numbers = [k for k, event in enumerate(finder.events) if event.reset is not None]
        t, y = chain.last.steps.ends()
        self.sense = 1.0 if t_end >= t[0] else -1.0
        finder.enter(chain.last, self._sides(float(t[0]), y[0]))

    def begin(self) -> int:
        """Before the first step; RUNNING, or the status that ends the run."""
        return RUNNING

    def finished(self) -> int:
        """The last piece has come to its end; RUNNING, or the status that ends the run."""
        return FINISHED

    def take_values(self, values: Array) -> None:
        """Go on with other parameters (np,)."""
        self.values = values
        self.finder.take_values(values)

    def takes(self, number: int) -> bool:
        """Whether an event that stopped the search is applied here, and does not end the run."""
        return self.finder.events[number].reset is not None

    def after(self, t: float, number: int) -> int:
        """Apply the reset of an event, and continue; RUNNING, or the status that ends the run."""
        before = self._stop_at(t)
        state, accumulate = self._reset(t, before, number)
        return self._go_on(t, number, state, accumulate)

    def _stop_at(self, t: float) -> Array:
        """The state where the last piece ends."""
        self.chain.record.end_at(t)
        before: Array = self.chain.last.steps.interpolate(np.array([t]))[0]
        self.finder.keep()
        return before

    def _go_on(self, t: float, number: int, state: Array, accumulate: bool) -> int:
        """A new piece after the reset of an event."""
        ends = self._is_last(number)
        left = self._shorten()
        t_end = t if ends or accumulate else self.t_end
        piece = begin(self.system, (t, t_end), state, self.values, self.policy)
        causes = tuple(self.caused_by)
        self.chain.add(piece, self.values, jumps=True, causes=causes)
        self.finder.enter(piece, self._sides(t, state))
        if accumulate:
            return RESETS_ACCUMULATE
        return STOPPED_BY_EVENT if ends else left

    def _is_last(self, number: int) -> bool:
        """Whether an event has happened as often as ends the run."""
        event = self.finder.events[number]
        return bool(event.terminal) and self.finder.count(number) >= event.terminal

    def _shorten(self) -> int:
        """Count what the last piece took of the run's limits; RUNNING while something is left."""
        first = self.chain.last.stats()
        left = self.policy.max_steps - first["steps"] - first["rejected"]
        room = self.policy.max_bytes - self._bytes()
        self.policy = self.policy._replace(
            first_step=0.0, max_steps=max(left, 1), max_bytes=max(room, 1.0)
        )
        if room <= 0:
            return MEMORY_LIMIT
        return RUNNING if left > 0 else TOO_MANY_STEPS

    def _bytes(self) -> float:
        """Memory of the last piece, at most."""
        states = max(self.chain.last.steps.count, LEAST_STATES)
        return float(8 * states * (1 + self.system.scene.width * (1 + ROWS_A_STEP)))

    def _reset(self, t: float, state: Array, number: int) -> tuple[Array, bool]:
        """The state after an event's reset and those that it causes at the same instant; whether
        the resets accumulate."""
        rates = self._rates_of_events(t, state)
        rounding = self._rounding(t, state, number)
        accumulate = self._is_now(self.last, number, t, rates[number], rounding)
        largest, done, self.caused_by = 0.0, {number}, [number]
        for _ in range(MOST_AT_ONCE):
            self.last[number] = t
            self.fastest = np.maximum(self.fastest, np.abs(rates))
            state = self._changed(t, state, number)
            later = self._rates_of_events(t, state)
            self.rate_after[number] = later[number]
            largest = max(largest, float(np.abs([rates, later]).max()))
            if self._stays(t, state, number, rates[number], later[number]):
                return state, True
            self.passed.pop(number, None)
            if rates[number] * later[number] > 0.0:
                self.passed[number] = t
            caused = self._caused(t, state, rates, later, largest, done)
            if caused is None:
                return state, accumulate
            number, rates = caused, later
            done.add(number)
            self.caused_by.append(number)
            self.finder.add(number, t, state)
        return state, True

    def _is_now(
        self, times: dict[int, float], number: int, t: float, rate: float, rounding: float
    ) -> bool:
        """Whether a zero is told from an earlier one by neither its time nor the way between."""
        since = abs(t - times.get(number, -math.inf))
        fastest = max(abs(rate), abs(self.rate_after.get(number, math.inf)))
        return since <= SHORTEST * located(t) or since * fastest <= FLIGHT * rounding

    def _stays(self, t: float, state: Array, number: int, before: float, after: float) -> bool:
        """Whether a reset ends the motion towards the zero and leaves the state there."""
        moved = abs(before) > PLASTIC * self.fastest[number]
        ends = moved and abs(after) <= PLASTIC * abs(before)
        return ends and abs(self._value(t, state, number)) <= self._zero(number)

    def _caused(
        self, t: float, state: Array, before: Array, after: Array, largest: float, done: set[int]
    ) -> int | None:
        """Another event that is zero and about to be crossed, or one that the last reset lets
        cross again."""
        for number in self.numbers:
            direction = self.finder.events[number].direction
            if direction:
                crosses = math.copysign(1.0, direction) * after[number] > SETTLED * largest
            else:
                crosses = number not in done and before[number] * after[number] > 0.0
            if (
                crosses
                and not self._is_passed(t, state, number, after[number])
                and self._touches(t, state, number, after[number])
            ):
                return number
        return None

    def _is_passed(self, t: float, state: Array, number: int, rate: float) -> bool:
        """Whether it is a zero that a reset has just let be crossed."""
        rounding = self._rounding(t, state, number) if number in self.passed else 0.0
        return self._is_now(self.passed, number, t, rate, rounding)

    def _touches(self, t: float, state: Array, number: int, rate: float) -> bool:
        """Whether an event is zero as far as the motion is known; what is clearly still to come is
        found later."""
        value, allowed = self._value(t, state, number), self._zero(number)
        soon = 2.0 * located(t) * abs(rate) + ROUNDS * self._rounding(t, state, number)
        return abs(value) <= soon or (value * rate > 0.0 and abs(value) <= allowed)

    def _value(self, t: float, state: Array, number: int) -> float:
        return evaluated(self.finder.events[number], t, state)

    def _rounding(self, t: float, state: Array, number: int) -> float:
        return rounding_of(self.finder.events[number].function, t, state)

    def _zero(self, number: int) -> float:
        """What an event may be where it is zero as far as the motion is known."""
        return TOUCHING * self.policy.rtol * self.finder.sizes[number]

    def _sides(self, t: float, state: Array) -> list[Side]:
        """For each event how its motion begins."""
        rates = self._rates_of_events(t, state)
        return [self._side(t, state, k, rate) for k, rate in enumerate(rates)]

    def _side(self, t: float, state: Array, number: int, rate: float) -> Side:
        if rate == 0.0 or not self._touches(t, state, number, rate):
            return Side()
        near = NEAR * self._rounding(t, state, number) / abs(rate)
        return Side(math.copysign(1.0, rate), near)

    def _rates_of_events(self, t: float, state: Array) -> Array:
        """g' of every event with a reset, in the run's direction; 0 for others.

        By central differences along the rates of the state.
        """
        system = self.system
        rates = system.rates(state, self.values, t)
        size = np.abs(state) + system.scale(self.values)
        fastest = float((np.abs(rates) / size).max(initial=0.0))
        step = CHANGE / fastest if fastest > 0.0 else CHANGE
        found = np.zeros(len(self.finder.events))
        for number in self.numbers:
            event = self.finder.events[number]
            ahead, behind = (evaluated(event, t + s, state + s * rates) for s in (step, -step))
            found[number] = self.sense * (ahead - behind) / (2.0 * step)
        return found

    def _changed(self, t: float, state: Array, number: int) -> Array:
        """The state that a reset gives, on the constraints; other parameters are taken."""
        event = self.finder.events[number]
        given, values = _given_by(event, t, state, self.system, self.values)
        if values is not self.values:
            self.take_values(values)
        try:
            return onto_constraints(self.system, t, given, values)
        except ValueError as error:
            raise FunctionFailedError(
                f"the reset of event {number} at t = {t:.9g} s gives a state that {error}"
            ) from None


def changed_state(system: System, event: Event, t: float, state: Array, values: Array) -> Array:
    """The state that a reset gives, on the constraints.

    Raises
    ------
    FunctionFailedError, ValueError
        As :func:`onto_constraints`, and for a reset that fails.
    """
    given, values = _given_by(event, t, state, system, values)
    return onto_constraints(system, t, given, values)


def _given_by(
    event: Event, t: float, state: Array, system: System, values: Array
) -> tuple[Array, Array]:
    """What a reset gives: the state, and all parameters, ``values`` itself where these stay."""
    assert event.reset is not None
    name = getattr(event.reset, "__name__", repr(event.reset))
    split = len(system.coordinates)
    given = (t, state[:split].copy(), state[split:].copy())
    try:
        reset: Any = event.reset
        told = reset(*given, *((values,) if hasattr(reset, "takes_parameters") else ()))
        found, after = _read(told, state, system, values)
    except Exception as error:
        raise FunctionFailedError(
            f"the reset {name} failed at t = {t:.9g} s with {type(error).__name__}: {error}; it "
            "takes t, q and u and returns q and u, or names of coordinates, speeds and parameters "
            "with their new values"
        ) from error
    if found.shape != state.shape or not np.isfinite(found).all():
        raise FunctionFailedError(
            f"the reset {name} gave at t = {t:.9g} s {len(found)} numbers, not the "
            f"{len(state)} finite ones of q and u"
        )
    return found, after


def _read(told: Any, state: Array, system: System, values: Array) -> tuple[Array, Array]:
    """State and parameters from what a reset returns: q and u, these and all parameters, or a
    mapping of names, of which all others stay."""
    if not isinstance(told, Mapping):
        q, u, *rest = told
        found = np.concatenate([np.asarray(q, dtype=float), np.asarray(u, dtype=float)])
        return found, _checked(system, rest[0], values) if rest else values
    found, after = state.copy(), values.copy()
    for key, value in by_name(told, "a reset", "{'k': 0.0}").items():
        if key in system.parameters:
            after[system.parameters.index(key)] = float(value)
        else:
            found[system.state_index(key)] = float(value)
    return found, _checked(system, after, values)


def _checked(system: System, after: Array, values: Array) -> Array:
    """Parameters after a reset, within their bounds; ``values`` itself where none has changed."""
    if np.array_equal(after, values):
        return values
    return system.parameter_set.resolve(after)


def onto_constraints(system: System, t: float, state: Array, values: Array) -> Array:
    """A state whose coordinates close the loops, its speeds changed by the constraints' impulse.

    The coordinates are the nearest ones that close the loops.  Speeds: M (u+ - u) = J^T p with
    J u+ + b = 0, which takes the least kinetic energy in the difference.  Unchanged without
    constraints.

    Raises
    ------
    ValueError
        If the loops cannot be closed or the mass matrix is singular; how, for the middle of a
        sentence.
    """
    if not system.scene.rows:
        return state
    split = len(system.coordinates)
    code, closed, _, _ = system.scene.project(t, state, values)
    if code != RUNNING:
        raise ValueError("does not close the loops")
    closed[split:] = state[split:]
    missing = system.velocity_constraints(closed, values, t)
    rows = system.constraint_jacobian(closed, values, t)
    try:
        root = np.linalg.cholesky(system.mass_matrix(closed, values, t))
    except np.linalg.LinAlgError:
        raise ValueError("has no positive definite mass matrix, so no impulse") from None
    weighted = np.linalg.solve(root, rows.T)  # J L^-T, transposed
    share = np.linalg.lstsq(weighted.T, missing, rcond=None)[0]
    closed[split:] -= np.linalg.solve(root.T, share)
    found: Array = system.scene.project(t, closed, values)[1]
    return found


def resets_of(events: Any) -> bool:
    """Whether any of the events has a reset, or is a law of friction."""
    return any(
        isinstance(event, Event)
        and (event.reset is not None or isinstance(event.function, FrictionLaw))
        for event in events
    )
