"""The regular four-bar in heyoka's batch integrator and compiled function, and in NumPy.

They integrate the index-one equations without projection, in the shortest form that we know
(problems/four_bar.py).  The closure is none of these equations: l_3 does not occur in them.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import sympy

import mechc

from ..problems.four_bar import accelerations
from ..problems.problem import Array


class System(NamedTuple):
    """The package, the state's variables, and their rates."""

    heyoka: Any
    variables: list[Any]
    rates: list[Any]


def _rates(variables: list[Any], sin: Any, cos: Any) -> list[Any]:
    given = {name: float(value) for name, value in mechc.load("four_bar").defaults.items()}
    q, u = variables[:3], variables[3:]
    return [*u, *accelerations(q, u, given, sin, cos)]


def heyoka_system() -> System | None:
    """The four-bar; None where heyoka is not installed."""
    try:
        import heyoka
    except ImportError:
        return None
    variables = list(heyoka.make_vars("a", "b", "c", "ua", "ub", "uc"))
    return System(heyoka, variables, _rates(variables, heyoka.sin, heyoka.cos))


class HeyokaBatch:
    """Its batch integrator, one trajectory in each lane, at one tolerance."""

    def __init__(self, system: System, tol: float) -> None:
        self.lanes = int(system.heyoka.recommended_simd_size())
        self.integrator = system.heyoka.taylor_adaptive_batch(
            list(zip(system.variables, system.rates, strict=True)), np.zeros((6, self.lanes)),
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


def heyoka_rates(system: System, y: Array) -> tuple[Callable[[], Any], Array]:
    """Its compiled function over the states (n, 6), and where the rates come, (6, n)."""
    function = system.heyoka.cfunc(system.rates, vars=system.variables)
    columns, result = np.ascontiguousarray(y.T), np.empty(y.T.shape)
    return lambda: function(columns, outputs=result), result


def numpy_rates(y: Array) -> Callable[[], Any]:
    """The same over the states through SymPy's lambdify to NumPy."""
    variables = list(sympy.symbols("a b c ua ub uc"))
    function = sympy.lambdify(variables, _rates(variables, sympy.sin, sympy.cos), "numpy", cse=True)
    columns = [np.ascontiguousarray(column) for column in y.T]
    return lambda: function(*columns)
