"""A problem's equations as SymPy's KanesMethod forms them, for tools that take equations.

The open tree's M u' = F comes from ``KanesMethod`` with numbers substituted, the rows J u' = gamma
from differentiating the constraints; nothing of mechc's derivation is used and nothing is
simplified.  Closed loops are M u' + J^T lambda = F, J u' = gamma, index one.

Every tool may take what suits it: the explicit form (``rates``), the matrices (``entries``) or a
residual (``residual``), each a straight-line program that any arithmetic evaluates.
"""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import sympy
from _problem import Array, Observe, Problem
from _program import Program, Tape, program
from mechc_codegen.mechanism import Mechanism
from mechc_codegen.scene import Asked, Scene
from mechc_codegen.source import Settings
from sympy import Expr, Float, Matrix, Symbol
from sympy.physics.mechanics import KanesMethod, dynamicsymbols

Numbers = Callable[[float], Expr]


@dataclass(frozen=True, eq=False)
class Equations:
    """The equations of a problem in the coordinates that suit them best, and its start in these.

    Attributes
    ----------
    q, u
        Coordinates and speeds as plain symbols.
    q_rates
        q' of q and u.
    M, F
        (n, n) and (n, 1), of the open tree, of q and u.
    J, gamma
        (m, n) and (m, 1): all constraint rows at acceleration level.
    position, velocity
        Residuals of the holonomic constraints, and of all constraints at velocity level (m).
    shortest
        Accelerations in the fewest operations known, where there is such a form by hand.
    start, observe
        The first state ``[q, u]``, and the observed quantities of a state.
    seconds
        What the derivation took.
    """

    q: tuple[Symbol, ...]
    u: tuple[Symbol, ...]
    q_rates: tuple[Expr, ...]
    M: Matrix
    F: Matrix
    J: Matrix
    gamma: Matrix
    position: tuple[Expr, ...]
    velocity: tuple[Expr, ...]
    shortest: tuple[Expr, ...] | None
    start: Array
    observe: Observe
    seconds: float

    @property
    def state(self) -> tuple[Symbol, ...]:
        return (*self.q, *self.u)

    @property
    def multipliers(self) -> tuple[Symbol, ...]:
        """One a constraint row."""
        return tuple(Symbol(f"lambda_{k}") for k in range(len(self.velocity)))

    def rates(self) -> Program:
        """(q', u') of the state, solved for by elimination written out."""
        if self.shortest is not None:
            return program(self.state, (*self.q_rates, *self.shortest))
        tape, n, m = Tape(), len(self.u), len(self.velocity)
        values = tape.shared((*self.q_rates, *self.M, *self.F, *self.J, *self.gamma))
        q_rates, M, F, J, gamma = _parts(values, len(self.q), n * n, n, m * n, m)
        u_rates = tape.accelerations(_rows(M, n), F, _rows(J, n), gamma)
        return Program(self.state, *tape.finished((*q_rates, *u_rates)))

    def entries(self) -> Program:
        """(q', M, F, J, gamma) of the state, matrices row by row; see :meth:`matrices`."""
        return program(self.state, (*self.q_rates, *self.M, *self.F, *self.J, *self.gamma))

    def matrices(self, values: Sequence[Any]) -> tuple[Sequence[Any], ...]:
        """What ``entries`` gave, apart: q', M (row by row), F, J (row by row), gamma."""
        n, m = len(self.u), len(self.velocity)
        return tuple(_parts(values, len(self.q), n * n, n, m * n, m))

    def residual(self) -> Program:
        """Of (q, u, lambda, q', u'): q' and M u' + J^T lambda - F, J u' - gamma; index one."""
        q_dot, u_dot = ([Symbol(f"{x}_dot") for x in xs] for xs in (self.q, self.u))
        lambdas, a = Matrix(self.multipliers), Matrix(u_dot)
        balance = self.M * a - self.F
        rows = []
        if self.velocity:
            balance += self.J.T * lambdas
            rows = list(self.J * a - self.gamma)
        kinematic = [x - rate for x, rate in zip(q_dot, self.q_rates, strict=True)]
        arguments = (*self.state, *self.multipliers, *q_dot, *u_dot)
        return program(arguments, (*kinematic, *balance, *rows))

    def constraints(self) -> Program:
        """(position, velocity) residuals of the state."""
        return program(self.state, (*self.position, *self.velocity))


