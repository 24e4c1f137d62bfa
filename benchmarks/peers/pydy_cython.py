"""PyDy: Kane's equations as C that it generates and compiles through Cython, integrated by SciPy.

As its ``System`` does: mass matrix and forcing of the speeds apart from the kinematic equations,
the constants in a dictionary, ``odeint`` (LSODA); and by ``solve_ivp`` (DOP853).  The linear
system is solved symbolically, in C with the rest, which is the quickest way that it offers; where
that takes minutes to generate, or elimination in a fixed order does not do, by NumPy.  The rates
of the constraints are rows of the mass matrix.
"""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import sympy

from ..formulations.textbook import TextbookEquations, t, textbook
from ..problems.problem import Array, Problem
from ..timing.cases import Case, grid
from . import Built, NotExpressibleError
from .scipy_ivp import cases

TOOLS = ("PyDy",)
LARGEST_SYMBOLIC = 8  # rows; with nine PyDy's own benchmark takes eight minutes to generate
AGREES = 1e-8  # of the largest rate: more is not rounding
MOST_STEPS = 50_000  # ten times what the suite needs; at change points odeint gets stuck
SUCCESSFUL = "Integration successful."

ByState = Callable[..., Array]


def build(problem: Problem, tolerances: Sequence[float], *, quick: bool = False) -> Built:
    """LSODA, and where the problem is not stiff DOP853.

    Raises
    ------
    ImportError
        Without PyDy or Cython.
    NotExpressibleError
        Where :func:`.textbook` does, where time appears by itself (PyDy's functions have
        it as an input alone), and where what it generates does not compile.
    """
    equations = textbook(problem, "CRAMER")
    _refuse_time(equations)
    start = time.perf_counter()
    by_state, constants = compiled(problem, equations)
    seconds = {"derive": equations.seconds, "compile": time.perf_counter() - start}

    def fresh(time: float, y: Array) -> Array:
        # PyDy gives out one array again and again, which Runge-Kutta methods would keep.
        return by_state(y, time, constants).copy()

    built = Built(_odeint_cases(by_state, constants, problem, tolerances), {TOOLS[0]: seconds})
    built.cases += cases(TOOLS[0], fresh, problem, tolerances, ("DOP853",))
    return built


def compiled(
    problem: Problem, equations: TextbookEquations
) -> tuple[ByState, dict[sympy.Symbol, float]]:
    """The function (x, t, constants) -> x' of PyDy's, and the constants that it takes."""
    constants = dict(zip(equations.constants, map(float, equations.values), strict=True))
    expected = _rates_at_start(problem, equations)
    symbolic = len(equations.u) <= LARGEST_SYMBOLIC
    for solver in ("sympy", "numpy") if symbolic else ("numpy",):
        function = _generated(equations, solver)
        found = function(np.array(problem.given.start), 0.0, constants)
        if np.abs(found - expected).max() <= AGREES * np.abs(expected).max():
            return function, constants
    raise NotExpressibleError("what PyDy generates is not the solution of Kane's equations")


def _generated(equations: TextbookEquations, solver: str) -> ByState:
    """Generated and built in a folder of its own, which PyDy removes."""
    from pydy.codegen.ode_function_generators import generate_ode_function

    try:
        return generate_ode_function(  # type: ignore[no-any-return]
            equations.forcing, list(equations.q), list(equations.u), list(equations.constants),
            mass_matrix=equations.mass_matrix, coordinate_derivatives=equations.q_rates,
            generator="cython", linear_sys_solver=solver, constants_arg_type="dictionary",
        )  # fmt: skip
    except Exception as error:  # PyDy raises nothing more special
        if "Failed to compile" not in str(error):
            raise
        raise NotExpressibleError(f"{error} (PyDy needs a C compiler)") from error


def _rates_at_start(problem: Problem, equations: TextbookEquations) -> Array:
    arguments = [t, *equations.q, *equations.u, *equations.constants]
    full = equations.mass_matrix_full, equations.forcing_full
    M, f = sympy.lambdify(arguments, full, cse=True)(0.0, *problem.given.start, *equations.values)
    rates: Array = np.linalg.solve(M, f).ravel()
    return rates


def _refuse_time(equations: TextbookEquations) -> None:
    state = {x: sympy.Dummy() for x in (*equations.q, *equations.u)}
    for matrix in (equations.mass_matrix_full, equations.forcing_full):
        if t in matrix.xreplace(state).free_symbols:
            raise NotExpressibleError("PyDy's generated functions do not take the time by itself")


def _odeint_cases(
    by_state: ByState, constants: Any, problem: Problem, tolerances: Sequence[float]
) -> list[Case]:
    from scipy.integrate import odeint

    given, span = problem.given, np.array([0.0, problem.t_end])

    def run(_: str, tol: float) -> Any:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return odeint(
                by_state, given.start, span, args=(constants,), rtol=tol, atol=tol,
                mxstep=MOST_STEPS, full_output=True,
            )  # fmt: skip

    return grid(
        TOOLS[0], ("LSODA",), tolerances, run,
        lambda found: given.observe(found[0][-1]) if _succeeded(found) else None,
        lambda found: "finished" if _succeeded(found) else str(found[1]["message"]),
    )  # fmt: skip


def _succeeded(found: Any) -> bool:
    return bool(found[1]["message"] == SUCCESSFUL)
