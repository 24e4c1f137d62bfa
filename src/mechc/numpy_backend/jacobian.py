"""Jacobians of the motion, and of outputs that depend on it, without C.

With R = M u' + J^T lambda - F and S = J u' - gamma: M du' + J^T dlambda = -dR and J du' = -dS.
"""

from __future__ import annotations

import numpy as np

from mechc.numpy_backend.equations import ArrayEquations, Place, State, accelerations, rows_of
from mechc.system.parameters import Array

BY = {"state_jacobian": "state", "parameter_jacobian": "parameters"}
Motion = tuple[Array, Array]  # u' and multipliers


def jacobian(
    name: str, equations: ArrayEquations, state: State, place: Place, motion: Motion
) -> Array:
    """``state_jacobian``, ``parameter_jacobian`` or either with ``own_`` before it, row by row."""
    which = BY[name.removeprefix("own_")]
    response = _response(which, equations, state, place, motion)
    if name.startswith("own_"):
        return _of_own(which, equations, state, motion, response)
    count, columns = len(response), response.shape[2]
    listing = equations.listing
    if f"rate_by_{which}" in listing.written:
        rates = equations.written(f"rate_by_{which}", *state).reshape(count, -1, columns)
    else:
        rates = np.zeros((count, listing.coordinates, columns))
        if which == "state":
            rates[:] = np.eye(listing.coordinates, columns, listing.coordinates)
    both = [rates, response[:, : listing.speeds]]
    return np.concatenate(both, axis=1).reshape(count, -1)


def _response(
    which: str, equations: ArrayEquations, state: State, place: Place, motion: Motion
) -> Array:
    """du' and dlambda (n, nu + nc, columns)."""
    listing, size = equations.listing, equations.listing.speeds
    right = -equations.written(f"residual_by_{which}", *state, motion)
    right = right.reshape(len(place.mass), size + listing.rows, -1)
    rows = rows_of(place) if listing.rows else None
    found = [
        np.hstack(accelerations(place, right[:, :size, k], right[:, size:, k], rows))
        for k in range(right.shape[2])
    ]
    return np.stack(found, axis=2)


def _of_own(
    which: str, equations: ArrayEquations, state: State, motion: Motion, response: Array
) -> Array:
    """User-defined outputs: derivatives at a given motion, and by the motion times its response."""
    count, moving, columns = response.shape
    partials = equations.written(f"own_by_{which}", *state, motion)
    partials = partials.reshape(count, -1, columns + moving)
    whole = partials[:, :, :columns] + partials[:, :, columns:] @ response
    return np.asarray(whole.reshape(count, -1))
