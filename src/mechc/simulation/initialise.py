"""The start of a run: a state checked and closed, the compiled integrator at its first time."""

from __future__ import annotations

from typing import Any

import numpy as np

from mechc.assembly.directions import TURN, are_turned, turned_in_words
from mechc.assembly.sizes import checked_gap, excess_of_rates, gap_in_words, is_open
from mechc.errors import AssemblyError, ValueOutOfBoundsError
from mechc.native._arrays import all_within
from mechc.native._codes import RUNNING
from mechc.native._motion import Motion, Request
from mechc.simulation.events.run_events import RunEvents
from mechc.simulation.settings import Policy
from mechc.system.parameters import Array, doubles
from mechc.system.system import System

LARGEST = float(np.finfo(float).max)
DOUBLE = np.dtype(np.float64)


def begin(
    system: System, span: tuple[float, float], state: Array, values: Array, policy: Policy,
    events: RunEvents | None = None,
) -> Motion:  # fmt: skip
    """A motion at the start of the span."""
    if system.driven is not None:
        system.driven.check_times(span)
    request = request_of(system, span, values, policy, events)
    return Motion(request, span[0], span[1], state, policy.max_bytes)


def request_of(
    system: System, span: tuple[float, float], values: Array, policy: Policy,
    events: RunEvents | None = None, scene: Any = None,
) -> Request:  # fmt: skip
    """The request for motions over this span; ``scene``: the compiled one, where it is another."""
    bound = None if events is None else events.bound
    driven = system.driven
    if driven is None:
        scene, data = scene or system.scene, values.tobytes()
        known = system.cache.get("request")  # most runs ask as the one before
        if (
            known
            and known[0] is policy
            and known[1] is scene
            and known[2] is bound
            and known[3] == data
            and known[4].is_latest
        ):
            found: Request = known[4]
            return found
        found = Request(scene, system.sizes, policy, values, events=bound)
        system.cache["request"] = policy, scene, bound, data, found
        return found
    return Request(
        scene or driven.without_inputs, system.sizes, policy, values, driven.native_inputs(),
        np.array(driven.breaks(*span, policy.rtol)), driven.due, bound,
    )  # fmt: skip


def checked_state(system: System, y0: Array, values: Array, t0: float) -> Array:
    """The state, on the constraints; refused if it is off by more than rounding.

    That of a scene without constraints is the array given, where it is one.
    """
    state = _flat_state(system, y0)
    if not system.scene.rows and all_within(state, -LARGEST, LARGEST):
        return state
    allowed = checked_gap(system, values, t0)
    projected: Array
    code, projected, gap, drift = system.scene.project(t0, state, values)
    if not (code == RUNNING and gap <= allowed and drift <= allowed):
        _refuse_open(system, state, values, t0)
    _refuse_turned(system, state, values, t0)
    return projected


def state_as_given(system: System, y0: Array, values: Array, t0: float) -> Array:
    """The state unchanged; refused if it violates the constraints by more than rounding.

    Unlike :func:`checked_state` it does not wait for the integrators, which may still be compiling.
    """
    state = _flat_state(system, y0)
    _refuse_open(system, state, values, t0)
    _refuse_turned(system, state, values, t0)
    return state


def _flat_state(system: System, y0: Array) -> Array:
    width = system.scene.width
    plain = type(y0) is np.ndarray and y0.dtype == DOUBLE and y0.flags.c_contiguous
    state = y0 if plain else doubles(y0, "y0", copied=False)
    if system.attitudes.quaternions and state.size == width:
        system.attitudes.check(state.ravel())
    if state.shape == (width,):
        return state
    if state.shape == (width, 1):  # a Matrix of SymPy
        return np.ascontiguousarray(state[:, 0])
    raise ValueError(
        f"y0 must have the shape ({width},): "
        f"{', '.join((*system.coordinates, *system.speeds))}; it has {state.shape}"
    )


def _refuse_turned(system: System, state: Array, values: Array, t: float) -> None:
    """Raise for a state in which axes that cut joints hold point another way."""
    if are_turned(system, state, values, t):
        raise AssemblyError(
            f"y0 leaves {turned_in_words(system, state, values, t)}; take y0 = "
            f"model.assemble(...), which finds another, or {TURN}"
        )


def _refuse_open(system: System, state: Array, values: Array, t: float) -> None:
    """Raise for a state off the constraints, unless its speeds are so high that it is rounding."""
    if not np.isfinite(state).all():
        bad = (*system.coordinates, *system.speeds)[int(np.argmin(np.isfinite(state)))]
        raise ValueOutOfBoundsError(f"y0: {bad} is not a finite number")
    gap = system.constraints(state, values, t)
    if len(gap) and is_open(system, gap, values, t):
        raise AssemblyError(
            f"y0 leaves {gap_in_words(system, gap, values, t)}; take y0 = model.assemble(...), "
            "which closes it"
        )
    drift = system.velocity_constraints(state, values, t)
    excess = excess_of_rates(system, drift, state, values, t)
    if not (excess <= 1.0).all():
        worst = int(np.argmax(excess))
        raise AssemblyError(
            f"the speeds of y0 open {system.constraint_names[worst]!r} at "
            f"{abs(drift[worst]):.6g} {system.rate_units[worst]}; take y0 = "
            "model.assemble(..., speeds=...), which makes them consistent"
        )
