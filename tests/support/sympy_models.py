"""SymPy's own models, and SymPy's own numerical evaluation of them.

The mechanisms of SymPy's test-suite are taken from its tests as they run: whatever has its
equations formed there is caught.  Nothing of SymPy's equations goes into what mechc computes.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from typing import Any
from unittest import mock

import mpmath
import numpy as np
from sympy import Expr, Matrix, Rational, Symbol, lambdify, sin
from sympy.core.function import AppliedUndef
from sympy.physics.mechanics import (
    KanesMethod,
    LagrangesMethod,
    Point,
    System,
    dynamicsymbols,
    find_dynamicsymbols,
)

TESTS = "sympy.physics.mechanics.tests."
DIGITS = 40
WORST = 1e3  # condition of a state: values drawn at random may be near what no body has


class EnoughError(Exception):
    """Stops a test of SymPy's once its model is caught; what it asserts is not our matter."""


@contextmanager
def catching(caught: Callable[[Any], None]) -> Iterator[None]:
    """Hand over every object as soon as its equations are formed; a System, not its method."""
    makers = {
        KanesMethod: "kanes_equations",
        LagrangesMethod: "form_lagranges_equations",
        System: "form_eoms",
    }
    forming: list[Any] = []

    def watched(form: Callable[..., Any]) -> Callable[..., Any]:
        def run(self: Any, *arguments: Any, **named: Any) -> Any:
            forming.append(self)
            try:
                formed = form(self, *arguments, **named)
                if forming == [self] and len(self.q):
                    caught(self)
            finally:
                forming.pop()
            return formed

        return run

    with ExitStack() as patches:
        for kind, name in makers.items():
            patch = mock.patch.object(kind, name, watched(getattr(kind, name)))
            patches.enter_context(patch)
        yield


def caught(module: str, test: str, which: int = 0) -> Any:
    """An object whose equations a test of SymPy's forms: the first, unless said otherwise."""
    found: list[Any] = []

    def catch(thing: Any) -> None:
        found.append(thing)
        if len(found) > which:
            raise EnoughError

    place = importlib.import_module(TESTS + module)
    *group, name = test.split(".")
    for kind in group:
        place = getattr(place, kind)()
    function: Callable[[], None] = getattr(place, name)
    with catching(catch), suppress(EnoughError):
        function()
    return found[which]


def method_of(thing: Any) -> Any:
    """The method that holds the formed equations."""
    return thing.eom_method if isinstance(thing, System) else thing


def by_lagrange(kane: KanesMethod) -> LagrangesMethod:
    """The same unconstrained bodies and loads by Lagrange's method; T alone makes up L.

    Of points and frames the velocities are set anew, in the rates of the coordinates.
    """
    rates = {u: q.diff() for q, u in zip(kane.q, kane.u, strict=True)}
    frame = kane._inertial
    for place in (*(body.point for body in kane.bodies), *(place for place, _ in kane.loads)):
        if isinstance(place, Point):
            place.set_vel(frame, place.vel(frame).xreplace(rates))
        elif place != frame:
            place.set_ang_vel(frame, place.ang_vel_in(frame).xreplace(rates))
    loads = [(place, load.xreplace(rates)) for place, load in kane.loads]
    kinetic = sum(body.kinetic_energy(frame) for body in kane.bodies)
    method = LagrangesMethod(kinetic, kane.q, loads, kane.bodies, frame)
    method.form_lagranges_equations()
    return method


def by_system(kane: KanesMethod) -> System:
    """The same bodies and loads as a System, formed by Kane's method."""
    origin = Point("fixed")
    origin.set_vel(kane._inertial, 0)
    system = System(kane._inertial, origin)
    system.add_bodies(*kane.bodies)
    system.add_coordinates(*kane.q)
    system.add_speeds(*kane.u)
    system.add_kdes(*(q.diff() - u for q, u in zip(kane.q, kane.u, strict=True)))
    system.add_loads(*kane.loads)
    system.form_eoms()
    return system


def states_and_inputs(method: Any) -> tuple[list[Expr], list[Expr], list[AppliedUndef]]:
    """Coordinates, speeds (a LagrangesMethod's are derivatives), specified functions."""
    q, u = list(method.q), list(method.u)
    held = find_dynamicsymbols(Matrix(method.forcing))
    known = {*q, *u, *(x.diff(dynamicsymbols._t) for x in (*q, *u))}
    known |= set(getattr(method, "_uaux", ()))
    specified = {f for f in held - known if isinstance(f, AppliedUndef)}
    return q, u, sorted(specified, key=str)


