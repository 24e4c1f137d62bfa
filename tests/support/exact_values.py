"""Exact values of a scene at random states, and how far rounding may take compiled code from them.

SymPy's derived, un-optimised expressions are evaluated by mpmath with 30 digits at the exact
doubles that compiled code is given.  Errors are measured against the sum of the magnitudes of the
terms, which is what rounding of each term allows.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import mpmath
import numpy as np
from numpy.typing import NDArray
from sympy import Abs, Add, Expr, Mul, Pow, Symbol, cos, exp, lambdify, sin

from tests.support import scenes

Array = NDArray[np.float64]
PROMISE = 1e-13
OUTPUTS = (
    "mass_matrix",
    "forcing",
    "constraints",
    "velocity_constraints",
    "constraint_jacobian",
    "kinetic_energy",
    "potential_energy",
    "linear_momenta",
    "angular_momenta",
    "points",
    "point_velocities",
    "coordinate_rates",
)
SADDLE = ("mass_matrix", "forcing", "constraint_jacobian", "gamma")


class Reference:
    """Random states of a scene, with exact values and the magnitudes that errors are measured by.

    Angles over many turns, speeds of either sign, every parameter over two decades.
    """

    def __init__(self, scene: str, count: int) -> None:
        derived = scenes.equations(scene)
        s = derived.symbols
        rng = np.random.default_rng(20)
        self.t = rng.uniform(0, 5, count)
        self.q = rng.uniform(-50, 50, (count, len(s.q)))
        self.u = rng.normal(0, 5, (count, len(s.u)))
        self.p = 10 ** rng.uniform(-1, 1, (count, len(s.parameters)))
        self.y = np.hstack([self.q, self.u])
        self.derived = derived
        self.names = tuple(n for n in OUTPUTS if derived.outputs[n].elements)
        self.columns = [self.t, *self.q.T, *self.u.T, *self.p.T]
        with mpmath.workdps(30):
            evaluate = scenes.exact(derived, *self.names, *SADDLE)
            rows = zip(*(c.tolist() for c in self.columns), strict=True)
            self.values = [evaluate(*map(mpmath.mpf, row)) for row in rows]

    def exact(self, name: str) -> list[list[mpmath.mpf]]:
        place = (*self.names, *SADDLE).index(name)
        return [values[place] for values in self.values]

    def magnitude(self, name: str) -> Array:
        """Sum of the magnitudes of the terms of every element, (states, elements)."""
        elements = [magnitude(e) for e in self.derived.outputs[name].elements]
        evaluate = lambdify(scenes.arguments(self.derived), elements, modules="numpy", cse=True)
        of_terms = evaluate(*self.columns)
        columns = [np.broadcast_to(m, len(self.t)) for m in of_terms]
        return np.array(columns, dtype=float).reshape(len(columns), len(self.t)).T

    def check(self, name: str, found: Array) -> None:
        """Every element of every state is within the promise."""
        self._compare(name, found, self.exact(name), PROMISE * self.magnitude(name))

    def check_motion(self, found: Array) -> None:
        """Accelerations and multipliers, (states, nu + nc), are within the promise."""
        exact = self._solved()
        self._compare("motion", found, exact, self._allowed(np.array(exact, dtype=float)))

    def _compare(
        self, name: str, found: Array, exact: list[list[mpmath.mpf]], allowed: Array
    ) -> None:
        rows = zip(exact, found.reshape(len(exact), -1).tolist(), strict=True)
        with mpmath.workdps(30):
            error = np.array(
                [[float(abs(a - b)) for a, b in zip(*row, strict=True)] for row in rows]
            )
        assert np.all(error <= allowed), (name, np.nanmax(error / allowed))

    def _solved(self) -> list[list[mpmath.mpf]]:
        """u' and multipliers from the exact equations."""
        rows = []
        with mpmath.workdps(30):
            for mass, forcing, jacobian, gamma in zip(*map(self.exact, SADDLE), strict=True):
                saddle = mpmath.matrix(_saddle(np.array(mass), np.array(jacobian)).tolist())
                solution = mpmath.lu_solve(saddle, mpmath.matrix([*forcing, *gamma]))
                rows.append(list(solution))
        return rows

    def _allowed(self, solution: Array) -> Array:
        """What the promise becomes by the conditioning of the saddle matrix.

        Unknowns are scaled so that M has a unit diagonal and the rows of J unit length in its
        metric.
        """
        mass, forcing, jacobian, gamma = map(self.magnitude, SADDLE)
        matrices = ("mass_matrix", "constraint_jacobian")
        whole = _saddle(*(np.array(self.exact(name), dtype=float) for name in matrices))
        size = forcing.shape[-1]
        speeds = 1 / np.sqrt(np.einsum("nii->ni", whole[:, :size, :size]))
        rows = 1 / np.linalg.norm(whole[:, size:, :size] * speeds[:, None, :], axis=-1)
        scale = np.hstack([speeds, rows])
        square = scale[:, :, None] * scale[:, None, :]
        inverse = np.linalg.norm(np.linalg.inv(whole * square), 2, (-2, -1))
        matrix = np.linalg.norm(_saddle(mass, jacobian) * square, 2, (-2, -1))
        right = np.linalg.norm(np.hstack([forcing, gamma]) * scale, axis=-1)
        unknowns = np.linalg.norm(solution / scale, axis=-1)
        return np.asarray(PROMISE * (inverse * (matrix * unknowns + right))[:, None] * scale)


def printed(named: Mapping[str, Array], name: str, states: int) -> Array:
    """An output of a program that prints them all, (states, width).

    Rates of coordinates that are the speeds are no output of their own.
    """
    if name in named:
        return named[name].reshape(states, -1)
    assert name == "coordinate_rates"
    rates = named["rates"].reshape(states, -1)
    return rates[:, : rates.shape[1] // 2]


def magnitude(expression: Expr) -> Expr:
    """The expression with every term of every sum by its magnitude."""
    if isinstance(expression, Add):
        return Add(*map(magnitude, expression.args))
    if isinstance(expression, Mul):
        return Mul(*map(magnitude, expression.args))
    if isinstance(expression, Pow) and expression.exp.is_Integer and expression.exp > 0:
        return magnitude(expression.base) ** expression.exp
    if isinstance(expression, (sin, cos)) and not isinstance(expression.args[0], Symbol):
        # an argument that was itself rounded moves the value by as much
        return Abs(expression) + magnitude(expression.args[0])
    if isinstance(expression, exp):
        return expression * (1 + magnitude(expression.args[0]))
    return Abs(expression)


def _saddle(mass: NDArray[Any], jacobian: NDArray[Any]) -> NDArray[Any]:
    """[[M, J^T], [J, 0]] of the last axes, flat M and J."""
    size = round(mass.shape[-1] ** 0.5)
    rows = jacobian.shape[-1] // size
    whole = np.zeros((*mass.shape[:-1], size + rows, size + rows), dtype=mass.dtype)
    whole[..., :size, :size] = mass.reshape(*mass.shape[:-1], size, size)
    whole[..., size:, :size] = jacobian.reshape(*mass.shape[:-1], rows, size)
    whole[..., :size, size:] = np.swapaxes(whole[..., size:, :size], -1, -2)
    return whole
