"""A problem's equations by SymPy's ``KanesMethod`` as in a textbook.

As many independent speeds as there are degrees of freedom; the loops are closed by dependent
coordinates and speeds, with the closure and its rate as constraints.  Which are dependent is
chosen by the pivots of the constraint Jacobian at the start; a split that is bad later, as every
split is at a change point, stays.
"""

from __future__ import annotations

import time
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import sympy
from mechc_codegen.description.mechanism import Mechanism
from sympy import Expr, Matrix, Symbol
from sympy.physics.mechanics import KanesMethod, dynamicsymbols

from ..problems.problem import Array, NotExpressibleError, Problem
from .described import form_equations, holonomic, kinematic_equations

t = dynamicsymbols._t
MOST_DEPENDENT = 10  # of more, eliminated symbolically, lambdify takes minutes
REPEATED = 1e-10  # pivots smaller than this, of the largest, are those of repeated constraints


@dataclass(frozen=True, eq=False)
class TextbookEquations:
    """Kane's equations, and the rates of the constraints below them, of the problem's own state.

    Attributes
    ----------
    q, u
        Coordinates and speeds in the problem's order.
    q_rates
        q', (n, 1).
    mass_matrix, forcing
        Of u': (o, o) and (o, 1), the columns in the order of ``u``.
    mass_matrix_full, forcing_full
        Of [q', u']: (n + o, n + o) and (n + o, 1).
    constants, values
        The parameters that they hold.
    seconds
        Time of the derivation.
    """

    q: tuple[Expr, ...]
    u: tuple[Expr, ...]
    q_rates: Matrix
    mass_matrix: Matrix
    forcing: Matrix
    mass_matrix_full: Matrix
    forcing_full: Matrix
    constants: tuple[Symbol, ...]
    values: Array
    seconds: float


@cache
def textbook(problem: Problem, solver: str = "LU") -> TextbookEquations:
    """Form the equations of a problem; once in a process.

    Parameters
    ----------
    solver
        How SymPy solves for the dependent speeds: "LU", its default, or "CRAMER", which its
        documentation recommends where the expressions of "LU" grow.

    Raises
    ------
    NotExpressibleError
        If KanesMethod cannot express the problem: repeated constraints, states and inputs besides
        coordinates and speeds, or more dependent speeds than SymPy eliminates in minutes.
    """
    values, began = problem.values, time.perf_counter()  # the former compiles mechc's model
    given = problem.given.mechanism()
    if isinstance(given, Mechanism):
        q, u = given.q, given.u
        method = _formed(given, problem, solver)
    elif isinstance(given, KanesMethod):
        q, u = tuple(given.q), tuple(given.u)
        method = given
    else:
        raise NotExpressibleError(f"its equations are formed by {type(given).__name__}")
    full, forcing_full = _ordered(method.mass_matrix_full, method, q, u), method.forcing_full
    constants = sorted(_symbols(full, forcing_full), key=str)
    rates = method.kindiffdict()
    return TextbookEquations(
        q=q, u=u,
        q_rates=Matrix([rates[x.diff(t)] for x in q]),
        mass_matrix=_ordered(method.mass_matrix, method, (), u), forcing=method.forcing,
        mass_matrix_full=full, forcing_full=forcing_full,
        constants=tuple(constants),
        values=np.array([values[symbol.name] for symbol in constants]),
        seconds=time.perf_counter() - began,
    )  # fmt: skip


def _formed(mechanism: Mechanism, problem: Problem, solver: str) -> KanesMethod:
    """KanesMethod of a mechanism, its equations formed."""
    _refuse_what_it_cannot_hold(mechanism)
    position = holonomic(mechanism)
    velocity = [h.diff(t).xreplace(mechanism.rates) for h in position]
    velocity += [c.expression for c in mechanism.motion_constraints]
    q_ind, q_dep, position = _split(position, mechanism.q, mechanism, problem)
    u_ind, u_dep, velocity = _split(velocity, mechanism.u, mechanism, problem)
    constraints: dict[str, Any] = {}
    if velocity:
        constraints = {"u_dependent": u_dep, "velocity_constraints": velocity}
        constraints["constraint_solver"] = solver
    if position:
        constraints |= {"q_dependent": q_dep, "configuration_constraints": position}
    rates = kinematic_equations(mechanism)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        method = KanesMethod(mechanism.frame, q_ind, u_ind, kd_eqs=rates, **constraints)
    return form_equations(method, mechanism)


def _refuse_what_it_cannot_hold(mechanism: Mechanism) -> None:
    if mechanism.states or mechanism.inputs or mechanism.lagrangian is not None:
        raise NotExpressibleError(
            "KanesMethod has no states beside coordinates and speeds, no inputs and no Lagrangian"
        )


def _split(
    rows: Sequence[Expr], variables: Sequence[Expr], mechanism: Mechanism, problem: Problem
) -> tuple[list[Expr], list[Expr], list[Expr]]:
    """Independent variables, dependent ones, and the rows, in the order of elimination.

    SymPy eliminates in the order given, and divides by what comes first even where that vanishes.
    """
    if not rows:
        return list(variables), [], []
    if len(rows) > MOST_DEPENDENT:
        raise NotExpressibleError(f"lambdify takes minutes with {len(rows)} dependent speeds")
    J = Matrix(rows).jacobian(list(variables))
    parameters = [p.symbol for p in mechanism.parameters]
    jacobian = sympy.lambdify([t, *mechanism.q, *mechanism.u, *parameters], J, cse=True)
    at_start = jacobian(0.0, *problem.given.start, *[problem.values[p.name] for p in parameters])
    order, dependent = pivots(np.array(at_start, float))
    independent = [x for k, x in enumerate(variables) if k not in dependent]
    return independent, [variables[k] for k in dependent], [rows[k] for k in order]


def pivots(J: Array) -> tuple[list[int], list[int]]:
    """Rows and columns of elimination with complete pivoting, the largest entry first."""
    left, rows, columns = J.copy(), list[int](), list[int]()
    for _ in J:
        row, column = map(int, np.unravel_index(np.abs(left).argmax(), J.shape))
        pivot = left[row, column]
        if abs(pivot) <= REPEATED * np.abs(J).max():
            raise NotExpressibleError(
                "KanesMethod needs as many dependent speeds as constraints, and some of these "
                "constraints repeat others"
            )
        left -= np.outer(left[:, column], left[row]) / pivot
        left[row], left[:, column] = 0, 0
        rows.append(row)
        columns.append(column)
    return rows, columns


def _ordered(matrix: Matrix, method: KanesMethod, q: Sequence[Expr], u: Sequence[Expr]) -> Matrix:
    """Its columns from the order of ``method``, independent first, to that of the problem."""
    columns = [*(method.q if q else ()), *method.u]
    return matrix[:, [columns.index(x) for x in (*q, *u)]]


def _symbols(*matrices: Matrix) -> set[Symbol]:
    return {x for matrix in matrices for x in matrix.free_symbols} - {t}


def operations(*matrices: Matrix) -> int:
    """Operations of all entries as they are written out, shared subexpressions every time."""
    known: dict[Expr, int] = {}
    return sum(_written_out(entry, known) for matrix in matrices for entry in matrix)


def _written_out(expression: Expr, known: dict[Expr, int]) -> int:
    if not expression.args:
        return 0
    if expression not in known:
        below = sum(_written_out(arg, known) for arg in expression.args)
        known[expression] = below + max(len(expression.args) - 1, 1)
    return known[expression]
