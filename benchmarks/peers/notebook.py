"""SymPy's KanesMethod lambdified and integrated by SciPy, as notebooks do it, and mended.

"SymPy notebook" is the reference notebook's way: ``mass_matrix_full`` and ``forcing_full``
lambdified without cse, the matrix inverted at every evaluation, RK45.  The mended one lets
lambdify share subexpressions and solves with the matrix, by RK45 and DOP853; on stiff problems by
SciPy's implicit methods.  Neither projects.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import sympy

from ..formulations.textbook import TextbookEquations, operations, t, textbook
from ..problems.problem import Array, Problem
from ..timing.cases import Case
from . import Built
from .scipy_ivp import IMPLICIT, Rates, cases

TOOLS = ("SymPy notebook", "SymPy notebook, mended")
OWN_TOLERANCE = 1e-6  # the reference notebook's
MOST_OPERATIONS = 300_000  # written out: beyond these lambdify takes minutes, a run too


def build(problem: Problem, tolerances: Sequence[float], *, quick: bool = False) -> Built:
    """Both tools; the notebook's own tolerance is among those of the first.

    Where the notebook's method does not suit the problem, one case has the reason.

    Raises
    ------
    NotExpressibleError
        Where :func:`.textbook` does.
    """
    built = Built([])
    _add_notebook(built, problem, sorted({*tolerances, OWN_TOLERANCE}, reverse=True))
    equations = textbook(problem, "CRAMER")
    rates = built.timed(TOOLS[1], equations, solving)
    methods = IMPLICIT if problem.stiff else ("RK45", "DOP853")
    built.cases += cases(TOOLS[1], rates, problem, tolerances, methods)
    return built


def _add_notebook(built: Built, problem: Problem, tolerances: Sequence[float]) -> None:
    equations = textbook(problem)
    written_out = operations(equations.mass_matrix_full, equations.forcing_full)
    if problem.stiff:
        built.cases.append(left_out("RK45 is explicit and the problem is stiff"))
    elif written_out > MOST_OPERATIONS:
        built.cases.append(left_out(f"its matrices, written out, hold {written_out} operations"))
    else:
        rates = built.timed(TOOLS[0], equations, inverting)
        built.cases += cases(TOOLS[0], rates, problem, tolerances, ("RK45",))


def left_out(reason: str) -> Case:
    """A case of the notebook's that is flagged with the reason instead of run."""

    def run() -> Any:
        raise RuntimeError(f"left out: {reason}")

    return Case(TOOLS[0], "RK45", OWN_TOLERANCE, run, lambda _: None)


def inverting(equations: TextbookEquations) -> Rates:
    """M^-1 f with the matrix inverted, from functions that share nothing."""
    matrices = _lambdified(equations, cse=False)

    def rates(time: float, y: Array) -> Array:
        M, f = matrices(time, *y, *equations.values)
        inverse: Array = np.linalg.inv(M)
        return (inverse @ f).ravel()

    return rates


def solving(equations: TextbookEquations) -> Rates:
    """M x' = f solved, from one function with common subexpressions."""
    matrices, values = _lambdified(equations, cse=True), equations.values.tolist()

    def rates(time: float, y: Array) -> Array:
        M, f = matrices(time, *y.tolist(), *values)
        x: Array = np.linalg.solve(M, f).ravel()
        return x

    return rates


def _lambdified(equations: TextbookEquations, *, cse: bool) -> Callable[..., tuple[Array, Array]]:
    arguments = [t, *equations.q, *equations.u, *equations.constants]
    matrices = equations.mass_matrix_full, equations.forcing_full
    return sympy.lambdify(arguments, matrices, cse=cse)  # type: ignore[no-any-return]
