"""Inverse dynamics: the inputs that make a given motion."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from mechc.errors import MechcError, UnknownNameError
from mechc.system.parameters import Array, Parameters

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
        Names of the inputs (``model.inputs``), or of parameters that are inputs: torques,
        forces; F must be linear in them.
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
    pushed = _Pushed(model, states, values, names, t)
    still, per_input = pushed.forces()
    driven, at_one = pushed.at({})
    mass = driven.mass_matrix(states, at_one, t)
    needed = np.einsum("...ij,...j->...i", mass, rates) - still
    jacobian = driven.constraint_jacobian(states, at_one, t)
    own = driven.rhs(t, states, at_one)[..., -rates.shape[-1] :]
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


@dataclass(frozen=True)
class _Pushed:
    """The model at given states, with the inputs as they are needed."""

    model: Model
    y: Array
    values: Array
    names: tuple[str, ...]
    t: float | Array

    def at(self, changed: Mapping[str, float]) -> tuple[Model, Array]:
        """Model and parameters with every input 1 but for those that are changed."""
        chosen = dict.fromkeys(self.names, 1.0) | dict(changed)
        given = {name: value for name, value in chosen.items() if name in self.model.inputs}
        moved = np.array(self.values)
        for name, value in chosen.items():
            if name not in given:
                moved[..., _place(self.model, name)] = value
        return self.model.with_inputs(given), moved

    def _evaluate(self, output: str, changed: Mapping[str, float]) -> Array:
        driven, values = self.at(changed)
        found: Array = getattr(driven, output)(self.y, values, self.t)
        return found

    def forces(self) -> tuple[Array, Array]:
        """F without the inputs (..., nu), and what each adds (..., nu, m)."""
        ones, columns = self._evaluate("forcing", {}), []
        for name in self.names:
            column = self._evaluate("forcing", {name: 2.0}) - ones
            again = self._evaluate("forcing", {name: 3.0}) - ones
            inertia = self._evaluate("mass_matrix", {name: 3.0}) - self._evaluate("mass_matrix", {})
            size = np.abs(ones).max(initial=0.0) + np.abs(column).max(initial=0.0)
            bent = np.abs(again - 2.0 * column).max(initial=0.0) > LINEAR * size
            _refuse_input(name, bool(bent or np.any(inertia)), not np.any(column))
            columns.append(column)
        per_input = np.stack(columns, axis=-1)
        return ones - per_input.sum(axis=-1), per_input


def _refuse_input(name: str, bent: bool, idle: bool) -> None:
    if bent:
        raise MechcError(
            f"{name} does not act as a force that the equations are linear in; the inputs of "
            "inverse dynamics must"
        )
    if idle:
        raise MechcError(f"{name} does nothing at these states: it cannot be an input")


def _place(model: Model, name: str) -> int:
    if name not in model.parameters:
        raise UnknownNameError("input or parameter", name, (*model.inputs, *model.parameters))
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