@cache
def equations_of(problem: Problem, numbers: Numbers = Float) -> Equations:
    """Derive the equations of a problem; once in a process.

    Parameters
    ----------
    numbers
        What the parameters' values become; by default doubles.  ``sympy.Rational`` keeps them
        exact for arithmetic of many digits.
    """
    began = time.perf_counter()
    given = problem.given
    mechanism = _described(given.mechanism(), problem)
    values = {p.symbol: numbers(problem.values[p.symbol.name]) for p in mechanism.parameters}
    tree = open_tree(mechanism)
    velocity = Matrix(_at_velocity_level(mechanism))
    q_rates = Matrix([x.xreplace(mechanism.rates) for x in mechanism.kinematics])
    plain = {x: Symbol(f"q{k}") for k, x in enumerate(mechanism.q)}
    plain |= {x: Symbol(f"u{k}") for k, x in enumerate(mechanism.u)}
    position = [c.expression for c in _holonomic(mechanism)]
    numeric = lambda matrix: Matrix(matrix).xreplace(plain | values)  # noqa: E731
    q, u = (tuple(plain[x] for x in xs) for xs in (mechanism.q, mechanism.u))
    q_rates, velocity = numeric(q_rates), numeric(velocity)
    J = velocity.jacobian(u) if velocity else Matrix(0, len(u), [])
    gamma = -velocity.jacobian(q) * q_rates if velocity else Matrix(0, 1, [])
    by_hand = given.accelerations
    return Equations(
        q=q, u=u, q_rates=tuple(q_rates),
        M=numeric(tree.mass_matrix), F=numeric(tree.forcing), J=J, gamma=gamma,
        position=tuple(numeric(position)), velocity=tuple(velocity),
        shortest=None if by_hand is None else tuple(
            by_hand(q, u, {s.name: value for s, value in values.items()}, sympy.sin, sympy.cos)
        ),
        start=given.start, observe=given.observe, seconds=time.perf_counter() - began,
    )  # fmt: skip


def open_tree(mechanism: Mechanism) -> KanesMethod:
    """Kane's equations of the bodies with all speeds independent, constraints left out."""
    t = dynamicsymbols._t
    rates = [x.diff(t) - rate for x, rate in zip(mechanism.q, mechanism.kinematics, strict=True)]
    method = KanesMethod(mechanism.frame, list(mechanism.q), list(mechanism.u), kd_eqs=rates)
    loads = list(mechanism.loads)
    if mechanism.gravity is not None:
        loads += [(body.masscenter, body.mass * mechanism.gravity) for body in mechanism.bodies]
    with warnings.catch_warnings():  # around loops it does not matter which way a velocity is found
        warnings.simplefilter("ignore")
        method.kanes_equations(list(mechanism.bodies), loads)
    return method


def _described(given: Any, problem: Problem) -> Mechanism:
    """A mechanism as it is, an object of SymPy's as the mechanism it describes."""
    if isinstance(given, Mechanism):
        return given
    settings = Settings(defaults=problem.compile_options.get("defaults", {}))
    return Scene(given, Asked(settings, {}, ())).described()[0]


def _holonomic(mechanism: Mechanism) -> list[Any]:
    closures = [c for closure in mechanism.closures for c in closure.constraints()]
    return [*mechanism.configuration_constraints, *closures]


def _at_velocity_level(mechanism: Mechanism) -> list[Expr]:
    t = dynamicsymbols._t
    rates = [c.expression.diff(t) for c in _holonomic(mechanism)]
    rates += [c.expression for c in mechanism.motion_constraints]
    return [rate.xreplace(mechanism.rates) for rate in rates]


def _parts(values: Sequence[Any], *sizes: int) -> list[Sequence[Any]]:
    found, start = [], 0
    for size in sizes:
        found.append(values[start : start + size])
        start += size
    return found


def _rows(entries: Sequence[Any], width: int) -> list[list[Any]]:
    return [list(entries[k : k + width]) for k in range(0, len(entries), width)]
