"""Implicit kinematic differential equations -> the coordinates' rates.

Each block is solved by cofactors and the determinant.  Nothing but the determinant is divided by,
so that 0/0 cannot arise where the equations can be solved, as it can by elimination in a fixed
order.  Where that determinant vanishes at some configurations, as with three angular velocities and
the rate of one component of a quaternion, the rate of a configuration constraint takes the place of
an equation, if the determinant is then the same at all.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from typing import NoReturn

from sympy import Derivative, Expr, ImmutableDenseMatrix, S, Symbol, cancel
from sympy.core.function import AppliedUndef
from sympy.physics.mechanics import dynamicsymbols
from sympy.utilities.iterables import connected_components

from mechc_codegen.convert.algebra import evaluator, random_point
from mechc_codegen.description.mechanism import printed_name
from mechc_codegen.errors import MechanismError

_TIME = dynamicsymbols._t
_MOST_COFACTORS = 5  # larger coupled blocks are eliminated


def coordinate_rates(
    equations: Sequence[Expr], q: Sequence[AppliedUndef], configuration: Sequence[Expr] = ()
) -> tuple[Expr, ...]:
    """Solve ``equations = 0`` for the rates of ``q``, in which they are linear.

    ``configuration``: constraints on q, whose rates vanish too.

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
        right = [-rest[i] for i in rows]
        solved = _with_constraint_rate(block, right, [q[j] for j in columns], configuration)
        solved = solved or _solve(block, right)
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
    """The determinant by expansion along the first row, without division."""
    if len(rows) == 1:
        return rows[0][0]
    total = S.Zero
    for j, entry in enumerate(rows[0]):
        if entry != 0:
            minor = [row[:j] + row[j + 1 :] for row in rows[1:]]
            total += (-1) ** j * entry * _determinant(minor)
    return total


def _with_constraint_rate(
    block: ImmutableDenseMatrix,
    right: list[Expr],
    q: Sequence[AppliedUndef],
    configuration: Sequence[Expr],
) -> list[Expr] | None:
    """The rates after one equation is replaced by the rate of a constraint c(q), a . q' = b.

    None where the determinant of the block is the same everywhere, or that of no such exchange is.
    q' is the solution with c' = b - a . q', of which both sides vanish as the motion keeps c: so
    the rate of c depends on the speeds, and projecting the speeds keeps c and the equation.
    """
    still = dict.fromkeys(q, S.One)
    own = [c for c in configuration if not c.xreplace(still).has(AppliedUndef, _TIME)]
    if not own or block.rows > _MOST_COFACTORS or not block.atoms(AppliedUndef) & set(q):
        return None
    places = _SampleConfigurations(block, own, q)
    if places.same_everywhere(_determinant(block.tolist())):
        return None
    for constraint, i in product(own, range(block.rows)):
        rows = block.tolist()
        equation, rows[i] = rows[i], [constraint.diff(x) for x in q]
        if not places.same_everywhere(_determinant(rows)):
            continue
        exchanged = ImmutableDenseMatrix(rows)
        kept = _solve(exchanged, [*right[:i], S.Zero, *right[i + 1 :]]) or []
        across = _solve(exchanged, [S.One if k == i else S.Zero for k in range(block.rows)]) or []
        kept, across = [cancel(x) for x in kept], [cancel(x) for x in across]
        missed = right[i] - sum((a * x for a, x in zip(equation, kept, strict=True)), S.Zero)
        return [a + missed * b for a, b in zip(kept, across, strict=True)]
    return None


class _SampleConfigurations:
    """Random configurations in which constraints hold."""

    def __init__(
        self, block: ImmutableDenseMatrix, constraints: Sequence[Expr], q: Sequence[AppliedUndef]
    ) -> None:
        held = {x for e in (*block, *constraints) for x in e.atoms(AppliedUndef, Symbol)}
        self.arguments = [*q, *sorted(held - {*q, _TIME}, key=str)]
        gap = evaluator(self.arguments, list(constraints))
        size, moving = len(self.arguments), range(len(q))
        found = (random_point(gap, size, seed, moving) for seed in range(1, 6))
        self.points = [point for point in found if point is not None]

    def same_everywhere(self, expression: Expr) -> bool:
        """Whether an expression has the same value at all these configurations, other than zero."""
        evaluate = evaluator(self.arguments, [expression])
        values = [evaluate(*point)[0] for point in self.points]
        size = max(map(abs, values), default=0.0)
        return size > 0.0 and max(values) - min(values) < 1e-9 * size


def _refuse(q: Sequence[AppliedUndef], columns: Sequence[int]) -> NoReturn:
    names = ", ".join(printed_name(q[j]) for j in columns)
    raise MechanismError(
        f"the kinematic differential equations do not determine the rates of {names}"
    )
