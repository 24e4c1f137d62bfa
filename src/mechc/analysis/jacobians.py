"""Derivatives of the right-hand side, and of outputs of one's own, by compiled code."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from mechc.errors import UnknownNameError
from mechc.inputs.bind import InputSlot
from mechc.system.parameters import Array, Parameters

if TYPE_CHECKING:
    from mechc.model import Model

Time = float | Array


def state_jacobian(
    model: Model, y: Array, params: Parameters = None, t: Time = 0.0, *, of: str | None = None
) -> Array:
    """Derivative of :meth:`Model.rhs` by the state, shape (..., nq + nu, nq + nu).

    Of the rates as they are written down, which off the constraints say what J u' = gamma asks
    for: along the constraints it is the mechanism's own.  Exact: M du' + J^T dlambda
    = -d(M u' + J^T lambda - F), solved by compiled code.  ``of``: instead of an output of one's
    own, shape (..., nq + nu).

    Raises
    ------
    UnavailableOutputError
        If the model was compiled without ``"state_jacobian"``.
    UnknownNameError
        If there is no such output of one's own.
    """
    return _jacobian(model, "state_jacobian", of, y, params, t)


def parameter_jacobian(
    model: Model, y: Array, params: Parameters = None, t: Time = 0.0, *, of: str | None = None
) -> Array:
    """Derivative of :meth:`Model.rhs` by the parameters at a fixed state, (..., nq + nu, np).

    Each parameter by itself: defaults that follow others do not move.  ``of``: instead of an
    output of one's own, shape (..., np).  Raises as :meth:`Model.state_jacobian` does.
    """
    return _jacobian(model, "parameter_jacobian", of, y, params, t)


def input_jacobian(
    model: Model, y: Array, params: Parameters = None, t: Time = 0.0, *, of: str | None = None
) -> Array:
    """Derivative of :meth:`Model.rhs` by the inputs that a run is given, (..., nq + nu, n).

    Columns in the order of :attr:`Model.input_values`; there where ``"state_jacobian"`` is.
    ``of``: instead of an output of one's own, shape (..., n).
    """
    return _jacobian(model, "input_jacobian", of, y, params, t)


def input_values(model: Model) -> tuple[str, ...]:
    """Every input with the rates of it that the equations hold: ``("F", "r", "r'", "r''")``."""
    slots = [InputSlot.from_metadata(data) for data in model._data.get("inputs", ())]
    return tuple(slot.name + "'" * order for slot in slots for order in slot.orders)


def _jacobian(
    model: Model, name: str, of: str | None, y: Array, params: Parameters, t: Time
) -> Array:
    if of is None:
        return model._evaluate(name, y, params, t)
    own = model._data["own"]
    if of not in own:
        raise UnknownNameError("output of one's own", of, own)
    whole = model._evaluate(f"own_{name}", y, params, t)
    return np.ascontiguousarray(whole[..., own.index(of), :])
