"""The start of a run: a state checked and closed, the compiled integrator at its first time."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from mechc.errors import AssemblyError, ValueOutOfBoundsError
from mechc.simulation.segments import Chain, Piece
from mechc.simulation.settings import METHODS, Policy
from mechc.simulation.singular_start import lead_in
from mechc.system.parameters import Array, doubles

if TYPE_CHECKING:
    from mechc.model import Model

OFF_BY_ROUNDING = 1e-8  # of the model's length: a state typed with ten digits is projected


def begin(
    model: Model, span: tuple[float, float], state: Array, values: Array, policy: Policy
) -> Piece:
    """The compiled integrator, at the start of the span."""
    begun: Piece = model._scene.start(
        span[0], span[1], state, values, policy.rtol, policy.atol, _scale(model, values),
        policy.first_step, policy.max_step, policy.max_steps, METHODS[policy.method],
        policy.dense,
        policy.on_change_point != "continue",
        policy.stiff_switch,
    )  # fmt: skip
    return begun


def leave_change_point(
    model: Model, span: tuple[float, float], state: Array, values: Array, policy: Policy
) -> Piece | None:
    """The motion off a change point along the branch that the speeds follow, if they do."""
    first = lead_in(model, state, values, span)
    if first is None or first.t == span[1]:
        return first
    beside = checked_state(model, first.states()[1][-1], values, first.t)
    return Chain(first, begin(model, (first.t, span[1]), beside, values, policy))


def _scale(model: Model, values: Array) -> Array:
    """Size of each component: 1 for angles and numbers, the model's length for lengths."""
    if model._all_pure:
        return model._ones
    return np.where(model._pure, 1.0, model._parameters.length(values))


def checked_state(model: Model, y0: Array, values: Array, t0: float) -> Array:
    """The state, on the constraints; refused if it is off by more than rounding."""
    state = _shaped(model, y0)
    projected: Array
    code, projected, gap, drift = model._scene.project(t0, state, values)
    allowed = OFF_BY_ROUNDING * model._parameters.length(values)
    sound = code == 0 and gap <= allowed and drift <= allowed
    if not sound:
        _refuse_state(model, state, gap, drift, allowed)
    return projected


def state_as_given(model: Model, y0: Array, values: Array, t0: float) -> Array:
    """The state as it is; refused if it is off the constraints by more than rounding.

    Unlike :func:`checked_state` it needs nothing of the integrators, which may still be compiling.
    """
    state = _shaped(model, y0)
    gap, drift = (
        float(np.abs(residual(state, values, t0)).max(initial=0.0))
        for residual in (model.constraints, model.velocity_constraints)
    )
    allowed = OFF_BY_ROUNDING * model._parameters.length(values)
    if not (gap <= allowed and drift <= allowed):
        _refuse_state(model, state, gap, drift, allowed)
    return state


def _shaped(model: Model, y0: Array) -> Array:
    state = doubles(y0, "y0")
    if state.shape != (model._scene.width,):
        raise ValueError(
            f"y0 must have the shape ({model._scene.width},): "
            f"{', '.join((*model.coordinates, *model.speeds))}; it has {state.shape}"
        )
    return state


def _refuse_state(model: Model, state: Array, gap: float, drift: float, allowed: float) -> None:
    """Say what is wrong with a state, unless its speeds are so high that it is rounding."""
    if not np.isfinite(state).all():
        bad = (*model.coordinates, *model.speeds)[int(np.argmin(np.isfinite(state)))]
        raise ValueOutOfBoundsError(f"y0: {bad} is not a finite number")
    if gap > allowed:
        raise AssemblyError(
            f"y0 leaves the loop open by {gap:.6g} m; take y0 = model.assemble(...), which "
            "closes it"
        )
    if drift > allowed * max(1.0, float(np.abs(state[len(model.coordinates) :]).max())):
        raise AssemblyError(
            f"the speeds of y0 open the loop at {drift:.6g} m/s; take y0 = model.assemble(..., "
            "speeds=...), which makes them consistent"
        )
