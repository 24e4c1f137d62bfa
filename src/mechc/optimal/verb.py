"""The verb of a model that finds motions with the least cost."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from mechc.progress import Notice
from mechc.simulation.settings import checked_count, checked_policy
from mechc.system.names import checked_word
from mechc.system.parameters import Array, Parameters

if TYPE_CHECKING:
    from mechc.optimal.result import Optimum
    from mechc.outputs import Outputs


def optimise(
    model: Outputs,
    duration: Any,
    y0: Array | Mapping[Any, float],
    controls: Mapping[Any, Any] | None = None,
    params: Parameters = None,
    *,
    integral: Any = None,
    final: Any = None,
    end: Mapping[Any, Any] | None = None,
    bounds: Mapping[Any, Any] | None = None,
    free: Mapping[Any, Any] | None = None,
    inputs: Mapping[Any, Any] | None = None,
    guess: Mapping[Any, float] | None = None,
    t0: float = 0.0,
    intervals: int = 40,
    kind: str = "linear",
    begin: str = "auto",
    starts: int = 1,
    seed: int = 0,
    events: Sequence[Any] = (),
    rtol: float = 1e-9,
    method: str = "auto",
    solver: str = "auto",
    tol: float = 1e-8,
    max_iterations: int = 1000,
) -> Optimum:
    """The motion with the least cost, its inputs, parameters, start and duration found.

    ``model.optimise((0.5, 5), [0, 0], {"F": (-1, 1)}, final="duration", end={"x": 1, "v": 0})``

    By multiple shooting with the exact derivatives of motions through loops, events and
    impacts; every motion is on the closed loops.  A local minimum is found, that near the first
    values.  Expressions, typed or of SymPy, are over ``t``, coordinates, speeds, inputs,
    parameters, outputs (``"energy"``, ``"points[2,0]"``) and ``duration``.

    Parameters
    ----------
    duration
        Of the motion, s, or its bounds ``(lower, upper)``, where it is found; the search begins
        with their mean.
    y0
        The start, as in :meth:`simulate`; a mapping is assembled.
    controls
        Inputs that are found, ``{"F": (-10, 10)}``, each with bounds, or None.
    params, inputs
        As in :meth:`simulate`; the values of what is found are those that the search begins
        with: of an input a number (by default 0) or a signal, of which the form counts.
    integral, final
        The cost: an expression that is integrated over the motion, and one at its end.
    end
        Conditions at the end: coordinate, speed or expression -> a value, or bounds.
    bounds
        Conditions along the motion, likewise, at the ends of all intervals; the report tells by
        how much they are exceeded between these.
    free
        Parameters, coordinates and speeds of the start that are found, with bounds or None for
        those of the model.  Parameters not given whose defaults follow them follow them.
    guess
        Coordinates near the assembly wanted, as in :meth:`assemble`.
    t0
        When the motion begins, s.
    intervals, kind
        The inputs are ``"linear"`` between so many equal intervals, or constant in each:
        ``"previous"``.
    begin
        The states that the search begins with: on a ``"line"`` to those known at the end, or on
        the ``"motion"`` with the first values; by default on a line if any is known and there
        are no events.
    starts, seed
        How many searches begin, all but the first at values spread between finite bounds.
    events, rtol, method
        As in :meth:`simulate`.
    solver
        ``"ipopt"``, of the package casadi, or ``"slsqp"``, of SciPy; by default the first, if
        it is installed.
    tol, max_iterations
        When a search ends: IPOPT's ``tol``, SLSQP's ``ftol``, and the most iterations.

    Returns
    -------
    Optimum
        ``cost``, ``signals``, ``values``, ``duration``, ``solution``, ``converged``; it prints
        as a report.  Where nothing was found it has what was nearest, and says so.

    Raises
    ------
    MechcError
        If time drives the motion and the duration is free; if a derivative does not exist.
    AssemblyError
        If there is no motion to begin with.
    UnknownNameError, ValueOutOfBoundsError, ExpressionError
        For names, bounds and expressions that there cannot be.
    MissingPackageError
        For IPOPT without casadi.
    """
    from mechc.optimal.find import optimise
    from mechc.optimal.question import Question
    from mechc.optimal.solvers import SearchSettings

    checked_policy(model.system, rtol=rtol, method=method)
    asked = Question(
        duration, y0, controls, params, inputs, guess, integral, final, end, bounds, free, t0,
        checked_count("intervals", intervals),
        checked_word("kind of signal", kind, ("linear", "previous")),
        {"events": events, "rtol": rtol, "method": method},
    )  # fmt: skip
    search = SearchSettings.of(solver, tol, max_iterations, starts, seed)
    begin = checked_word("begin", begin, ("auto", "line", "motion"))
    with Notice(f"searching the motion of {model.name} with the least cost ..."):
        return optimise(model, asked, begin, search)
