"""Fits to recordings, cycles, products with derivatives of motions: their part of the face."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from mechc.simulation.settings import checked_count, checked_policy, checked_positive
from mechc.syntheses import Syntheses
from mechc.system.names import checked_word, owned
from mechc.system.parameters import Array, Parameters

if TYPE_CHECKING:
    from mechc.fitting.result import FitResult
    from mechc.optimal.result import Optimum
    from mechc.periodic.cycle import Cycle


class Fits(Syntheses):
    """Outputs, configurations and syntheses, and what follows from the derivatives of motions."""

    def fit(
        self,
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
            with.  A list of y0 or inputs has one for each recording.  Without y0 the start is the
            model's own.  What is free and not given begins at its first sample, at its default, or
            between its bounds.
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

        checked_policy(
            self.system, rtol=rtol, atol=None, method=method, first_step=None, max_step=math.inf,
            max_steps=1, dense=True, on_change_point="continue",
        )  # fmt: skip
        settings = Settings(starts, refined, loss, f_scale, tol, max_evaluations, seed)
        return fit(
            self, measurements, free, measured, params=params, y0=y0, guess=guess, inputs=inputs,
            t0=t0, shared=shared, confidence=confidence, settings=settings,
            policy={"rtol": rtol, "method": method}, progress=progress,
        )  # fmt: skip

    def jvp(
        self,
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

        model = self if inputs is None else self.with_inputs(inputs)
        return jvp(model, t, y0, params, along, t0, {"rtol": rtol, "method": method})

    def vjp(
        self,
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

        model = self if inputs is None else self.with_inputs(inputs)
        return vjp(model, t, y0, params, by, t0, {"rtol": rtol, "method": method})

    def periodic(
        self,
        y0: Array | Mapping[Any, float],
        period: Any,
        params: Parameters = None,
        *,
        hold: Sequence[Any] = (),
        advance: Mapping[Any, Any] | None = None,
        t0: float = 0.0,
        inputs: Mapping[str, Any] | None = None,
        events: Sequence[Any] = (),
        rtol: float = 1e-10,
        method: str = "auto",
        tol: float = 1e-7,
        max_iterations: int = 40,
    ) -> Cycle:
        """The cycle near a guess: a motion that is after a period where it began.

        By shooting, with the exact derivatives of motions through loops, events and resets, and
        Newton's method; every iterate closes the loops.  Where time is in nothing that moves the
        mechanism (tried by a motion that begins later), the period is unknown and ``period`` a
        guess; else it is what drives the motion that gives it.

        Parameters
        ----------
        y0
            A state near the cycle, as in :meth:`simulate`.
        period
            In s: a number, a text with a unit, or, where parameters determine it, an expression of
            these, ``"2*pi/Omega"``.  A whole number of periods of what drives the motion.
        hold
            What stays as in y0: names of coordinates and speeds, ``"energy"``, ``"period"``.  A
            motion that conserves its energy has a cycle for each value of it: without ``hold`` the
            nearest is found.
        advance
            What coordinates grow by in a period, ``{"theta_0": "360deg"}``; None for one that need
            not return: ``{"x": None}`` of what walks.  By default nothing, but the whole turns
            that angles make in the first motion.
        t0
            When the period begins, s.
        inputs, events, rtol, method, params
            As in :meth:`simulate`.
        tol
            The largest return error tolerated, as ``cycle.closure``; it is as a rule much smaller.
        max_iterations
            The most steps of Newton's method.

        Returns
        -------
        Cycle
            ``y0``, ``period``, ``solution``, ``multipliers``, ``stable``; it prints as a table.
            ``follow`` continues it through a parameter, ``basin`` tells which starts lead to it.

        Raises
        ------
        MechcError
            If no cycle is found, with how near the best motion came.
        ValueOutOfBoundsError
            If what drives the motion does not repeat after the period; and what :meth:`simulate`
            raises.
        """
        from mechc.periodic.find import periodic

        run = {"inputs": owned(inputs), "events": owned(events), "rtol": rtol, "method": method}
        return periodic(
            self, y0, period, params, t0=t0, hold=hold, advance=advance, run=run,
            tol=checked_positive("tol", tol), most=checked_count("max_iterations", max_iterations),
        )  # fmt: skip

    def optimise(
        self,
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
            How many searches begin, all but the first at values drawn between finite bounds.
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

        checked_policy(
            self.system, rtol=rtol, atol=None, method=method, first_step=None, max_step=math.inf,
            max_steps=1, dense=True, on_change_point="continue",
        )  # fmt: skip
        asked = Question(
            duration, y0, controls, params, inputs, guess, integral, final, end, bounds, free, t0,
            checked_count("intervals", intervals),
            checked_word("kind of signal", kind, ("linear", "previous")),
            {"events": events, "rtol": rtol, "method": method},
        )  # fmt: skip
        search = SearchSettings.of(solver, tol, max_iterations, starts, seed)
        return optimise(
            self, asked, checked_word("begin", begin, ("auto", "line", "motion")), search
        )
