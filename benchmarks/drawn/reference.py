"""The equations that SymPy has formed, evaluated without mechc: in 30 digits, and as a motion."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import mpmath
import numpy as np
import sympy as sm
from scipy.integrate import solve_ivp
from sympy.core.function import AppliedUndef
from sympy.physics.mechanics import dynamicsymbols

from ..timing.cases import Array
from .equations import Equations

DIGITS = 30
FINE = 1e-12  # rtol of the motion
EVALUATIONS = 60_000  # of a motion, at most


class UnknownFunctionError(Exception):
    """The equations have functions of time that are no states: the grammar is wrong."""


class Reference:
    """Rates and motions of the states by name, from ``matrix`` y' = ``forcing``."""

    def __init__(self, given: Equations, inputs: dict[Any, sm.Expr]) -> None:
        t = dynamicsymbols._t
        self.names = [_name(x) for x in given.states]
        plain = {x: sm.Dummy(f"y{k}") for k, x in enumerate(given.states)}
        matrix, forcing = (_replaced(m, inputs, plain) for m in (given.matrix, given.forcing))
        unknown = matrix.atoms(AppliedUndef) | forcing.atoms(AppliedUndef)
        if unknown:
            raise UnknownFunctionError(str(unknown))
        closing = _replaced(given.closing, inputs, plain) if given.closing else sm.Matrix([])
        free = set().union(*(m.free_symbols for m in (matrix, forcing, closing)))
        free -= {t, *plain.values()}
        self.parameters = sorted(map(str, free))
        by_name = {str(s): s for s in free}
        self.size = len(given.states)
        self.closes = bool(given.closing)
        self.closing_parameters = set(map(str, closing.free_symbols))
        rows = [list(closing), list(closing.jacobian(list(plain.values()))) if self.closes else []]
        arguments = [t, *plain.values(), *(by_name[n] for n in self.parameters)]
        made = [list(matrix), list(forcing)]
        self._closing = sm.lambdify(arguments, rows, "math", cse=True)
        self._exact = sm.lambdify(arguments, made, "mpmath", cse=True)
        self._double = sm.lambdify(arguments, made, "math", cse=True)

    def exact(self, t: float, y: Sequence[float], params: dict[str, float]) -> Array:
        """y' in 30 digits, rounded."""
        with mpmath.workdps(DIGITS):
            matrix, forcing = self._exact(*map(mpmath.mpf, self._arguments(t, y, params)))
            rows = mpmath.matrix(len(forcing), len(matrix) // len(forcing))
            for k, x in enumerate(matrix):
                rows[k // rows.cols, k % rows.cols] = x
            found = mpmath.lu_solve(rows, mpmath.matrix(forcing))
            return np.array([float(x) for x in found])[: self.size]

    def _arguments(self, t: float, y: Sequence[float], params: dict[str, float]) -> list[float]:
        return [t, *map(float, y), *(params[n] for n in self.parameters)]

    def closing(self, t: float, y: Array, params: dict[str, float]) -> tuple[Array, Array]:
        """What closes the loops, zero on the constraints, and its derivatives by the states."""
        gaps, slopes = self._closing(*self._arguments(t, y, params))
        return np.array(gaps, float), np.reshape(np.array(slopes, float), (len(gaps), self.size))

    def closed(self, t: float, y: Array, params: dict[str, float]) -> Array:
        """The nearest state on the constraints, by Newton's steps."""
        for _ in range(8 if self.closes else 0):
            gaps, slopes = self.closing(t, y, params)
            y = y - np.linalg.lstsq(slopes, gaps, rcond=1e-9)[0]
        return y

    def along(self, t: float, y: Array, params: dict[str, float], direction: Array) -> Array:
        """A direction's part that the constraints allow."""
        if not self.closes:
            return direction
        _, slopes = self.closing(t, y, params)
        allowed: Array = direction - np.linalg.pinv(slopes, rcond=1e-9) @ (slopes @ direction)
        return allowed

    def rates(self, params: dict[str, float]) -> Callable[[float, Array], Array]:
        """y' in doubles, of t and y."""
        values, count = [params[n] for n in self.parameters], 0

        def of(t: float, y: Array) -> Array:
            nonlocal count
            count += 1
            if count > EVALUATIONS:
                raise OverflowError("too many evaluations")
            matrix, forcing = self._double(t, *y.tolist(), *values)
            rows = np.reshape(np.array(matrix, float), (len(forcing), -1))
            return np.linalg.solve(rows, np.array(forcing, float))[: self.size]

        return of

    def motion(self, times: Array, y0: Array, params: dict[str, float]) -> Array | str:
        """The states at times, from the first on, by SciPy's DOP853; or why there are none."""
        span = (float(times[0]), float(times[-1]))
        given = {"method": "DOP853", "rtol": FINE, "atol": FINE, "t_eval": times}
        try:
            found = solve_ivp(self.rates(params), span, y0, **given)
        except (ArithmeticError, ValueError, np.linalg.LinAlgError) as error:
            return f"{type(error).__name__}: {error}"
        if found.status or not np.isfinite(found.y).all():
            return str(found.message)
        states: Array = found.y.T
        return states

    def spread(
        self, t: float, y: Array, params: dict[str, float], rng: np.random.Generator
    ) -> Array:
        """How far y' moves when all numbers move by a relative 1, by differences of 1e-9."""
        of, step = self.rates(params), 1e-9
        here, most = of(t, y), np.zeros(self.size)
        for _ in range(4):
            moved = {n: v * (1 + step * rng.choice([-1, 1])) for n, v in params.items()}
            aside = y + step * rng.choice([-1, 1], len(y)) * np.maximum(np.abs(y), 0.1)
            most = np.maximum(most, np.abs(self.rates(moved)(t, aside) - here) / step)
        return most


def _name(x: Any) -> str:
    """The name that mechc gives to a state."""
    return f"{x.args[0].func.__name__}_dot" if x.is_Derivative else str(x.func.__name__)


def _replaced(matrix: Any, inputs: dict[Any, sm.Expr], plain: dict[Any, Any]) -> sm.Matrix:
    """Inputs by their expressions, then states by plain symbols."""
    found = sm.Matrix(matrix)
    if inputs:
        found = found.subs(inputs).doit()
    return found.xreplace(plain)
