"""Equations for differential-algebraic solvers: index one, and a consistent start.

State q, u; algebraic a and lambda: q' = N u, u' = a, M a + J^T lambda = F, J a = gamma.  With a
among the unknowns the multipliers are a smooth function of the state.  In the shorter form, with
u' itself in the balance of forces, a solver's u' carries the rounding of u over the step, which
the multipliers inherit and the error test sees: that takes a hundred times as many evaluations.
"""

from __future__ import annotations

import numpy as np

from ..problems.problem import Array
from .equations import Equations


def consistent(equations: Equations) -> tuple[Array, Array]:
    """(n,) accelerations and (m,) multipliers at the start; the least where rows are redundant."""
    n, m = len(equations.u), len(equations.velocity)
    values = equations.entries().function("math")(*equations.start.tolist())  # type: ignore[union-attr]
    _, M, F, J, gamma = (np.array(part, float) for part in equations.matrices(values))
    J = J.reshape(m, n)
    A = np.block([[M.reshape(n, n), J.T], [J, np.zeros((m, m))]])
    found = np.linalg.lstsq(A, np.concatenate([F, gamma]), rcond=None)[0]
    return found[:n], found[n:]
