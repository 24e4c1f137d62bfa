"""The verb of a model that finds the inputs of a motion that is prescribed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from mechc.errors import ValueOutOfBoundsError
from mechc.system.names import names_of
from mechc.system.parameters import Array, Parameters, doubles

if TYPE_CHECKING:
    from mechc.analysis.inverse_dynamics import InverseDynamics
    from mechc.outputs import Outputs
    from mechc.prescribed.result import PrescribedMotion


def inverse_dynamics(
    model: Outputs,
    y: Array | None = None,
    accelerations: Array | None = None,
    params: Parameters = None,
    *,
    path: Mapping[Any, Any] | None = None,
    inputs: Sequence[str] | None = None,
    t: float | Array = 0.0,
    guess: Mapping[Any, float] | None = None,
) -> InverseDynamics | PrescribedMotion:
    """The inputs r with which M u' + J^T lambda = F(r), for given states or along a path.

    ``model.inverse_dynamics(y, accelerations, t=sol.t)``, or
    ``model.inverse_dynamics(path={"x": "0.3*cos(t)", "y": (times, values)}, t=times)``.

    Parameters
    ----------
    y : (..., nq + nu)
        States on the constraints.
    accelerations : (..., nu)
        The speeds' rates u', which must keep the constraints.
    params
        As in all outputs, one set with a path; the values of the inputs are ignored.
    path
        In place of states: what each freedom does.  Coordinates and numbers of points
        (``"points[2,0]"``), as many as the mechanism has freedoms -> an expression of t as text or
        of SymPy, samples ``(times, values)`` (joined by a cubic spline), a :class:`mechc.Signal`, a
        spline of SciPy, a tuple of three functions of t (value, rate, second rate), or a number.
        The others follow: positions by Newton's method, speeds and accelerations exactly.
    inputs
        Names of the inputs, by default those of ``model.inputs`` that have no value, all if
        every one has, or of parameters that are inputs: torques, forces; F must be linear in
        them.  Their own values are ignored, and need not be given.
    t
        Time or times (...); along a path times (nt,) that rise.
    guess
        With a path: coordinates near the assembly wanted at the first time.

    Returns
    -------
    InverseDynamics or PrescribedMotion
        ``inputs`` (..., m) and ``multipliers`` (..., nc); along a path also ``y``,
        ``accelerations``, ``signals()`` for :meth:`simulate`, and ``plot()``.

    Raises
    ------
    ValueError
        If the shapes do not fit, or the accelerations do not keep the constraints.
    MechcError
        If the equations are not linear in an input, or it changes the inertia or has no effect;
        if the inputs cannot produce this motion, with the largest force that remains.  If a path
        leaves the reach of the mechanism, or comes to a singular position: with when and where.
    AssemblyError
        If there is no configuration at the begin of a path.
    UnknownNameError, ValueOutOfBoundsError
        If there is no such parameter; for a path that is none.
    """
    from mechc.analysis.inverse_dynamics import inverse_dynamics
    from mechc.prescribed.find import along_path

    named = _named_inputs(model, inputs)
    if path is not None:
        if y is not None or accelerations is not None:
            raise ValueOutOfBoundsError("give states and accelerations, or a path, not both")
        return along_path(model, path, params, named, t, guess or {})
    if y is None or accelerations is None:
        raise ValueOutOfBoundsError("give states and accelerations, or a path")
    if guess is not None:
        raise ValueOutOfBoundsError("a guess is for a path: states are given")
    _, states, p = model._for_outputs((), y, params)
    rates = doubles(accelerations, "accelerations")
    wanted = (*states.shape[:-1], len(model.speeds))
    if rates.shape != wanted:
        raise ValueError(
            f"accelerations must have the shape {wanted}: the rates of "
            f"{', '.join(model.speeds)} at every state; they have {rates.shape}"
        )
    if not (np.isfinite(rates).all() and np.isfinite(states).all()):
        raise ValueOutOfBoundsError("states and accelerations must be finite")
    return inverse_dynamics(model.system, states, rates, p, named, t)


def _named_inputs(model: Outputs, inputs: Sequence[str] | None) -> tuple[str, ...]:
    """The names of the inputs that are solved for."""
    driven = model.system.driven
    open_inputs = [] if driven is None else [n for n in model.inputs if n not in driven.given]
    wanted_inputs = open_inputs or model.inputs if inputs is None else inputs
    named = tuple(names_of(wanted_inputs))
    if not named:
        raise ValueOutOfBoundsError(
            "which forces or torques make the motion? This model has no inputs: name "
            "parameters that are loads, inputs=['T']"
        )
    return named
