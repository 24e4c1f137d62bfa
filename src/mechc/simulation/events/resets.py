"""Resets of events: the states and parameters after them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from mechc.native._codes import RUNNING
from mechc.simulation.events.event import Event, FunctionFailedError
from mechc.system.names import by_name
from mechc.system.parameters import Array
from mechc.system.system import System


def changed_state(system: System, event: Event, t: float, state: Array, values: Array) -> Array:
    """The state that a reset gives, on the constraints.

    Raises
    ------
    FunctionFailedError, ValueError
        As :func:`onto_constraints`, and for a reset that fails.
    """
    given, values = state_given(event, t, state, system, values)
    return onto_constraints(system, t, given, values)


def state_given(
    event: Event, t: float, state: Array, system: System, values: Array
) -> tuple[Array, Array]:
    """The state after a reset, and all parameters, ``values`` itself where these stay."""
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
    """State and parameters from the value of a reset: q and u, these and all parameters, or a
    mapping of names, of which all others stay."""
    if not isinstance(told, Mapping):
        q, u, *rest = told
        found = np.concatenate([np.asarray(q, dtype=float), np.asarray(u, dtype=float)])
        return found, _checked_parameters(system, rest[0], values) if rest else values
    found, after = state.copy(), values.copy()
    for key, value in by_name(told, "a reset", "{'k': 0.0}").items():
        if key in system.parameters:
            after[system.parameters.index(key)] = float(value)
        else:
            found[system.state_index(key)] = float(value)
    return found, _checked_parameters(system, after, values)


def _checked_parameters(system: System, after: Array, values: Array) -> Array:
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
