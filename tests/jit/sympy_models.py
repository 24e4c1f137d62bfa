"""SymPy's own models, and SymPy's own numerical evaluation of them.

The mechanisms of SymPy's test-suite are taken from its tests as they run: whatever has its
equations formed there is caught.  Nothing of SymPy's equations goes into what mechc computes.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Any
from unittest import mock

import mpmath
import numpy as np
from sympy import Expr, Matrix, Symbol, lambdify
from sympy.core.function import AppliedUndef
from sympy.physics.mechanics import (
    KanesMethod,
    LagrangesMethod,
    dynamicsymbols,
    find_dynamicsymbols,
)

TESTS = "sympy.physics.mechanics.tests."
DIGITS = 40


class EnoughError(Exception):
    """Stops a test of SymPy's once its model is caught; what it asserts is not our matter."""


@contextmanager
def catching(found: list[Any], wanted: int | None) -> Iterator[None]:
    kane, lagrange = KanesMethod.kanes_equations, LagrangesMethod.form_lagranges_equations

    def catch(method: Any, formed: Any) -> Any:
        if method not in found and len(method.q):
            found.append(method)
        if len(found) == wanted:
            raise EnoughError
        return formed

    def kanes_equations(self: Any, *arguments: Any, **named: Any) -> Any:
        return catch(self, kane(self, *arguments, **named))

    def lagranges_equations(self: Any) -> Any:
        return catch(self, lagrange(self))

    with (
        mock.patch.object(KanesMethod, "kanes_equations", kanes_equations),
        mock.patch.object(LagrangesMethod, "form_lagranges_equations", lagranges_equations),
    ):
        yield


def caught(module: str, test: str, wanted: int | None = 1) -> list[Any]:
    """The objects whose equations a test of SymPy's forms, up to the number wanted."""
    found: list[Any] = []
    function: Callable[[], None] = getattr(importlib.import_module(TESTS + module), test)
    with catching(found, wanted), suppress(EnoughError):
        function()
    return found


def states_and_inputs(method: Any) -> tuple[list[Expr], list[Expr], list[AppliedUndef]]:
    """Coordinates, speeds (a LagrangesMethod's are derivatives), specified functions."""
    q, u = list(method.q), list(method.u)
    held = find_dynamicsymbols(Matrix(method.forcing))
    known = {*q, *u, *(x.diff(dynamicsymbols._t) for x in (*q, *u))}
    known |= set(getattr(method, "_uaux", ()))
    specified = {f for f in held - known if isinstance(f, AppliedUndef)}
    return q, u, sorted(specified, key=str)


def random_state(model: Any, reference: Reference, rng: Any) -> tuple[float, Any, dict[str, float]]:
    """(t, y, values): on the constraints to rounding; loops that cannot close are tried anew."""
    names = {*model.parameters, *map(str, reference.parameters)}
    for _ in range(50):
        values = {name: rng.uniform(0.5, 2.0) for name in sorted(names)}
        mine = {p: values[p] for p in model.parameters}
        t, y = rng.uniform(0.0, 2.0), rng.uniform(-1.2, 1.2, len(model.coordinates + model.speeds))
        if _onto_constraints(model, y, mine, t):
            return t, y, values
    raise AssertionError("no state on the constraints was found")


def _onto_constraints(model: Any, y: Any, values: dict[str, float], t: float) -> bool:
    """Gauss-Newton for the coordinates, then the speeds, in place."""
    size = len(model.coordinates)
    gap = model.constraints(y, values, t)
    for _ in range(60 if len(gap) else 0):
        unit = 1e-7 * np.eye(len(y))[:size]
        ahead, behind = (
            model.constraints(y + unit, values, t),
            model.constraints(y - unit, values, t),
        )
        y[:size] -= np.linalg.lstsq(((ahead - behind) / 2e-7).T, gap, rcond=1e-8)[0]
        gap = model.constraints(y, values, t)
    jacobian = model.constraint_jacobian(y, values, t)
    if len(jacobian):
        for _ in range(3):
            residual = model.velocity_constraints(y, values, t)
            y[size:] -= np.linalg.lstsq(jacobian, residual, rcond=1e-10)[0]
    return bool(np.abs(gap).max(initial=0.0) < 1e-14)


