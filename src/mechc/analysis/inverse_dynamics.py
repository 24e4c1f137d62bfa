"""Inverse dynamics: the inputs that produce a given motion."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from mechc.errors import MechcError, UnknownNameError, ValueOutOfBoundsError
from mechc.inputs.driven_scene import with_inputs
from mechc.system.parameters import Array
from mechc.system.system import System

LINEAR = 1e-9  # of the loads: a larger deviation means that they are not linear in an input
KEPT = 1e-6  # of the accelerations: a larger violation of the constraints is refused
MADE = 1e-6  # of the forces: a larger remainder is refused
RANK = 1e-10


class InverseDynamics(NamedTuple):
    """The inputs and multipliers of a motion.

    inputs : (..., m)
        Values of the inputs, in the order requested; those of least norm where there are more
        than needed.
    multipliers : (..., nc)
        Multipliers of the constraints, of least norm.
    """

    inputs: Array
    multipliers: Array


def inverse_dynamics(
    system: System,
    states: Array,
    rates: Array,
    values: Array,
    names: tuple[str, ...],
    t: float | Array,
) -> InverseDynamics:
    """The inputs r that produce a motion: see :meth:`mechc.Model.inverse_dynamics`."""
    pushed = _ModelWithInputs(system, states, values, names, t)
    still, per_input = pushed.forces()
    driven, at_one = pushed.at({})
    mass = driven.mass_matrix(states, at_one, t)
    needed = np.einsum("...ij,...j->...i", mass, rates) - still
    jacobian = driven.constraint_jacobian(states, at_one, t)
    own = driven.rates(states, at_one, t)[..., -rates.shape[-1] :]
    _refuse_departing(jacobian, rates - own, rates)
    found = _least_norm(_along(jacobian, per_input), _along(jacobian, needed[..., None])[..., 0])
    left = needed - np.einsum("...ij,...j->...i", per_input, found)
    multipliers = _least_norm(-np.swapaxes(jacobian, -1, -2), left)
    undone = left + np.einsum("...ij,...i->...j", jacobian, multipliers)
    for k, name in enumerate(names):
        pushed.refuse_bent(name, per_input[..., k], found[..., k])
    largest = np.abs(undone).max(initial=0.0)
    if largest > MADE * np.abs(needed).max(initial=1.0):
        raise MechcError(
            f"{', '.join(names)} cannot produce this motion: a generalized force of {largest:.3g} "
            "remains. Every direction that the constraints allow needs an input"
        )
    return InverseDynamics(found, multipliers)


@dataclass(frozen=True)
class _ModelWithInputs:
    """The model at given states, with different values of the inputs."""

    system: System
    y: Array
    values: Array
    names: tuple[str, ...]
    t: float | Array

    def at(self, changed: Mapping[str, float]) -> tuple[System, Array]:
        """Model and parameters with every input 1 except those that are changed."""
        chosen = dict.fromkeys(self.names, 1.0) | dict(changed)
        given = {name: value for name, value in chosen.items() if name in self.system.inputs}
        moved = np.array(self.values)
        for name, value in chosen.items():
            if name not in given:
                moved[..., _place(self.system, name)] = value
        return with_inputs(self.system, given), moved

    def _evaluate(self, output: str, changed: Mapping[str, float]) -> Array:
        driven, values = self.at(changed)
        return driven.evaluate(output, self.y, values, self.t)

    def refuse_bent(self, name: str, slope: Array, values: Array) -> None:
        """Raise where loads are not linear up to these values, as beyond a bound of a motor."""
        ones = self._evaluate("forcing", {})
        for value in {float(values.min(initial=1.0)), float(values.max(initial=1.0))}:
            apart = self._evaluate("forcing", {name: value}) - ones - (value - 1.0) * slope
            size = np.abs(ones).max(initial=0.0) + abs(value) * np.abs(slope).max(initial=0.0)
            if np.abs(apart).max(initial=0.0) > LINEAR * size:
                raise MechcError(
                    f"the equations are not linear in {name} up to {value:.6g}, which the motion "
                    "needs, as beyond a motor's bound (effort='saturate')"
                )

    def forces(self) -> tuple[Array, Array]:
        """F with all inputs zero (..., nu), and the change by each (..., nu, m)."""
        ones, columns = self._evaluate("forcing", {}), []
        for name in self.names:
            column = self._evaluate("forcing", {name: 2.0}) - ones
            again = self._evaluate("forcing", {name: 3.0}) - ones
            inertia = self._evaluate("mass_matrix", {name: 3.0}) - self._evaluate("mass_matrix", {})
            size = np.abs(ones).max(initial=0.0) + np.abs(column).max(initial=0.0)
            bent = np.abs(again - 2.0 * column).max(initial=0.0) > LINEAR * size
            if bent or np.any(inertia):
                raise MechcError(
                    f"the equations are not linear in {name}; they must be in the inputs of "
                    "inverse dynamics"
                )
            if not np.any(column):
                raise MechcError(f"{name} has no effect at these states: it cannot be an input")
            columns.append(column)
        if not columns:
            raise ValueOutOfBoundsError("inverse dynamics needs at least one input")
        per_input = np.stack(columns, axis=-1)
        return ones - per_input.sum(axis=-1), per_input


def _place(system: System, name: str) -> int:
    if name not in system.parameters:
        raise UnknownNameError("input or parameter", name, (*system.inputs, *system.parameters))
    return system.parameters.index(name)


def _along(jacobian: Array, columns: Array) -> Array:
    """The part of forces along motions that the constraints allow."""
    carried = _inverse(jacobian) @ (jacobian @ columns)
    return np.asarray(columns - carried)


def _least_norm(columns: Array, right: Array) -> Array:
    return np.asarray(np.einsum("...ij,...j->...i", _inverse(columns), right))


def _inverse(matrix: Array) -> Array:
    """The pseudo-inverse of matrices."""
    try:
        return np.asarray(np.linalg.pinv(matrix, rcond=RANK))
    except np.linalg.LinAlgError:
        raise MechcError("the equations at these states are not finite, or too large") from None


def _refuse_departing(jacobian: Array, difference: Array, rates: Array) -> None:
    """Raise where accelerations that keep the constraints differ from the motion's own."""
    open_by = np.abs(np.einsum("...ij,...j->...i", jacobian, difference)).max(initial=0.0)
    size = np.abs(jacobian).max(initial=0.0) * np.abs(rates).max(initial=1.0)
    if open_by > KEPT * size:
        raise ValueError(
            f"these accelerations violate the constraints: J u' - gamma is {open_by:.3g}. "
            "Take them from a motion that keeps the loops closed (model.assemble closes states; "
            "model.linearize(...).to_state gives the rates that follow from independent ones)"
        )
