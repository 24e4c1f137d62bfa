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
NEWTON, CLOSED = 40, 1e-13  # steps at most, and gaps after which there is only one more
IMPACTS = 25  # of a motion, at most
EVALUATIONS = 60_000  # of a motion, at most


class UnknownFunctionError(Exception):
    """The equations have functions of time that are no states: the grammar is wrong."""


class Reference:
    """Rates and motions of the states by name, from ``matrix`` y' = ``forcing``."""

    def __init__(self, given: Equations, names: dict[str, Any]) -> None:
        t, inputs = dynamicsymbols._t, names.get("in_sympy", {})
        curves = _curves(names)
        self.names = [_name(x) for x in given.states]
        plain = {x: sm.Dummy(f"y{k}") for k, x in enumerate(given.states)}
        matrix, forcing = (_replaced(m, inputs, plain) for m in (given.matrix, given.forcing))
        applied = matrix.atoms(AppliedUndef) | forcing.atoms(AppliedUndef)
        if unknown := {x for x in applied if str(x.func) not in curves}:
            raise UnknownFunctionError(str(unknown))
        closing = _replaced(given.closing, inputs, plain) if given.closing else sm.Matrix([])
        free = set().union(*(m.free_symbols for m in (matrix, forcing, closing)))
        free -= {t, *plain.values()}
        self.parameters = sorted(map(str, free))
        self.fixed = {str(s): float(x) for s, x in names.get("fixed", {}).items()}
        by_name = {str(s): s for s in free}
        self.size = len(given.states)
        self.closes = bool(given.closing)
        self.closing_parameters = set(map(str, closing.free_symbols))
        rows = [*(closing.jacobian(list(plain.values())) if self.closes else []), *closing]
        arguments = [t, *plain.values(), *(by_name[n] for n in self.parameters)]
        self._rows, self._gaps = len(forcing), len(closing)
        made = [*matrix, *forcing]  # flat: SymPy shares nothing within lists of lists
        shared = sm.cse(made)
        self.stop = _Stop.of(names, plain)
        self._closing = sm.lambdify(arguments, rows, [curves, "math"], cse=True)
        self._exact = sm.lambdify(
            arguments, made, [_of_numbers(curves), "mpmath"], cse=lambda _: shared
        )
        self._double = sm.lambdify(arguments, made, [curves, "math"], cse=lambda _: shared)

    def exact(self, t: float, y: Sequence[float], params: dict[str, float]) -> Array:
        """y' in 30 digits, rounded."""
        with mpmath.workdps(DIGITS):
            found = self._exact(*map(mpmath.mpf, self._arguments(t, y, params)))
            matrix, forcing = found[: -self._rows], found[-self._rows :]
            rows = mpmath.matrix(len(forcing), len(matrix) // len(forcing))
            for k, x in enumerate(matrix):
                rows[k // rows.cols, k % rows.cols] = x
            found = mpmath.lu_solve(rows, mpmath.matrix(forcing))
            return np.array([float(x) for x in found])[: self.size]

    def _arguments(self, t: float, y: Sequence[float], params: dict[str, float]) -> list[float]:
        known = self.fixed | params
        return [t, *map(float, y), *(known[n] for n in self.parameters)]

    def closing(self, t: float, y: Array, params: dict[str, float]) -> tuple[Array, Array]:
        """What closes the loops, zero on the constraints, and its derivatives by the states."""
        found = np.array(self._closing(*self._arguments(t, y, params)), float)
        slopes, gaps = found[: -self._gaps], found[-self._gaps :]
        return gaps, np.reshape(slopes, (len(gaps), self.size))

    def closed(
        self, t: float, y: Array, params: dict[str, float], moving: Sequence[int] | None = None
    ) -> Array:
        """The nearest state on the constraints, by Newton's steps of all states or some."""
        y, some = y.copy(), list(range(self.size) if moving is None else moving)
        for _ in range(NEWTON if self.closes else 0):
            gaps, slopes = self.closing(t, y, params)
            y[some] -= np.linalg.lstsq(slopes[:, some], gaps, rcond=1e-9)[0]
            if np.abs(gaps).max() < CLOSED:  # before this step
                break
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
        values, count = self._arguments(0.0, np.empty(0), params)[1:], 0

        def of(t: float, y: Array) -> Array:
            nonlocal count
            count += 1
            if count > EVALUATIONS:
                raise OverflowError("too many evaluations")
            found = np.array(self._double(t, *y.tolist(), *values), float)
            matrix, forcing = found[: -self._rows], found[-self._rows :]
            return np.linalg.solve(np.reshape(matrix, (len(forcing), -1)), forcing)[: self.size]

        return of

    def motion(self, times: Array, y0: Array, params: dict[str, float]) -> Array | str:
        """The states at times, from the first on, by SciPy's DOP853; or why there are none.

        Those after many impacts are NaN: what comes to rest on its stop is beyond this reference.
        """
        t, end, of = float(times[0]), float(times[-1]), self.rates(params)
        given: dict[str, Any] = {"method": "DOP853", "rtol": FINE, "atol": FINE}
        if self.stop is not None:
            given["events"] = self.stop.gap
        states, y = np.full((len(times), self.size), np.nan), np.asarray(y0, float)
        for _ in range(IMPACTS):
            later = times >= t
            try:
                found = solve_ivp(of, (t, end), y, t_eval=times[later], **given)
            except (ArithmeticError, ValueError, np.linalg.LinAlgError) as error:
                return f"{type(error).__name__}: {error}"
            if found.status < 0 or not np.isfinite(found.y).all():
                return str(found.message)
            reached = np.reshape(found.y, (self.size, -1)).T  # a list where it is none of the times
            states[np.flatnonzero(later)[: len(reached)]] = reached
            if found.status == 0:
                return states
            t, y = float(found.t_events[0][-1]), found.y_events[0][-1]
            y = self.stop.after(y, self._matrix(t, y, params))
        return states

    def _matrix(self, t: float, y: Array, params: dict[str, float]) -> Array:
        found = np.array(self._double(*self._arguments(t, y, params)), float)
        return np.reshape(found[: -self._rows], (self._rows, -1))

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


class _Stop:
    """A gap of the coordinates and its restitution, of an open scene with rates q' = G u."""

    def __init__(self, gap: Any, restitution: float, states: dict[Any, Any]) -> None:
        plain = sm.sympify(gap).xreplace(states)
        symbols = list(states.values())
        self._gap = sm.lambdify(symbols, plain, "math")
        self._slopes = sm.lambdify(symbols, [plain.diff(s) for s in symbols], "math")
        self.restitution = restitution

    @classmethod
    def of(cls, names: dict[str, Any], states: dict[Any, Any]) -> _Stop | None:
        return cls(*names["stop"], states) if "stop" in names else None

    @property
    def gap(self) -> Any:
        def of(t: float, y: Array) -> float:
            return float(self._gap(*y))

        of.terminal, of.direction = True, -1  # type: ignore[attr-defined]
        return of

    def after(self, y: Array, matrix: Array) -> Array:
        """The state after an impact: W M^-1 W^T p = -(1 + e) W u, where the matrix is
        [A q' + B u, M u']; of speeds that are the rates."""
        n = len(y) // 2
        slopes, M = np.array(self._slopes(*y), float)[:n], matrix[n : 2 * n, n : 2 * n]
        moved = np.linalg.solve(M, slopes)
        found = y.copy()
        found[n:] -= (1 + self.restitution) * (slopes @ y[n:]) / (slopes @ moved) * moved
        return found


def _curves(names: dict[str, Any]) -> dict[str, Any]:
    """The functions that tables are printed as -> SciPy's curves through their samples."""
    z, found = sm.Symbol("z"), {}
    for name, curve in names.items():
        if name.endswith("_of_scipy"):
            table = names[name.removesuffix("_of_scipy")]
            found[type(table(z)).__name__] = lambda x, curve=curve: float(curve(x))
    return found


def _of_numbers(curves: dict[str, Any]) -> dict[str, Any]:
    """The same for numbers of mpmath."""
    return {name: lambda x, f=f: mpmath.mpf(f(float(x))) for name, f in curves.items()}


def _name(x: Any) -> str:
    """The name that mechc gives to a state."""
    return f"{x.args[0].func.__name__}_dot" if x.is_Derivative else str(x.func.__name__)


def _replaced(matrix: Any, inputs: dict[Any, sm.Expr], plain: dict[Any, Any]) -> sm.Matrix:
    """Inputs by their expressions, then states by plain symbols."""
    found = sm.Matrix(matrix)
    if inputs:
        found = found.subs(inputs).doit()
    return found.xreplace(plain)
