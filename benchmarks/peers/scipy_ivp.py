"""SciPy's solve_ivp on code that SymPy's lambdify writes, with common subexpressions and without.

With cse: one straight-line function of floats, elimination included, which is the quickest that
lambdify gives (NumPy takes longer on so few numbers).  Without: the matrices lambdified for NumPy
entry by entry, and solved with at every evaluation, as most scripts have it.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import sympy

from ..formulations.equations import Equations, equations_of
from ..problems.problem import Array, Problem
from ..timing.cases import Case, grid
from . import Built

TOOLS = ("SciPy, cse", "SciPy, no cse")
METHODS = ("RK45", "DOP853", "LSODA", "Radau")
IMPLICIT = ("LSODA", "Radau")  # alone on stiff problems
TIGHTEST = {"RK45": 9e-9, "Radau": 9e-7}  # beyond these one run takes seconds

Rates = Callable[[float, Array], Any]


def build(problem: Problem, tolerances: Sequence[float], *, quick: bool = False) -> Built:
    """Every method on both forms; ``quick`` has no cases without cse at tight tolerances."""
    equations = equations_of(problem)
    built = Built([])
    for tool, make in zip(TOOLS, (with_cse, without_cse), strict=True):
        rates = built.timed(tool, equations, make)
        few = quick and make is without_cse
        tols = [tol for tol in tolerances if tol > 1e-7] if few else tolerances
        built.cases += cases(tool, rates, problem, tols)
    return built


def with_cse(equations: Equations) -> Rates:
    """q' and u' as one function of floats."""
    fast = equations.rates().function("math")
    return lambda t, y: fast(*y.tolist())


def without_cse(equations: Equations) -> Rates:
    """Matrices as they were derived, put together and solved with by NumPy."""
    e, n, m = equations, len(equations.u), len(equations.velocity)
    matrices = [sympy.Matrix(e.q_rates), e.M, e.F, *((e.J, e.gamma) if m else ())]
    function = sympy.lambdify(e.state, matrices, "numpy")
    A, b = np.zeros((n + m, n + m)), np.zeros(n + m)

    def rates(t: float, y: Array) -> Array:
        q_rates, A[:n, :n], F, *rows = function(*y)
        b[:n] = F[:, 0]
        if m:
            J, gamma = rows
            A[n:, :n], A[:n, n:], b[n:] = J, J.T, gamma[:, 0]
        return np.concatenate([q_rates[:, 0], np.linalg.solve(A, b)[:n]])

    return rates


def cases(
    tool: str, rates: Rates, problem: Problem, tolerances: Sequence[float],
    methods: Sequence[str] = METHODS,
) -> list[Case]:  # fmt: skip
    """solve_ivp by each method at each tolerance, relative and absolute."""
    from scipy.integrate import solve_ivp

    given = problem.given

    def run(method: str, tol: float) -> Any:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return solve_ivp(
                rates, (0, problem.t_end), given.start, method=method, rtol=tol, atol=tol
            )

    every = grid(
        tool, methods, tolerances, run, lambda s: given.observe(s.y[:, -1]) if s.success else None,
        lambda s: "finished" if s.success else s.message,
    )  # fmt: skip
    return [
        case for case in every
        if (case.method in IMPLICIT or not problem.stiff)
        and case.tol >= TIGHTEST.get(case.method, 0.0)
    ]  # fmt: skip
