"""heyoka's batch integrator and compiled function on the regular four-bar, and its equations.

It integrates the index-1 equations without projection, its lanes across trajectories; they are
written down by hand, reduced to one division by the inertia, which is the best form it can get.
"""

from __future__ import annotations

import sys
import time
from typing import Any

import numpy as np

Array = Any


def explicit_equations(hy: Any) -> tuple[list[Any], list[Any], Any]:
    """State variables, their rates, and the parameter l_3, of the closed four-bar.

    Written down by hand from the geometry: two accelerations follow from the crank's by Cramer's
    rule, and the crank's from d'Alembert's principle, so that no multiplier is solved for.
    """
    q, u = hy.make_vars("a", "b", "c"), hy.make_vars("ua", "ub", "uc")
    lengths, masses, g = (1.0, 2.0, 3.0), (1.0, 2.0, 3.0), 9.81
    sine, cosine = [hy.sin(x) for x in q], [hy.cos(x) for x in q]
    # closure: sum l_i cos q_i = l_3, sum l_i sin q_i = 0; speeds of links 1 and 2 per crank speed
    det = lengths[1] * lengths[2] * (sine[2] * cosine[1] - cosine[2] * sine[1])
    squares = [x * x for x in u]
    bias_x = sum(l * c * s for l, c, s in zip(lengths, cosine, squares, strict=True))
    bias_y = sum(l * n * s for l, n, s in zip(lengths, sine, squares, strict=True))

    def solve(x: Any, y: Any) -> tuple[Any, Any]:
        """Angular rates of links 1 and 2 that add (x, y) = sum over them of l (-sin, cos) w."""
        first = (x * cosine[2] + y * sine[2]) * lengths[2] / det
        second = -(x * cosine[1] + y * sine[1]) * lengths[1] / det
        return first, second

    per_crank = (1.0, *solve(lengths[0] * sine[0], -lengths[0] * cosine[0]))
    free = (0.0, *solve(bias_x, bias_y))  # accelerations with the crank's at nought
    mass, force = mass_and_force(lengths, masses, g, sine, cosine, squares)
    inertia = sum(per_crank[i] * mass[i][j] * per_crank[j] for i in range(3) for j in range(3))
    drive = sum(
        per_crank[i] * (force[i] - sum(mass[i][j] * free[j] for j in range(3))) for i in range(3)
    )
    crank = drive / inertia
    rates = [*u, crank, *(per_crank[i] * crank + free[i] for i in (1, 2))]
    return [*q, *u], rates, det


def mass_and_force(
    lengths: Array, masses: Array, g: float, sine: Array, cosine: Array, squares: Array
) -> tuple[list[list[Any]], list[Any]]:
    """Of the open chain of thin rods: M and F over the three absolute angles."""
    reach = [
        [lengths[j] * (1.0 if j < i else 0.5 if j == i else 0.0) for j in range(3)]
        for i in range(3)
    ]  # of body i's centre along link j
    weight = [[sum(m * r[i] * r[j] for m, r in zip(masses, reach, strict=True)) for j in range(3)]
              for i in range(3)]  # fmt: skip
    inertia = [m * l * l / 12 for m, l in zip(masses, lengths, strict=True)]
    mass = [
        [weight[i][j] * (cosine[i] * cosine[j] + sine[i] * sine[j]) for j in range(3)]
        for i in range(3)
    ]
    force = []
    for i in range(3):
        mass[i][i] = weight[i][i] + inertia[i]
        whirl = sum(
            weight[i][j] * (cosine[i] * sine[j] - sine[i] * cosine[j]) * squares[j]
            for j in range(3)
            if j != i
        )
        moment = sum(m * r[i] for m, r in zip(masses, reach, strict=True))
        force.append(whirl - g * moment * cosine[i])
    return mass, force


def heyoka() -> Any:
    try:
        import heyoka as hy
    except ImportError:
        print("heyoka is not installed: nothing to compare with", file=sys.stderr)
        return None
    return hy


class HeyokaBatch:
    """Its integrator of so many lanes at one tolerance."""

    def __init__(self, hy: Any, tol: float) -> None:
        variables, rates, _ = explicit_equations(hy)
        self.lanes = int(hy.recommended_simd_size())
        self.integrator = hy.taylor_adaptive_batch(
            list(zip(variables, rates, strict=True)), np.zeros((len(variables), self.lanes)),
            tol=tol, compact_mode=False, high_accuracy=False,
        )  # fmt: skip

    def run(self, y0: Array, t_end: float) -> Array:
        """Final states of members (n, 6), n a multiple of the lanes."""
        y = np.empty_like(y0)
        for first in range(0, len(y0), self.lanes):
            self.integrator.set_time(0.0)
            self.integrator.state[:] = y0[first : first + self.lanes].T
            self.integrator.propagate_until(t_end)
            y[first : first + self.lanes] = self.integrator.state.T
        return y


def lambdified_function() -> Any:
    """The same equations through SymPy's lambdify to NumPy."""
    import sympy as sm

    class Symbolic:
        sin, cos = staticmethod(sm.sin), staticmethod(sm.cos)

        @staticmethod
        def make_vars(*names: str) -> list[sm.Symbol]:
            return list(sm.symbols(names))

    variables, rates, _ = explicit_equations(Symbolic)
    return sm.lambdify(variables, rates, "numpy", cse=True)


def seconds_of(work: Any, clock: Any = time.process_time) -> float:
    started = clock()
    work()
    return float(clock() - started)
