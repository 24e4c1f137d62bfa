"""The verbs of a model that multiply by derivatives of its motions."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from mechc.system.parameters import Array, Parameters

if TYPE_CHECKING:
    from mechc.outputs import Outputs


def jvp(
    model: Outputs,
    t: Any,
    y0: Array | Mapping[Any, float],
    params: Parameters = None,
    *,
    along: Mapping[Any, Any],
    t0: float = 0.0,
    inputs: Mapping[str, Any] | None = None,
    rtol: float = 1e-9,
    method: str = "auto",
) -> tuple[Array, Array]:
    """States at times, and their derivative along a direction.

    Parameters
    ----------
    t
        A time, or times (nt,) that rise, s.
    y0, params, inputs, rtol, method
        As in :meth:`simulate`.
    along
        The direction: name -> its rate.  Names as in ``sensitivities`` of :meth:`simulate`;
        ``"y0"`` has a rate (nq + nu,).
    t0
        When the motion begins, s.

    Returns
    -------
    y, dy : (nq + nu,) or (nt, nq + nu)

    Raises
    ------
    MechcError
        If the motion does not reach its end, or a derivative does not exist; and what
        :meth:`simulate` raises.
    """
    from mechc.differentiable.motion import jvp

    model = model if inputs is None else model.with_inputs(inputs)
    return jvp(model, t, y0, params, along, t0, {"rtol": rtol, "method": method})


def vjp(
    model: Outputs,
    t: Any,
    y0: Array | Mapping[Any, float],
    params: Parameters = None,
    *,
    by: Sequence[Any],
    t0: float = 0.0,
    inputs: Mapping[str, Any] | None = None,
    rtol: float = 1e-9,
    method: str = "auto",
) -> tuple[Array, Callable[[Any], dict[str, Any]]]:
    """States at times, and a function that pulls gradients back.

    ``y, pull = model.vjp(t, y0, params, by=["l_3"])``; ``pull(w)["l_3"]`` is the derivative of
    sum(w * y) by l_3, for w of the shape of y.  At a single time by the adjoint of the steps,
    whose cost hardly grows with the number of names.  Arguments and errors as in :meth:`jvp`.
    """
    from mechc.differentiable.motion import vjp

    model = model if inputs is None else model.with_inputs(inputs)
    return vjp(model, t, y0, params, by, t0, {"rtol": rtol, "method": method})
