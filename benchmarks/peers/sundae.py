"""SUNDIALS through scikit-sundae, on functions of floats that SymPy's lambdify writes with cse.

CVODE integrates the explicit rates, elimination written out, by Adams' and by backward
differentiation formulas.  IDA integrates the equations of index one: of its own accord it has the
multipliers in its error test, which those of index two, stabilised or not, do not pass.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from ..formulations.equations import Equations, consistent, equations_of
from ..problems.problem import Array, Problem
from ..timing.cases import Case
from . import Built, with_tighter

TOOLS = ("scikit-sundae, CVODE", "scikit-sundae, IDA")
# Right runs take some ten thousand steps at the tightest tolerance; one of IDA's takes 0.1 ms.
MOST_STEPS, MOST_OF_IDA = 200_000, 50_000
TIGHTEST = 9e-12  # IDA: beyond it one run takes many seconds


def build(problem: Problem, tolerances: Sequence[float], *, quick: bool = False) -> Built:
    """CVODE by both families of formulas, where the problem is not stiff, and IDA."""
    from sksundae.cvode import CVODE
    from sksundae.ida import IDA

    equations = equations_of(problem)
    built = Built([])
    rhs = built.timed(TOOLS[0], equations, explicit)
    tols = with_tighter(tolerances)
    for method in ("BDF",) if problem.stiff else ("Adams", "BDF"):
        for tol in tols:
            solver = CVODE(rhs, method=method, rtol=tol, atol=tol, max_num_steps=MOST_STEPS)
            built.cases.append(_case(TOOLS[0], method, tol, solver, problem, (equations.start,)))
    residual = built.timed(TOOLS[1], equations, index_one)
    start = consistent_start(equations)
    algebraic = list(range(len(equations.state), len(start[0])))
    for tol in (tol for tol in tols if tol > TIGHTEST):
        solver = IDA(
            residual, rtol=tol, atol=tol, algebraic_idx=algebraic, max_num_steps=MOST_OF_IDA
        )
        built.cases.append(_case(TOOLS[1], "BDF", tol, solver, problem, start))
    return built


def explicit(equations: Equations) -> Callable[[float, Array, Array], None]:
    """CVODE's function: the rates of the state."""
    rates = equations.rates().function("math")

    def rhs(t: float, y: Array, rate: Array) -> None:
        rate[:] = rates(*y.tolist())

    return rhs


def index_one(equations: Equations) -> Callable[[float, Array, Array, Array], None]:
    """IDA's function of q, u, a, lambda: residuals of q', u', the balance of forces, the rows."""
    residual = equations.residual().function("math")
    n, states = len(equations.u), len(equations.state)
    nq = states - n

    def rows(t: float, y: Array, rate: Array, found: Array) -> None:
        values, rates = y.tolist(), rate.tolist()
        state, a, multipliers = values[:states], values[states : states + n], values[states + n :]
        kept = residual(*state, *multipliers, *rates[:nq], *a)
        found[:nq], found[states:] = kept[:nq], kept[nq:]
        found[nq:states] = rate[nq:states] - y[states : states + n]

    return rows


def consistent_start(equations: Equations) -> tuple[Array, Array]:
    """q, u, a, lambda and their rates, those of the algebraic ones zero."""
    accelerations, multipliers = consistent(equations)
    y = np.concatenate([equations.start, accelerations, multipliers])
    rate = np.zeros_like(y)
    rates = equations.rates().function("math")(*equations.start.tolist())
    rate[: len(equations.state)] = rates
    return y, rate


def _case(
    tool: str, method: str, tol: float, solver: Any, problem: Problem, start: tuple[Array, ...]
) -> Case:
    span = np.array([0.0, problem.t_end / 2, problem.t_end])  # of two it would keep every step
    given = problem.given
    size = len(given.start)
    return Case(
        tool, method, tol,
        lambda: solver.solve(span, *start),
        lambda s: given.observe(s.y[-1, :size]) if s.success else None,
        lambda s: "finished" if s.success else str(s.message),
    )  # fmt: skip
