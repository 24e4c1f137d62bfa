"""The columns at the start of a run: through the closing of the loops, by the implicit function
theorem."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from mechc.assembly.closed import following, inverse, rank
from mechc.errors import MechcError
from mechc.sensitivities.columns import START, Columns
from mechc.sensitivities.steps import on_tangent_space
from mechc.simulation.record import Record
from mechc.system.names import by_name
from mechc.system.parameters import Array
from mechc.system.system import System

OPENS = 1e-7  # of a row's derivative: the part of it that opens the loop


def start_columns(
    system: System, columns: Columns, given: Any, record: Record, values: Array
) -> tuple[Array, tuple[str, ...]]:
    """S (nx, k) at the start of a run, and notes on columns that have none; ``given``: y0 as it was
    given.

    A mapping is assembled: what it holds stays, the rest follows.  A state is moved onto the
    constraints, as :meth:`mechc.Model.simulate` does.

    Raises :class:`MechcError` for a coordinate or speed that was not given by itself.
    """
    t, state = (part[0] for part in record.ends())
    found = np.zeros((system.scene.width, columns.count))
    notes: tuple[str, ...] = ()
    if isinstance(given, Mapping):
        held = list(by_name(given, "y0"))
        found, notes = _assembled_columns(system, columns, held, state, values, t)
    else:
        for name in _of_state(system, columns):  # where none follows from others
            if system.scene.rows:
                raise MechcError(
                    f"y0 is a whole state, in which the constraints tie {name} to the others: ask "
                    f"for sensitivities by {START!r}, or give a mapping, "
                    f"y0={{{name!r}: ...}}, which is assembled"
                )
            found[system.state_index(name), columns.places[name]] = 1.0
    own = columns.of_start
    for column, component in own.items():
        found[component, column] = 1.0
    if system.scene.rows and (own or not isinstance(given, Mapping)):
        moved = on_tangent_space(system, record, columns, found, values)
        places = list(own) if isinstance(given, Mapping) else slice(None)
        found[:, places] = moved[:, places]
    return np.ascontiguousarray(found), notes


def _of_state(system: System, columns: Columns) -> list[str]:
    states = (*system.coordinates, *system.speeds)
    return [name for name in columns.names if name in states]


def _assembled_columns(
    system: System, columns: Columns, held: Sequence[str], y: Array, values: Array, t: float
) -> tuple[Array, tuple[str, ...]]:
    """Columns of a start that was assembled from the coordinates and speeds in the mapping."""
    for name in _of_state(system, columns):
        if name not in held:
            raise MechcError(
                f"{name} is not given: it follows from the others. Put it into y0, or ask for "
                f"sensitivities by {', '.join(held) or 'parameters'}"
            )
    found = np.zeros((system.scene.width, columns.count))
    for name in _of_state(system, columns):
        found[system.state_index(name), columns.places[name]] = 1.0
    kept = [system.state_index(name) for name in held]
    return found, fill_in(system, columns, kept, found, y, values, t)


def fill_in(
    system: System, columns: Columns, kept: Sequence[int], found: Array, y: Array, values: Array,
    t: float,
) -> tuple[str, ...]:  # fmt: skip
    """Fill in the rows of columns (nx, k) besides those kept, so that loops stay closed along them;
    notes on columns that there are none of."""
    if not system.scene.rows:
        return ()
    nq = len(system.coordinates)
    rows = system.constraint_jacobian(y, values, t)
    free = system.unknowns([i for i in kept if i < nq])
    notes = _close(system, columns, free, found, y, values, t)
    free = [i for i in range(len(system.speeds)) if nq + i not in kept]
    _steady(system, columns, free, found, rows, y, values, t)
    return notes


def _close(
    system: System, columns: Columns, free: list[int], found: Array, y: Array, values: Array,
    t: float,
) -> tuple[str, ...]:  # fmt: skip
    """Fill in the free coordinates: Phi_q dq = -Phi_p dp."""
    nq = len(system.coordinates)
    slopes = system.constraint_gradient(y, values, t)
    if not free or not len(slopes):
        return ()
    opened = opening(system, columns, y, values, t)
    gap = slopes @ found[:nq] + (0.0 if opened is None else opened)
    follows, determined = following(slopes[:, free], gap)
    if not determined:
        moved = np.abs(gap).max(axis=0) > 0
        found[:, moved] = np.nan
        return tuple(
            f"by {name}: none, for the loops just close with the coordinates given: those that "
            "follow change infinitely fast, or the start is a change point"
            for name in columns.names_among(moved)
        )
    found[free] = follows
    return ()


def _steady(
    system: System, columns: Columns, free: list[int], found: Array, rows: Array, y: Array,
    values: Array, t: float,
) -> None:  # fmt: skip
    """Fill in the free speeds: those of least size for which J u + b = 0."""
    nq = len(system.coordinates)
    if not free:
        return
    faster = _velocity_change(system, columns, found, y, values, t)
    opened = faster + rows @ found[nq:]
    own, u = rows[:, free], y[nq:][free]
    back = inverse(own)
    turned = -back @ opened
    multiples = back.T @ u  # of the rows, that make up the least speeds
    if rank(own) < len(free) and multiples.any():
        still = _velocity_change(system, columns, found, _moving(y, nq, None), values, t)
        for place, i in enumerate(free):
            one = _velocity_change(system, columns, found, _moving(y, nq, i), values, t)
            slope = multiples @ (one - still)  # of J^T times the multiples
            turned += np.outer(np.eye(len(free))[:, place] - back @ own[:, place], slope)
    found[nq + np.array(free)] = turned


def _moving(y: Array, nq: int, speed: int | None) -> Array:
    """The configuration of y with one speed, 1, or none."""
    moving = y.copy()
    moving[nq:] = 0.0
    if speed is not None:
        moving[nq + speed] = 1.0
    return moving


def _velocity_change(
    system: System, columns: Columns, found: Array, y: Array, values: Array, t: float
) -> Array:
    """The change of J u + b with the configuration and the parameters, (nc, k)."""
    nq = len(system.coordinates)
    names = ("velocity_constraints_by_parameters", "velocity_constraints_by_inputs")
    faster = columns.at_state(system, *names, y, values, t)
    pushed = system.evaluate("velocity_gradient", y, values, t) @ found[:nq]
    return np.asarray(pushed if faster is None else pushed + faster)


def without_closure(
    system: System, columns: Columns, found: Array, y: Array, values: Array, t: float
) -> tuple[str, ...]:
    """Set columns (nx, k) to NaN along which dependent rows keep the constraints from holding, and
    say so: they are redundant, or depend on each other at this state only."""
    if not system.scene.rows:
        return ()
    nq, bad = len(system.coordinates), np.zeros(columns.count, bool)
    opened = opening(system, columns, y, values, t)
    if opened is not None:
        left = np.abs(system.constraint_gradient(y, values, t) @ found[:nq] + opened).max(axis=0)
        size = np.abs(opened).max(axis=0)
        bad = (size > 0) & (left > OPENS * size)
    rows = system.constraint_jacobian(y, values, t)
    if rank(rows) < len(rows):  # else some speeds always follow
        faster = _velocity_change(system, columns, found, y, values, t)
        left = np.abs(faster + rows @ found[nq:]).max(axis=0)
        size = (np.abs(faster) + np.abs(rows) @ np.abs(found[nq:])).max(axis=0)
        size += (np.abs(rows) @ np.abs(y[nq:])).max() * np.abs(found[:nq]).max(axis=0)
        bad |= left > OPENS * size
    found[:, bad] = np.nan
    return tuple(
        f"by {name}: none, for the constraints are redundant and with another {name} they do not "
        "hold at all, or this is a change point, where derivatives do not exist"
        for name in columns.names_among(bad)
    )


def opening(system: System, columns: Columns, y: Array, values: Array, t: float) -> Array | None:
    """The change of the configuration constraints along the columns, (nh, k)."""
    if not system.scene.holonomic:
        return None
    names = ("constraints_by_parameters", "constraints_by_inputs")
    return columns.at_state(system, *names, y, values, t)
