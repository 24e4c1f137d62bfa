"""Inverse dynamics: the inputs that make a given motion."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from mechc.errors import MechcError, UnknownNameError
from mechc.parameters import Array, Parameters

if TYPE_CHECKING:
    from mechc.model import Model

LINEAR = 1e-9  # of the loads: an input whose effect departs from a straight line by more
KEPT = 1e-6  # of the accelerations: a given motion that leaves the constraints by more
MADE = 1e-6  # of the forces: what the inputs leave undone
RANK = 1e-10


class InverseDynamics(NamedTuple):
    """What makes a motion.

    inputs : (..., m)
        Values of the inputs, in the order asked for; those of least norm where they are more
        than needed.
    multipliers : (..., nc)
        Of the constraints meanwhile, of least norm.
    """

    inputs: Array
    multipliers: Array


def inverse_dynamics(
    model: Model,
    y: Array,
    accelerations: Array,
    params: Parameters = None,
    *,
    inputs: Sequence[str],
    t: float | Array = 0.0,
) -> InverseDynamics:
    """The inputs r with which M u' + J^T lambda = F(r) holds for given states and accelerations.

    Parameters
    ----------
    y : (..., nq + nu)
        States on the constraints.
    accelerations : (..., nu)
        The speeds' rates u', which must keep the constraints.
    params
        As everywhere; what they say of the inputs does not matter.
    inputs
        Names of the parameters that are the inputs: torques, forces; F must be linear in them.
    t
        Time or times (...).

    Raises
    ------
    ValueError
        If the shapes do not fit, or the accelerations do not keep the constraints.
    MechcError
        If an input acts otherwise than linearly, changes the inertia or does nothing; if the
        inputs cannot make this motion, with the largest force they leave undone.
    UnknownNameError
        If there is no such parameter.
    """
    names, rates = tuple(inputs), np.asarray(accelerations, dtype=np.float64)
    values, states = model._parameters.resolve(params), np.asarray(y, dtype=np.float64)
    _check_shapes(model, states, rates)
    still, per_input = _forces(model, states, values, names, t)
    mass = model.mass_matrix(states, values, t)
    needed = np.einsum("...ij,...j->...i", mass, rates) - still
    jacobian = model.constraint_jacobian(states, values, t)
    own = model.rhs(t, states, values)[..., -rates.shape[-1] :]
    _refuse_departing(jacobian, rates - own, rates)
    found = _least_norm(_along(jacobian, per_input), _along(jacobian, needed[..., None])[..., 0])
    left = needed - np.einsum("...ij,...j->...i", per_input, found)
    multipliers = _least_norm(-np.swapaxes(jacobian, -1, -2), left)
    undone = left + np.einsum("...ij,...i->...j", jacobian, multipliers)
    _refuse_undone(undone, needed, names)
    return InverseDynamics(found, multipliers)


def _check_shapes(model: Model, y: Array, rates: Array) -> None:
    wanted = (*y.shape[:-1], len(model.speeds))
    if rates.shape != wanted:
        raise ValueError(
            f"accelerations must have the shape {wanted}: the rates of "
            f"{', '.join(model.speeds)} at every state; they have {rates.shape}"
        )


def _forces(
    model: Model, y: Array, values: Array, names: tuple[str, ...], t: float | Array
) -> tuple[Array, Array]:
    """F without the inputs (..., nu), and what each adds (..., nu, m)."""
    places = [_place(model, name) for name in names]

    def at(changed: dict[int, float]) -> Array:
        moved = np.array(values)
        moved[..., places] = 1.0
        for place, value in changed.items():
            moved[..., place] = value
        return moved

    ones = model.forcing(y, at({}), t)
    columns = []
    for name, place in zip(names, places, strict=True):
        column = model.forcing(y, at({place: 2.0}), t) - ones
        again = model.forcing(y, at({place: 3.0}), t) - ones
        inertia = model.mass_matrix(y, at({place: 3.0}), t) - model.mass_matrix(y, at({}), t)
        size = np.abs(ones).max(initial=0.0) + np.abs(column).max(initial=0.0)
        if np.abs(again - 2.0 * column).max(initial=0.0) > LINEAR * size or np.any(inertia):
            raise MechcError(
                f"{name} does not act as a force that the equations are linear in; the inputs of "
                "inverse dynamics must"
            )
        if not np.any(column):
            raise MechcError(f"{name} does nothing at these states: it cannot be an input")
        columns.append(column)
    per_input = np.stack(columns, axis=-1)
    return ones - per_input.sum(axis=-1), per_input


def _place(model: Model, name: str) -> int:
    if name not in model.parameters:
        raise UnknownNameError("parameter that could be an input", name, model.parameters)
    return model.parameters.index(name)


def _along(jacobian: Array, columns: Array) -> Array:
    """What of forces is along motions that the constraints leave free."""
    carried = np.linalg.pinv(jacobian, rcond=RANK) @ (jacobian @ columns)
    return np.asarray(columns - carried)


def _least_norm(columns: Array, right: Array) -> Array:
    inverse = np.linalg.pinv(columns, rcond=RANK)
    return np.asarray(np.einsum("...ij,...j->...i", inverse, right))


def _refuse_departing(jacobian: Array, difference: Array, rates: Array) -> None:
    """Accelerations that keep the constraints differ from the motion's own along J x = 0."""
    open_by = np.abs(np.einsum("...ij,...j->...i", jacobian, difference)).max(initial=0.0)
    size = np.abs(jacobian).max(initial=0.0) * np.abs(rates).max(initial=1.0)
    if open_by > KEPT * size:
        raise ValueError(
            f"these accelerations leave the constraints: J u' departs from gamma by {open_by:.3g}. "
            "Take them from a motion that keeps the loops closed (model.assemble closes states; "
            "model.linearize(...).to_state says which rates follow from independent ones)"
        )


def _refuse_undone(undone: Array, needed: Array, names: tuple[str, ...]) -> None:
    largest = np.abs(undone).max(initial=0.0)
    if largest > MADE * np.abs(needed).max(initial=1.0):
        raise MechcError(
            f"{', '.join(names)} cannot make this motion: a generalized force of {largest:.3g} is "
            "left undone. Every direction that the constraints leave free needs an input"
        )
