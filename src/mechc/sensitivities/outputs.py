"""Derivatives of outputs along a run: by the chain rule, out_y S + out_p."""

from __future__ import annotations

from math import prod
from typing import TYPE_CHECKING, Any

import numpy as np

from mechc.errors import MechcError, UnknownNameError
from mechc.sensitivities.columns import Columns, columns_of
from mechc.sensitivities.history import Sensitivity
from mechc.system.names import name_of
from mechc.system.parameters import Array
from mechc.system.system import SUMS, System

if TYPE_CHECKING:
    from mechc.simulation.trajectory import Trajectory

BY_DIRECTION = ("own_parameter_jacobian", "own_input_jacobian")


def output_sensitivity(
    sol: Trajectory, sensitivity: Sensitivity, output: Any, name: Any, t: Array | None
) -> Array:
    """The derivative of an output, (nt, ...), at the run's times or others.

    By one name, or by a list or tuple of names: their columns are the last axis then.

    Raises :class:`UnknownNameError` for an output or a name that there is not.
    """
    label, several = name_of(output), isinstance(name, (list, tuple))
    places = [_place(sensitivity, each) for each in (name if several else [name])]
    times = sol.t if t is None else np.atleast_1d(np.asarray(t, dtype=np.float64))
    y = sol.y if t is None else sol(times)
    columns = sensitivity.at(times, y)
    found = sum(
        _one(sol, sensitivity, each, times, y, columns) for each in SUMS.get(label, (label,))
    )
    parts = [np.asarray(found)[..., place] for place in places]
    if not several:
        return parts[0]
    alone = [isinstance(place, int) for place in places]  # a name may have several columns
    whole = [part[..., None] if one else part for part, one in zip(parts, alone, strict=True)]
    return np.concatenate(whole, axis=-1)


def _place(sensitivity: Sensitivity, name: Any) -> Any:
    place = sensitivity.columns.places.get(name_of(name))
    if place is None:
        raise UnknownNameError("sensitivity", name_of(name), sensitivity.names)
    return place


def _one(
    sol: Trajectory, sensitivity: Sensitivity, label: str, t: Array, y: Array, columns: Array
) -> Array:
    """All columns of the derivative of one output, (nt, *shape, k)."""
    system = sol.system.differentiable(label)
    states = (*system.coordinates, *system.speeds)
    if label in states:
        return np.asarray(columns[:, states.index(label)])
    rows, shape = _rows(system, label)
    values, own = system.values_of(sol.system, sol.params), sensitivity.columns
    if (system.parameters, system.inputs) != (sol.system.parameters, sol.system.inputs):
        own = columns_of(system, own.names, values, own.held)
    slopes = system.evaluate("own_state_jacobian", y, values, t)[:, rows]
    found = slopes @ columns
    forced = own.of(system, *BY_DIRECTION, y, values, t)
    if forced is not None:
        found = found + forced[:, rows]
    return np.asarray(found.reshape(len(t), *shape, columns.shape[-1]))


def linear_output(
    system: System, label: str, y: Array, values: Array, t: Array, columns: Columns
) -> tuple[Array, Array, Array]:
    """A scalar output of a system that has its derivatives at states, its derivatives by them and
    along columns at fixed states: (n,), (n, nx), (n, k).

    Raises :class:`UnknownNameError` for an output that there is not; :class:`MechcError` for one
    that is no scalar.
    """
    states = (*system.coordinates, *system.speeds)
    if label in states:
        place = states.index(label)
        by_state = np.zeros(y.shape)
        by_state[:, place] = 1.0
        return y[:, place], by_state, np.zeros((len(y), columns.count))
    parts = [_linear(system, one, y, values, t, columns) for one in SUMS.get(label, (label,))]
    value, by_state, given = (sum(each[1:], each[0]) for each in zip(*parts, strict=True))
    return value, by_state, given


def _linear(
    system: System, label: str, y: Array, values: Array, t: Array, columns: Columns
) -> tuple[Array, Array, Array]:
    rows, shape = _rows(system, label)
    if shape != ():
        raise MechcError(f"{label} has several components: an objective needs a single number")
    value = system.evaluate(label, y, values, t).reshape(len(y))
    by_state = system.evaluate("own_state_jacobian", y, values, t)[:, rows[0]]
    given = columns.of(system, *BY_DIRECTION, y, values, t)
    along = np.zeros((len(y), columns.count)) if given is None else given[:, rows[0]]
    return value, by_state, along


def _rows(system: System, label: str) -> tuple[list[int], tuple[int, ...]]:
    """The rows of the Jacobians that hold an output's elements, and the output's shape."""
    known = system.derivative_rows
    if label not in known:
        every = (*system.coordinates, *system.speeds, *SUMS, *known)
        raise UnknownNameError("output with derivatives", label, every)
    rows, shape = known[label]
    assert prod(shape) == len(rows)
    return rows, shape