def stand_ins(thing: Any) -> dict[AppliedUndef, Expr]:
    """Smooth functions of time in place of specified ones."""
    _, _, specified = states_and_inputs(method_of(thing))
    t = dynamicsymbols._t
    return {f: Rational(k + 1, 7) + sin((k + 2) * t) for k, f in enumerate(specified)}


Pairs = dict[str, tuple[Any, Any]]


def pairs(
    model: Any, thing: Any, inputs: dict[AppliedUndef, Expr], states: int, seed: int
) -> Iterator[Pairs]:
    """At random states on the constraints: what the model says, and what SymPy says.

    Rates, and constraint forces J^T lambda: F - M u' of the open tree by Kane's method, what
    the full system of equations solves for by Lagrange's.
    """
    method = method_of(thing)
    reference, rng = Reference(method, inputs), np.random.default_rng(seed)
    tree = None if isinstance(method, LagrangesMethod) else reference.open_tree()
    for _ in range(states):
        t, y, values = random_state(model, reference, rng)
        mine = {p: values[p] for p in model.parameters}
        rates, multipliers = reference.rates(t, y, values)
        found = {"rates": (model.rhs(t, y, mine), rates)}
        jacobian = model.constraint_jacobian(y, mine, t)
        forces = jacobian.T @ model.multipliers(y, mine, t) if len(jacobian) else 0 * y[:0]
        if len(jacobian) and tree is not None:
            found["forces"] = forces, tree(t, y, values, rates)
        elif len(jacobian):  # a LagrangesMethod solves for -lambda
            found["multipliers"] = model.multipliers(y, mine, t), -multipliers
        yield found


def difference(found: Pairs) -> float:
    """The largest, relative to the largest rate, force or multiplier where that is over one."""
    apart = 0.0
    for one, other in found.values():
        scale = max(1.0, np.abs(other).max(initial=0.0))
        apart = max(apart, float(np.abs(one - other).max(initial=0.0)) / scale)
    return apart


def random_state(model: Any, reference: Reference, rng: Any) -> tuple[float, Any, dict[str, float]]:
    """(t, y, values): on the constraints to rounding; loops that cannot close are drawn anew."""
    names = {*model.parameters, *map(str, reference.parameters)}
    for _ in range(50):
        values = {name: rng.uniform(0.5, 2.0) for name in sorted(names)}
        mine = {p: values[p] for p in model.parameters}
        t, y = rng.uniform(0.0, 2.0), rng.uniform(-1.2, 1.2, len(model.coordinates + model.speeds))
        if _onto_constraints(model, y, mine, t) and _condition(model, y, mine, t) < WORST:
            return t, y, values
    raise AssertionError("no state on the constraints was found at which u' can be solved for")


def _condition(model: Any, y: Any, values: dict[str, float], t: float) -> float:
    """Of the matrix [M, J^T; J, 0] by which accelerations are solved for."""
    mass, jacobian = model.mass_matrix(y, values, t), model.constraint_jacobian(y, values, t)
    nothing = np.zeros((len(jacobian),) * 2)
    return float(np.linalg.cond(np.block([[mass, jacobian.T], [jacobian, nothing]])))


def _onto_constraints(model: Any, y: Any, values: dict[str, float], t: float) -> bool:
    """Gauss-Newton for the coordinates, then the speeds, in place."""
    size = len(model.coordinates)
    gap = model.constraints(y, values, t)
    for _ in range(60 if len(gap) else 0):
        if not np.isfinite(gap).all():
            return False
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

    def open_tree(self) -> Callable[..., Any]:
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

        def forces(t: float, y: Any, values: dict[str, float], rates: Any) -> Any:
            numbers = [mpmath.mpf(x) for x in (t, *y, *(values[str(s)] for s in names))]
            with mpmath.workdps(DIGITS):
                mass, forcing = evaluate(*numbers)
                accelerations = mpmath.matrix([mpmath.mpf(x) for x in rates[len(q) :]])
                return np.array([float(x) for x in forcing - mass * accelerations])

        return forces

    def rates(self, t: float, y: Any, values: dict[str, float]) -> tuple[Any, Any]:
        """(q', u'), and what else the full system solves for: minus the multipliers."""
        numbers = [mpmath.mpf(x) for x in (t, *y, *(values[str(s)] for s in self.parameters))]
        with mpmath.workdps(DIGITS):
            full, forcing = self._evaluate(*numbers)
            solved = mpmath.lu_solve(full, forcing)
        total = sum(self.size)
        found = np.array([float(x) for x in solved])
        return found[:total], found[total:]
