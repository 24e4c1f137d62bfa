"""Derivatives of outputs along a run: by the chain rule, out_y S + out_p."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from mechc.errors import UnknownNameError
from mechc.sensitivities.columns import Columns, columns_of
from mechc.sensitivities.history import Sensitivity
from mechc.system.names import name_of
from mechc.system.parameters import Array
from mechc.system.quantities import Quantity, outputs_in, quantities_of, rows_of, slopes_of
from mechc.system.system import System

if TYPE_CHECKING:
    from mechc.simulation.trajectory import Trajectory

BY_DIRECTION = ("own_parameter_jacobian", "own_input_jacobian")


def output_sensitivity(
    sol: Trajectory, sensitivity: Sensitivity, output: Any, name: Any, t: Array | None
) -> Array:
    """The derivative of an output or a number of it, (nt, ...), at the run's times or others.

    By one name, or by a list or tuple of names: their columns are the last axis then.

    Raises :class:`UnknownNameError` for an output or a name that there is not.
    """
    several = isinstance(name, (list, tuple))
    places = [_place(sensitivity, each) for each in (name if several else [name])]
    times = sol.t if t is None else np.atleast_1d(np.asarray(t, dtype=np.float64))
    y = sol.y if t is None else sol(times)
    columns = sensitivity.at(times, y)
    system = sol.system.differentiable(*outputs_in([output]))
    shape, numbers = quantities_of(system, output, differentiable=True)
    own, values = sensitivity.columns, system.values_of(sol.system, sol.params)
    if (system.parameters, system.inputs) != (sol.system.parameters, sol.system.inputs):
        own = columns_of(system, own.names, values, own.held)
    if numbers[0].of_state:
        found = columns[:, numbers[0].entry]
    else:
        by_state, given = linear(system, numbers, y, values, times, own)
        found = (by_state @ columns + given).reshape(len(times), *shape, columns.shape[-1])
    parts = [found[..., place] for place in places]
    if not several:
        return np.asarray(parts[0])
    alone = [isinstance(place, int) for place in places]  # a name may have several columns
    whole = [part[..., None] if one else part for part, one in zip(parts, alone, strict=True)]
    return np.concatenate(whole, axis=-1)


def _place(sensitivity: Sensitivity, name: Any) -> Any:
    place = sensitivity.columns.places.get(name_of(name))
    if place is None:
        raise UnknownNameError("sensitivity", name_of(name), sensitivity.names)
    return place


def linear(
    system: System, quantities: Sequence[Quantity], y: Array, values: Array, t: Array,
    columns: Columns,
) -> tuple[Array, Array]:  # fmt: skip
    """Derivatives of quantities of a system that has these: by states (n, m, nx), and along columns
    at fixed states (n, m, k)."""
    by_state = slopes_of(quantities, "state", system, y, values, t)
    given = columns.of(system, *BY_DIRECTION, y, values, t)
    if given is None:
        return by_state, np.zeros((len(y), len(quantities), columns.count))
    return by_state, rows_of(quantities, system, given)