class Reference:
    """q', u' and constraint forces by SymPy's own matrices, at 40 digits."""

    def __init__(self, method: Any, inputs: dict[AppliedUndef, Expr]) -> None:
        self.method, self.inputs = method, inputs
        q, u, _ = states_and_inputs(method)
        self.size = len(q), len(u)
        zero = {x: 0 for a in getattr(method, "_uaux", ()) for x in (a.diff(), a)}
        self.full = self._plain(method.mass_matrix_full, zero, q, u)
        self.forcing = self._plain(method.forcing_full, zero, q, u)
        held = self.full.free_symbols | self.forcing.free_symbols
        self.stand_ins = self._stand_ins(q, u)
        self.parameters = sorted(held - set(self.stand_ins) - {dynamicsymbols._t}, key=str)
        arguments = [dynamicsymbols._t, *self.stand_ins, *self.parameters]
        self._evaluate = lambdify(arguments, [self.full, self.forcing], "mpmath", cse=True)

    def _stand_ins(self, q: list[Expr], u: list[Expr]) -> list[Expr]:
        return [Symbol(f"_y{k}") for k in range(len(q) + len(u))]

    def _plain(self, matrix: Any, zero: Any, q: list[Expr], u: list[Expr]) -> Matrix:
        stand_ins = self._stand_ins(q, u)
        speeds = dict(zip(u, stand_ins[len(q) :], strict=True))
        coordinates = dict(zip(q, stand_ins, strict=False))
        matrix = Matrix(matrix).xreplace(zero).xreplace(self.inputs).doit()
        return matrix.xreplace(speeds).xreplace(coordinates)

    def constraint_forces(self, t: float, y: Any, values: dict[str, float], rates: Any) -> Any:
        """F - M u' of the open tree: every speed independent, as KanesMethod itself has it."""
        method = self.method
        q, u, _ = states_and_inputs(method)
        implicit = method._k_kqdot_implicit * method.q.diff(dynamicsymbols._t)
        implicit += method._k_ku_implicit * method.u + method._f_k_implicit
        tree = KanesMethod(method._inertial, q, u, list(implicit), u_auxiliary=list(method._uaux))
        tree.kanes_equations(method.bodies, method.loads)
        zero = {x: 0 for a in method._uaux for x in (a.diff(), a)}
        terms = [self._plain(m, zero, q, u) for m in (tree.mass_matrix, tree.forcing)]
        names = sorted(set().union(*(m.free_symbols for m in terms)) - {*self.stand_ins}, key=str)
        names = [n for n in names if n != dynamicsymbols._t]
        evaluate = lambdify([dynamicsymbols._t, *self.stand_ins, *names], terms, "mpmath", cse=True)
        numbers = [mpmath.mpf(x) for x in (t, *y, *(values[str(s)] for s in names))]
        with mpmath.workdps(DIGITS):
            mass, forcing = evaluate(*numbers)
            accelerations = mpmath.matrix([mpmath.mpf(x) for x in rates[len(q) :]])
            return np.array([float(x) for x in forcing - mass * accelerations])

    def rates(self, t: float, y: Any, values: dict[str, float]) -> tuple[Any, Any]:
        """(q', u'), and what else the full system solves for: minus the multipliers."""
        numbers = [mpmath.mpf(x) for x in (t, *y, *(values[str(s)] for s in self.parameters))]
        with mpmath.workdps(DIGITS):
            full, forcing = self._evaluate(*numbers)
            solved = mpmath.lu_solve(full, forcing)
        total = sum(self.size)
        found = np.array([float(x) for x in solved])
        return found[:total], found[total:]
