"""Derivatives of the right-hand side, and of user-defined outputs, by compiled code."""

from __future__ import annotations

import numpy as np

from mechc.errors import UnknownNameError
from mechc.system.parameters import Array
from mechc.system.system import System, Time


def jacobian(
    system: System, by: str, y: Array, p: Array, t: Time = 0.0, of: str | None = None
) -> Array:
    """Derivatives ``by`` ``"state"``, ``"parameter"`` or ``"input"``: (..., nq + nu, n).

    ``of``: of a user-defined output instead of the right-hand side, (..., n).

    Raises
    ------
    UnavailableOutputError
        If the model was compiled without them.
    UnknownNameError
        If there is no such user-defined output.
    """
    name = f"{by}_jacobian"
    if of is None:
        return system.evaluate(name, y, p, t)
    own = system.data["own"]
    if of not in own:
        raise UnknownNameError("user-defined output", of, own)
    whole = system.evaluate(f"own_{name}", y, p, t)
    return np.ascontiguousarray(whole[..., own.index(of), :])


def input_values(system: System) -> tuple[str, ...]:
    """Names of inputs and their derivatives in the equations: ``("F", "r", "r'", "r''")``."""
    slots = system.data.get("inputs", ())
    return tuple(slot["name"] + "'" * order for slot in slots for order in slot["orders"])
