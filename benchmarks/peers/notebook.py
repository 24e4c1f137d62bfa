"""SymPy's KanesMethod lambdified and integrated by SciPy, as notebooks do it, and mended.

"SymPy notebook" is the reference notebook's way: ``mass_matrix_full`` and ``forcing_full``
lambdified without cse, the matrix inverted at every evaluation, RK45.  The mended one lets
lambdify share subexpressions and solves with the matrix, by RK45 and DOP853; on stiff problems by
SciPy's implicit methods.  Neither projects.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence

import numpy as np
import sympy
from _affordable import LIMIT, QUICK_LIMIT, Rates, affordable_cases, left_out
from _problem import Array, Problem
from _textbook import TextbookEquations, operations, t, textbook

from peers import Built
from peers.scipy_ivp import IMPLICIT

TOOLS = ("SymPy notebook", "SymPy notebook, mended")
OWN_TOLERANCE = 1e-6  # the reference notebook's
MOST_OPERATIONS = 300_000  # written out: beyond these lambdify takes minutes, a run too


def build(problem: Problem, tolerances: Sequence[float], *, quick: bool = False) -> Built:
    """Both tools; the notebook's own tolerance is among those of the first.

    Raises
    ------
    NotExpressibleError
        Where :func:`_textbook.textbook` does.
    """
    limit = QUICK_LIMIT if quick else LIMIT
    own = sorted({*tolerances, OWN_TOLERANCE}, reverse=True)
    methods = IMPLICIT if problem.stiff else ("RK45", "DOP853")
    built = Built([])
    _add(built, TOOLS[0], problem, "LU", inverting, own, ("RK45",), limit)
    _add(built, TOOLS[1], problem, "CRAMER", solving, tolerances, methods, limit)
    return built


def _add(
    built: Built, tool: str, problem: Problem, solver: str,
    make: Callable[[TextbookEquations], Rates], tolerances: Sequence[float],
    methods: Sequence[str], limit: float,
) -> None:  # fmt: skip
    """A tool's cases, and what it took to set them up."""
    equations = textbook(problem, solver)
    written_out = operations(equations.mass_matrix_full, equations.forcing_full)
    if make is inverting and written_out > MOST_OPERATIONS:
        reason = f"written out, its matrices hold {written_out:.1e} operations"
        built.cases.append(left_out(tool, methods[0], reason, OWN_TOLERANCE))
        return
    start = time.perf_counter()
    rates = make(equations)
    built.setup[tool] = {"derive": equations.seconds, "compile": time.perf_counter() - start}
    built.cases += affordable_cases(tool, rates, problem, tolerances, methods, limit)


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
