"""The regular four-bar in heyoka's batch integrator and compiled function, and in NumPy.

They integrate the index-one equations without projection, in the shortest form that we know
(problems/four_bar.py).  The closure is none of these equations: l_3 does not occur in them.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from ..formulations.equations import Equations, equations_of
from ..peers.heyoka_taylor import rates_of
from ..problems import problem
from ..problems.problem import Array


def equations() -> Equations:
    """The four-bar's."""
    return equations_of(problem("four_bar_regular"))


class System(NamedTuple):
    """The package, and the state's variables with their rates."""

    heyoka: Any
    rates: list[tuple[Any, Any]]


def heyoka_system() -> System | None:
    """The four-bar; None where heyoka is not installed."""
    try:
        import heyoka
    except ImportError:
        return None
    return System(heyoka, rates_of(heyoka, equations())[0])


class HeyokaBatch:
    """Its batch integrator, one trajectory in each lane, at one tolerance."""

    def __init__(self, system: System, tol: float) -> None:
        self.lanes = int(system.heyoka.recommended_simd_size())
        self.integrator = system.heyoka.taylor_adaptive_batch(
            system.rates, np.zeros((6, self.lanes)),
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
    variables, rates = zip(*system.rates, strict=True)
    function = system.heyoka.cfunc(rates, vars=variables)
    columns, result = np.ascontiguousarray(y.T), np.empty(y.T.shape)
    return lambda: function(columns, outputs=result), result


def numpy_rates(y: Array) -> Callable[[], Any]:
    """The same over the states through SymPy's lambdify to NumPy."""
    function = equations().rates().function("numpy")
    columns = [np.ascontiguousarray(column) for column in y.T]
    return lambda: function(*columns)
