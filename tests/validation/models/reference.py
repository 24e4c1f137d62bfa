"""SymPy's own numbers of a script: its matrices lambdified, its constraints solved by SciPy.

Nothing of mechc is in it.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import sympy as sm
import sympy.physics.mechanics as me
from scipy.integrate import solve_ivp
from scipy.optimize import least_squares

from .script import Script

t = me.dynamicsymbols._t


class SympyNumbers:
    """Rates y' of y = [q, x, u] and residuals of the constraints, from the method's matrices.

    x are the states that the method does not own.  With Lagrange's method u are the rates of q.
    """

    def __init__(self, script: Script) -> None:
        method = getattr(script.method, "eom_method", script.method)
        self.script, self.lagrange = script, isinstance(method, me.LagrangesMethod)
        self.q, self.u, self.x = list(method.q), list(method.u), list(script.rates)
        self.symbols = [*self.q, *self.x, *self.u]
        held: dict[Any, Any] = dict(script.constants)
        if not self.lagrange:
            held |= dict.fromkeys(method._uaux, sm.S.Zero)
            held |= dict.fromkeys((u.diff(t) for u in method._uaux), sm.S.Zero)
        self._held = held
        rows = method.mass_matrix_full.shape[0]
        parts = [method.mass_matrix_full, method.forcing_full]
        own = sm.Matrix(list(script.rates.values())) if self.x else sm.zeros(0, 1)
        self._matrices = self._function([*parts, own])
        self._rows = rows
        self._configuration, self._motion = self._constraints(method)
        self.draws = 0

    def _constraints(self, method: Any) -> tuple[Any, Any]:
        """Residuals of configuration constraints; J and rest of velocity constraints."""
        if self.lagrange:
            configuration, motion = sm.Matrix(list(method._hol_coneqs)), method.coneqs
            rows = sm.Matrix(list(motion)) if motion else sm.zeros(0, 1)
            J = rows.jacobian(self.u) if rows.rows else sm.zeros(0, len(self.u))
            rest = rows.subs(dict.fromkeys(self.u, 0)) if rows.rows else rows
        else:
            configuration = sm.Matrix(list(method._f_h))
            J, rest = sm.Matrix(method._k_nh), sm.Matrix(method._f_nh)
            if not J.rows:
                J, rest = sm.zeros(0, len(self.u)), sm.zeros(0, 1)
        return self._function([configuration]), self._function([J, rest])

    def _function(self, parts: list[Any]) -> Any:
        stand_ins = {s: sm.Dummy() for s in (*self.symbols, *self.script.inputs)}
        rates_first = sorted(stand_ins, key=lambda s: -len(s.args))  # q' before q
        plain = [sm.Matrix(p).xreplace(self._held) for p in parts]
        for symbol in rates_first:
            plain = [p.xreplace({symbol: stand_ins[symbol]}) for p in plain]
        arguments = [t, [stand_ins[s] for s in self.symbols]]
        arguments.append([stand_ins[s] for s in self.script.inputs])
        return sm.lambdify(arguments, plain, "numpy", cse=True)

    def inputs(self, time: float) -> list[float]:
        given = self.script.inputs.values()
        return [f(time) if callable(f) else float(f) for f in given]

    def rates(self, time: float, y: Any) -> Any:
        """y' at a state."""
        M, F, own = self._matrices(time, y, self.inputs(time))
        solved = np.linalg.solve(M, F).ravel()
        nq = len(self.q)
        return np.concatenate([solved[:nq], np.ravel(own), solved[nq : nq + len(self.u)]])

    def gap(self, time: float, y: Any) -> Any:
        """Residuals of configuration constraints, then of velocity constraints."""
        (configuration,) = self._configuration(time, y, self.inputs(time))
        J, rest = self._motion(time, y, self.inputs(time))
        u = y[len(self.q) + len(self.x) :]
        return np.concatenate([np.ravel(configuration), J @ u + np.ravel(rest)])

    def random_state(self, draw: np.random.Generator) -> Any:
        """Near the start and on the constraints, which least squares close."""
        near = self.script.start | self.script.guess
        middle = np.array([float(near.get(s, 0.0)) for s in self.symbols])
        y = middle + draw.uniform(-0.3, 0.3, len(middle)) * np.maximum(np.abs(middle), 0.3)
        if not self.gap(0.0, y).size:
            return y
        exact = {"xtol": 1e-15, "ftol": 1e-15, "gtol": 1e-15, "method": "trf"}
        return least_squares(lambda z: self.gap(0.0, z), y, **exact).x

    def motion(self, t_end: float, y0: Any, rtol: float = 1e-11) -> Any:
        """What solve_ivp makes of the rates."""
        run = solve_ivp(self.rates, (0.0, t_end), y0, "DOP853", rtol=rtol, atol=rtol * 1e-2)
        assert run.success, run.message
        return run
