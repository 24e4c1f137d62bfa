"""Derivatives of the times of events, of the states there, and through resets.

An event g(t, y, p) = 0 moves by dt = -(g_y S + g_p) / g' with g' = g_t + g_y f.  A reset
y+ = R(t, y) gives the columns at a fixed time after it S+ = R_y (S + f dt) + R_t dt - f+ dt (the
saltation matrix; Leine & Nijmeijer 2004, chapter 7).  Expressions are differentiated; of functions
of Python, and of resets that constraints change, differences are taken, good for some ten digits.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from mechc.sensitivities.columns import Columns
from mechc.simulation.events.event import Event, value_of
from mechc.simulation.events.expressions import ResetExpressions
from mechc.simulation.events.resets import changed_state
from mechc.simulation.record import Record
from mechc.system.parameters import Array
from mechc.system.system import System

if TYPE_CHECKING:
    from mechc.simulation.trajectory import Trajectory

STEP = np.finfo(float).eps ** 0.2  # of differences of fourth order, of the argument's size
GRAZING = (
    "none at t = {:.9g} s, where the event only touches its zero (grazing): its time moves "
    "infinitely fast. By what does not move the event there is one"
)
AT_ONE_INSTANT = (
    "several events reset the state at one instant, in an order that a small change may reverse"
)
GRAZES = 1e-9  # of the rate's terms: a rate that small is rounding


@dataclass(frozen=True)
class EventSensitivity:
    """Derivatives of the zeros of one event.

    Attributes
    ----------
    t
        Name -> derivatives of their times (k,); of ``"y0"`` (k, nq + nu).
    y
        Name -> derivatives of the states there (k, nq + nu), the event's time moving along.
    notes
        Which derivatives do not exist, and are NaN, because the event only touches its zero.
    """

    t: Mapping[str, Array]
    y: Mapping[str, Array]
    notes: tuple[str, ...] = ()


def difference(f: Callable[[float], Array], size: float) -> Array:
    """f' at 0 for arguments of this size, by the central difference of fourth order."""
    h = STEP * size
    values = [f(k * h) for k in (-2, -1, 1, 2)]
    return np.asarray((values[0] - 8.0 * values[1] + 8.0 * values[2] - values[3]) / (12.0 * h))


def moved_time(
    system: System, event: Event, t: float, y: Array, values: Array, columns: Columns, found: Array
) -> Array:
    """The slopes (k,) of the time of an event along the columns (nx, k).

    NaN where the event only touches its zero, but 0 along columns that do not move it.
    """
    by_time, by_state, by_parameters = _slopes(system, event, t, y, values)
    rates = system.rates(y, values, t)
    rate = by_time + by_state @ rates
    terms = abs(by_time) + np.abs(by_state) @ np.abs(rates)
    moved = np.asarray(by_state @ found + by_parameters @ columns.parameters)
    if not abs(rate) > GRAZES * terms:
        return np.where(moved == 0.0, 0.0, np.nan)
    return -moved / rate


def _slopes(
    system: System, event: Event, t: float, y: Array, values: Array
) -> tuple[float, Array, Array]:
    """The derivatives of g by time, state (nx,) and parameters (np,)."""
    exact = getattr(event.function, "slopes", None)
    if exact is not None:
        found: tuple[float, Array, Array] = exact(t, y)
        return found
    sizes = np.maximum(np.abs(y), system.scale(values))

    def along(k: int) -> Array:
        unit = np.eye(len(y))[k]
        return difference(lambda e: np.array(value_of(event, t, y + e * unit)), float(sizes[k]))

    by_state = np.array([along(k) for k in range(len(y))])
    pace = float((np.abs(system.rates(y, values, t)) / sizes).max(initial=1e-3))
    by_time = float(difference(lambda e: np.array(value_of(event, t + e, y)), 1.0 / pace))
    return by_time, by_state, np.zeros(len(values))


@dataclass(frozen=True)
class Jump:
    """A change of the state by resets: its time, the states before and after, the events."""

    t: float
    before: Array
    after: Array
    causes: tuple[int, ...]


def jump_of(record: Record, number: int) -> Jump:
    """The jump with which a piece of a motion begins."""
    piece = record.pieces[number]
    (t, _), (after, _) = piece.steps.ends()
    return Jump(float(t), record.pieces[number - 1].states()[1][-1], after, piece.causes)


def through_reset(sol: Trajectory, jump: Jump, columns: Columns, found: Array) -> Array:
    """Columns right after the reset of one event from those right before it, (nx, k)."""
    system, values, t = sol.system, sol.params, jump.t
    event = sol.asked_events[jump.causes[0]]
    later = moved_time(system, event, t, jump.before, values, columns, found)
    along = found + np.outer(system.rates(jump.before, values, t), later)
    changed = np.full(found.shape, np.nan)
    for k in np.flatnonzero(np.isfinite(along).all(axis=0)):
        one = along[:, k], float(later[k]), columns.parameters[:, k]
        changed[:, k] = _reset_derivative(sol, event, t, jump.before, *one)
    return changed - np.outer(system.rates(jump.after, values, t), later)


def _reset_derivative(
    sol: Trajectory, event: Event, t: float, y: Array, along: Array, later: float, change: Array
) -> Array:
    """The derivative of the state that a reset gives along one column; change: of parameters."""
    system, values = sol.system, sol.params
    if isinstance(event.reset, ResetExpressions) and not system.scene.rows:
        by_time, by_state, by_parameters = event.reset.slopes(t, y)
        return np.asarray(by_state @ along + by_time * later + by_parameters @ change)
    sizes = np.maximum(np.abs(y), system.scale(values))
    most = max(
        float((np.abs(along) / sizes).max(initial=0.0)),
        float((np.abs(change) / np.maximum(np.abs(values), 1e-3)).max(initial=0.0)),
        abs(later),
    )
    if most == 0.0:
        return np.zeros(len(y))

    def after(e: float) -> Array:
        return changed_state(system, event, t + e * later, y + e * along, values + e * change)

    return difference(after, 1.0 / most)


def event_sensitivities(
    sol: Trajectory, columns: Columns, at: Callable[[Array, Array], Array]
) -> tuple[EventSensitivity, ...]:
    """The sensitivity of every event of a run; ``at``: columns (n, nx, k) before resets."""
    return tuple(
        _one(sol, event, record.t, record.y, columns, at)
        for event, record in zip(sol.asked_events, sol.events, strict=True)
    )


def _one(
    sol: Trajectory, event: Event, t: Array, y: Array, columns: Columns, at: Any
) -> EventSensitivity:
    system, values = sol.system, sol.params
    found = at(t, y) if len(t) else np.zeros((0, y.shape[1], columns.count))
    times = np.zeros((len(t), columns.count))
    notes: list[str] = []
    for k in range(len(t)):
        times[k] = moved_time(system, event, float(t[k]), y[k], values, columns, found[k])
        touched = np.isnan(times[k]) & np.isfinite(found[k]).all(axis=0)
        notes += [f"by {name}: {GRAZING.format(t[k])}" for name in columns.names_among(touched)]
    rates = system.rates(y, values, t) if len(t) else np.zeros(y.shape)
    states = found + rates[:, :, None] * times[:, None, :]
    return EventSensitivity(
        {name: times[:, place] for name, place in columns.places.items()},
        {name: states[:, :, place] for name, place in columns.places.items()},
        tuple(notes),
    )
