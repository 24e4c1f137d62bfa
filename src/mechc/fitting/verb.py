"""The verb of a model that finds values from recordings."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import nullcontext
from typing import TYPE_CHECKING, Any

from mechc.progress import Notice
from mechc.simulation.settings import checked_policy
from mechc.system.parameters import Parameters

if TYPE_CHECKING:
    from mechc.fitting.result import FitResult
    from mechc.outputs import Outputs


def fit(
    model: Outputs,
    measurements: Any,
    free: Mapping[Any, Any] | Sequence[Any],
    measured: Any = None,
    *,
    params: Parameters = None,
    y0: Any = None,
    guess: Mapping[Any, float] | None = None,
    inputs: Any = None,
    t0: float | None = None,
    shared: Sequence[Any] = (),
    starts: int = 1,
    refined: int = 4,
    loss: Any = "linear",
    f_scale: float = 1.0,
    confidence: float = 0.95,
    rtol: float = 1e-9,
    method: str = "auto",
    tol: float = 1e-8,
    max_evaluations: int | None = None,
    seed: int = 0,
    progress: Callable[[float, str], None] | None = None,
) -> FitResult:
    """Values with which motions agree with recordings, by least squares with exact slopes.

    Outputs that the model was not compiled with are compiled first; the motions are then those
    of the wider code, which may differ from others in rounding.

    Parameters
    ----------
    measurements
        A recording, or a list of several: ``(times, values)`` with values (nt, k), or columns
        by name with the times as ``"t"`` or ``"time"``: a mapping, an ``xarray.Dataset``, a
        table of pandas.  Times in s, rising; a missing sample is NaN.
    free
        What is found: parameters, coordinates and speeds of the start, inputs that are numbers,
        each with its bounds ``(lower, upper)``, in SI units or with one, or None for those of
        the model; names alone, where all have these.  A start is found for each recording by
        itself.
    measured
        What was measured: ``{name: standard deviation of its noise}``; names alone where the
        noise is not known; by default every column that the model knows.  Coordinates, speeds,
        ``"energy"``, and numbers of outputs: ``"points[2,0]"``.
    params, y0, inputs
        As in :meth:`simulate`; the values of what is free are those that the search begins
        with.  A list of y0 or inputs has one for each recording.  Without y0 coordinates and
        speeds begin at their first samples, and at the model's own start where they were not
        measured or ``t0`` is given; what begins in motion, or noisily, is better free.  What is
        free and not given begins at its first sample, at its default, or between its bounds.
    guess
        Coordinates near the assembly wanted, as in :meth:`assemble`.
    t0
        When the motions begin, s; by default at the first time of each recording.
    shared
        Starts that are the same in all recordings.
    starts, refined, seed
        How many points the search begins at: the first one, and others spread between the
        bounds (Sobol's sequence).  They are screened in one batch; the best are ``refined``.
    loss, f_scale
        As in ``scipy.optimize.least_squares``: ``"linear"``, ``"soft_l1"``, ``"huber"``,
        ``"cauchy"``, ``"arctan"``, for residuals in units of sigma.
    confidence
        Probability of the intervals.
    rtol, method
        As in :meth:`simulate`.
    tol, max_evaluations
        When the search ends: SciPy's ``ftol = xtol = gtol``, and ``max_nfev``.
    progress
        Called now and then with the fraction done and a note.

    Returns
    -------
    FitResult
        Values, covariance, intervals, what the data leave open, residuals; see docs/fitting.md.

    Raises
    ------
    UnavailableOutputError
        If the model cannot be compiled with sensitivities: its description is not at hand.
    UnknownNameError, ValueOutOfBoundsError, MechcError
        For wrong names, bounds, units, shapes; too few samples.
    AssemblyError, MechcError
        If no motion can be computed where the search begins; if a derivative does not exist.
    RunInterrupt
        At Ctrl-C, a KeyboardInterrupt: ``error.fit`` is the result at the best values tried.
    """
    from mechc.fitting.fit import fit
    from mechc.fitting.search import Settings

    checked_policy(model.system, rtol=rtol, method=method)
    settings = Settings(starts, refined, loss, f_scale, tol, max_evaluations, seed)
    with nullcontext() if progress else Notice(f"fitting {model.name} ..."):
        return fit(
            model, measurements, free, measured, params=params, y0=y0, guess=guess, inputs=inputs,
            t0=t0, shared=shared, confidence=confidence, settings=settings,
            policy={"rtol": rtol, "method": method}, progress=progress,
        )  # fmt: skip
