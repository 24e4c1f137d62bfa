"""The motion of a case in 50 digits, from the equations that SymPy's KanesMethod forms: the third
way, where the two runs of the judge end apart.

The rod that is redundant is left out; multipliers by elimination; Gragg's extrapolation.
"""

from __future__ import annotations

import mpmath
import numpy as np
from mpmath import mpf

from ..formulations.equations import derive
from ..references.arithmetic import FUNCTIONS, Vector, numbers, of_mpmath
from ..references.extrapolation import by_extrapolation
from ..timing.cases import Array
from .draw import Case
from .scenes import TOPOLOGIES, mechanism

LONGEST = "0.02"  # s
ROUNDS = 8  # of Newton's method from a start that is closed in doubles


class Cranks:
    """A case's cranks and its rods that are not redundant."""

    def __init__(self, case: Case) -> None:
        count, rods = TOPOLOGIES[case.topology]
        equations = derive(mechanism(case.topology, count, rods[: count - 1]), {})
        parameters = [mpf(case.params[p.name]) for p in equations.parameters]
        given, rates = numbers(parameters), equations.rates().function(FUNCTIONS)
        closing = equations.constraints().function(FUNCTIONS)
        entries = equations.entries().function(FUNCTIONS)
        self.size, self.loops = count, len(equations.position)
        self.rates = lambda y: rates(*y, *given)
        self.residual = lambda y: closing(*y, *parameters)
        self.matrices = lambda y: equations.matrices(entries(*y, *parameters))

    def rows(self, y: Vector) -> mpmath.matrix:
        """The Jacobian of the rods' constraints."""
        J = self.matrices(y)[3]
        return mpmath.matrix([J[k : k + self.size] for k in range(0, len(J), self.size)])

    def closed(self, y: Vector) -> Vector:
        """The nearest state with closed loops."""
        q, u = y[: self.size], y[self.size :]
        for _ in range(ROUNDS):
            q = self._stepped(q, [*q, *u], self.residual([*q, *u])[: self.loops])
        return [*q, *self._stepped(u, [*q, *u], self.residual([*q, *u])[self.loops :])]

    def _stepped(self, x: Vector, y: Vector, gaps: Vector) -> Vector:
        """Moved by the shortest step that closes the gaps."""
        rows = self.rows(y)
        step = rows.T * mpmath.lu_solve(rows * rows.T, mpmath.matrix(gaps))
        return [a - b for a, b in zip(x, step, strict=True)]


def end(case: Case, y0: Array) -> Array:
    """The state at the end, rounded."""
    cranks = Cranks(case)
    start = cranks.closed([mpf(float(x)) for x in y0])
    (last,) = by_extrapolation(cranks.rates, numbers(start), [case.t_end], LONGEST)
    return np.array([of_mpmath(x) for x in last], float)
