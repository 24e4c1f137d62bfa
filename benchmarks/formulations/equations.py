"""A problem's equations as SymPy's KanesMethod forms them, for tools that take equations.

The open tree's M u' = F comes from ``KanesMethod`` with numbers substituted, the rows J u' = gamma
from differentiating the constraints; nothing of mechc's derivation is used and nothing is
simplified.  Closed loops are M u' + J^T lambda = F, J u' = gamma, index one.

Every tool may take what suits it: the explicit form (``rates``), the matrices (``entries``) or a
residual (``residual``), each a straight-line program that any arithmetic evaluates.
"""

from __future__ import annotations

import time
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np
import sympy
from mechc_codegen.description.mechanism import Mechanism
from sympy import Expr, Float, Matrix, Symbol
from sympy.physics.mechanics import KanesMethod, dynamicsymbols

from ..problems.problem import Array, Observe, Problem
from .described import described, form_equations, holonomic, kinematic_equations
from .program import Program, Tape, program


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
    parameters
        Those that stayed symbols; none in what tools are given.
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
    parameters: tuple[Symbol, ...] = ()
    shortest: tuple[Expr, ...] | None = None
    start: Array | None = None
    observe: Observe | None = None
    seconds: float = 0.0

    @property
    def state(self) -> tuple[Symbol, ...]:
        return (*self.q, *self.u)

    @property
    def arguments(self) -> tuple[Symbol, ...]:
        """Of every program: the state, and parameters that stayed symbols."""
        return (*self.state, *self.parameters)

    @property
    def multipliers(self) -> tuple[Symbol, ...]:
        """One a constraint row."""
        return tuple(Symbol(f"lambda_{k}") for k in range(len(self.velocity)))

    def rates(self) -> Program:
        """(q', u') of the state, solved for by elimination written out."""
        if self.shortest is not None:
            return program(self.arguments, (*self.q_rates, *self.shortest))
        tape, n, m = Tape(), len(self.u), len(self.velocity)
        values = tape.shared((*self.q_rates, *self.M, *self.F, *self.J, *self.gamma))
        q_rates, M, F, J, gamma = _parts(values, len(self.q), n * n, n, m * n, m)
        u_rates = tape.accelerations(_rows(M, n), F, _rows(J, n), gamma)
        return Program(self.arguments, *tape.finished((*q_rates, *u_rates)))

    def entries(self) -> Program:
        """(q', M, F, J, gamma) of the state, matrices row by row; see :meth:`matrices`."""
        return program(self.arguments, (*self.q_rates, *self.M, *self.F, *self.J, *self.gamma))

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
        arguments = (*self.state, *self.multipliers, *q_dot, *u_dot, *self.parameters)
        return program(arguments, (*kinematic, *balance, *rows))

    def constraints(self) -> Program:
        """(position, velocity) residuals of the state."""
        return program(self.arguments, (*self.position, *self.velocity))


@cache
def equations_of(problem: Problem) -> Equations:
    """The equations of a problem with its numbers in, derived once in a process."""
    began = time.perf_counter()
    given = problem.given
    mechanism = described(given.mechanism(), problem.compile_options.get("defaults", {}))
    values = {name: Float(value) for name, value in problem.values.items()}
    found = derive(mechanism, values)
    shortest = given.accelerations and tuple(
        given.accelerations(found.q, found.u, values, sympy.sin, sympy.cos)
    )
    seconds = time.perf_counter() - began
    return replace(
        found, shortest=shortest, start=given.start, observe=given.observe, seconds=seconds
    )


def consistent(equations: Equations) -> tuple[Array, Array]:
    """(n,) accelerations and (m,) multipliers at the start; the least where rows are redundant.

    For solvers of index one, with state q, u and algebraic a and lambda: q' = N u, u' = a,
    M a + J^T lambda = F, J a = gamma.  With a among the unknowns the multipliers are a smooth
    function of the state.  In the shorter form, with u' itself in the balance of forces, a solver's
    u' carries the rounding of u over the step, which the multipliers inherit and the error test
    sees: that takes a hundred times as many evaluations.
    """
    n, m = len(equations.u), len(equations.velocity)
    values = equations.entries().function("math")(*equations.start.tolist())  # type: ignore[union-attr]
    _, M, F, J, gamma = (np.array(part, float) for part in equations.matrices(values))
    J = J.reshape(m, n)
    A = np.block([[M.reshape(n, n), J.T], [J, np.zeros((m, m))]])
    found = np.linalg.lstsq(A, np.concatenate([F, gamma]), rcond=None)[0]
    return found[:n], found[n:]


def derive(mechanism: Mechanism, values: Mapping[str, Expr]) -> Equations:
    """The equations of a mechanism; parameters without a value stay symbols."""
    names = {p.symbol: p.symbol.name for p in mechanism.parameters}
    replaced = {symbol: values[name] for symbol, name in names.items() if name in values}
    q = tuple(Symbol(f"q{k}") for k in range(len(mechanism.q)))
    u = tuple(Symbol(f"u{k}") for k in range(len(mechanism.u)))
    replaced |= dict(zip((*mechanism.q, *mechanism.u), (*q, *u), strict=True))

    def plain(expressions: Iterable[Expr]) -> Matrix:
        return Matrix([x.xreplace(mechanism.rates).xreplace(replaced) for x in expressions])

    tree = open_tree(mechanism)
    q_rates, velocity = plain(mechanism.kinematics), plain(_at_velocity_level(mechanism))
    J = velocity.jacobian(u) if velocity else Matrix(0, len(u), [])
    gamma = -velocity.jacobian(q) * q_rates if velocity else Matrix(0, 1, [])
    return Equations(
        q=q, u=u, q_rates=tuple(q_rates), M=plain(tree.mass_matrix).reshape(len(u), len(u)),
        F=plain(tree.forcing), J=J, gamma=gamma, position=tuple(plain(holonomic(mechanism))),
        velocity=tuple(velocity),
        parameters=tuple(symbol for symbol, name in names.items() if name not in values),
    )  # fmt: skip


def open_tree(mechanism: Mechanism) -> KanesMethod:
    """Kane's equations of the bodies with all speeds independent, constraints left out."""
    method = KanesMethod(
        mechanism.frame, list(mechanism.q), list(mechanism.u),
        kd_eqs=kinematic_equations(mechanism),
    )  # fmt: skip
    return form_equations(method, mechanism)


def _at_velocity_level(mechanism: Mechanism) -> list[Expr]:
    t = dynamicsymbols._t
    rates = [constraint.diff(t) for constraint in holonomic(mechanism)]
    rates += [c.expression for c in mechanism.motion_constraints]
    return rates


def _parts(values: Sequence[Any], *sizes: int) -> list[Sequence[Any]]:
    found, start = [], 0
    for size in sizes:
        found.append(values[start : start + size])
        start += size
    return found


def _rows(entries: Sequence[Any], width: int) -> list[list[Any]]:
    return [list(entries[k : k + width]) for k in range(0, len(entries), width)]
