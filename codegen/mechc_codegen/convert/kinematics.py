"""Implicit kinematic differential equations -> the coordinates' rates.

Each block is solved by cofactors and the determinant.  Nothing but the determinant is divided by,
so that 0/0 cannot arise where the equations can be solved, as it can by elimination in a fixed
order.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NoReturn

from sympy import Derivative, Expr, ImmutableDenseMatrix, S
from sympy.core.function import AppliedUndef
from sympy.physics.mechanics import dynamicsymbols
from sympy.utilities.iterables import connected_components

from mechc_codegen.description.mechanism import printed_name
from mechc_codegen.errors import MechanismError

_MOST_COFACTORS = 5  # larger coupled blocks are eliminated


def coordinate_rates(equations: Sequence[Expr], q: Sequence[AppliedUndef]) -> tuple[Expr, ...]:
    """Solve ``equations = 0`` for the rates of ``q``, in which they are linear.

    Raises
    ------
    MechanismError
        If there are too many or too few, or they are not linear or not solvable.
    """
    if len(equations) != len(q):
        raise MechanismError(
            f"{len(q)} coordinates need as many kinematic differential equations; there are "
            f"{len(equations)}"
        )
    rates = [x.diff(dynamicsymbols._t) for x in q]
    matrix = [
        [e.diff(rate) if rate in held else S.Zero for rate in rates]
        for e, held in ((e, e.atoms(Derivative)) for e in equations)
    ]
    rest = [e.xreplace(dict.fromkeys(rates, S.Zero)) for e in equations]
    for row in matrix:
        if any(entry.has(*rates) for entry in row if entry.free_symbols):
            raise MechanismError("the kinematic differential equations are not linear in q'")
    found: dict[int, Expr] = {}
    for rows, columns in _blocks(matrix):
        if len(rows) != len(columns):
            _refuse(q, columns or range(len(q)))
        block = ImmutableDenseMatrix([[matrix[i][j] for j in columns] for i in rows])
        solved = _solve(block, [-rest[i] for i in rows])
        if solved is None:
            _refuse(q, columns)
        found.update(zip(columns, solved, strict=True))
    return tuple(found[j] for j in range(len(q)))


def _blocks(matrix: Sequence[Sequence[Expr]]) -> list[tuple[list[int], list[int]]]:
    """(rows, columns) of the independent blocks of the system."""
    size = len(matrix)
    nodes = [("row", i) for i in range(size)] + [("column", j) for j in range(size)]
    edges = [
        (("row", i), ("column", j)) for i in range(size) for j in range(size) if matrix[i][j] != 0
    ]
    parts = connected_components((nodes, edges))
    return [
        (
            sorted(k for kind, k in part if kind == "row"),
            sorted(k for kind, k in part if kind == "column"),
        )
        for part in parts
    ]


def _solve(block: ImmutableDenseMatrix, right: list[Expr]) -> list[Expr] | None:
    size = block.rows
    if size > _MOST_COFACTORS:
        return list(block.LUsolve(ImmutableDenseMatrix(right)))
    determinant = _determinant(block.tolist())
    if determinant == 0:
        return None
    columns = block.T.tolist()
    solved = []
    for j in range(size):
        replaced = [right if k == j else columns[k] for k in range(size)]
        solved.append(_determinant(replaced) / determinant)
    return solved


def _determinant(rows: list[list[Expr]]) -> Expr:
    """By expansion along the first row, without division."""
    if len(rows) == 1:
        return rows[0][0]
    total = S.Zero
    for j, entry in enumerate(rows[0]):
        if entry != 0:
            minor = [row[:j] + row[j + 1 :] for row in rows[1:]]
            total += (-1) ** j * entry * _determinant(minor)
    return total


def _refuse(q: Sequence[AppliedUndef], columns: Sequence[int]) -> NoReturn:
    names = ", ".join(printed_name(q[j]) for j in columns)
    raise MechanismError(
        f"the kinematic differential equations do not determine the rates of {names}"
    )
