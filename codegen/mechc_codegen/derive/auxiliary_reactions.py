"""Forces and torques that keep auxiliary speeds zero, by virtual motions along these.

Input: a mechanism with reactions, its other loads, the momenta of its bodies.  Output: each
reaction as an expression of state and accelerations.  Where one auxiliary speed is 1 in a virtual
motion and the other speeds satisfy the constraints, loads and reactions have the power of the rates
of momentum (Kane & Levinson 1985, on noncontributing forces).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NoReturn

from sympy import Add, Expr, S
from sympy.physics.mechanics import Point, ReferenceFrame, dynamicsymbols
from sympy.physics.vector import Vector

from mechc_codegen.description.mechanism import Load, Mechanism, printed_name
from mechc_codegen.description.terms import velocity_of
from mechc_codegen.errors import MechanismError

Matrix = list[list[Expr]]


def reaction_values(
    mechanism: Mechanism, loads: Iterable[Load], momenta: Iterable[Load]
) -> dict[Expr, Expr]:
    """The value of each reaction, by its symbol.

    Parameters
    ----------
    loads
        All other loads.
    momenta
        (mass centre, m v) and (frame, I . omega) of each body.

    Raises
    ------
    MechanismError
        If the auxiliary speeds do not determine the reactions.
    """
    if not mechanism.reactions:
        return {}
    motions = [_VirtualMotion(mechanism, k) for k in range(len(mechanism.auxiliary))]
    rates = [(place, momentum.dt(mechanism.frame)) for place, momentum in momenta]
    loads = list(loads)
    symbols = [reaction.symbol for reaction in mechanism.reactions]
    rows: Matrix = []
    for motion in motions:
        row = [motion.power(reaction.per_unit) for reaction in mechanism.reactions]
        if any(entry != 0 for entry in row):
            rows.append([*row, motion.power(rates) - motion.power(loads)])
    if len(rows) != len(symbols):
        _refuse(symbols, f"{len(rows)} auxiliary speeds that they act on")
    values = solve(rows)
    if values is None:
        _refuse(symbols, "auxiliary speeds on which they act alike")
    return dict(zip(symbols, values, strict=True))


def _refuse(symbols: Sequence[Expr], why: str) -> NoReturn:
    names = ", ".join(map(printed_name, symbols))
    raise MechanismError(
        f"reactions: {names} are not determined by {why}: give an auxiliary speed along each"
    )


class _VirtualMotion:
    """The virtual motion along one auxiliary speed."""

    def __init__(self, mechanism: Mechanism, number: int) -> None:
        self._mechanism = mechanism
        self._speed = mechanism.auxiliary[number]
        time = dynamicsymbols._t
        pairs = zip(mechanism.q, mechanism.kinematics, strict=True)
        self._moving = {q.diff(time): rate for q, rate in pairs}
        self._along = {self._speed: S.One} | self._dependent()

    def _dependent(self) -> dict[Expr, Expr]:
        """The least speeds with which the constraints hold: G u = -b, u = G^T (G G^T)^-1 (-b)."""
        rows = [e.xreplace(self._moving) for e in self._mechanism.auxiliary_constraints]
        sides = [-row.diff(self._speed) for row in rows]
        if not any(sides):
            return {}
        speeds = self._mechanism.u
        matrix = [[row.diff(u) for u in speeds] for row in rows]
        square = [
            [*(_product(one, other) for other in matrix), side]
            for one, side in zip(matrix, sides, strict=True)
        ]
        factors = solve(square)
        if factors is None:
            _refuse([r.symbol for r in self._mechanism.reactions], "constraints on the speeds")
        columns = zip(*matrix, strict=True)
        return {u: _product(column, factors) for u, column in zip(speeds, columns, strict=True)}

    def power(self, loads: Iterable[Load]) -> Expr:
        """The power of forces and torques in this motion."""
        return Add(*(self._speed_of(place).dot(vector) for place, vector in loads))

    def _speed_of(self, place: Point | ReferenceFrame) -> Vector:
        frame = self._mechanism.frame
        velocity = velocity_of(place, frame).xreplace(self._moving)
        parts = (
            factor * velocity.diff(u, frame, var_in_dcm=False) for u, factor in self._along.items()
        )
        return sum(parts, Vector(0)).xreplace(dict.fromkeys(self._mechanism.auxiliary, S.Zero))


def _product(one: Iterable[Expr], other: Iterable[Expr]) -> Expr:
    return Add(*(a * b for a, b in zip(one, other, strict=True)))


def solve(rows: Matrix) -> list[Expr] | None:
    """The solution of linear equations given as rows with the right side last; None without one.

    By elimination; the pivots are diagonal entries where these are not zero.
    """
    rows, size = [row[:] for row in rows], len(rows)
    for k in range(size):
        pivot = next((i for i in range(k, size) if rows[i][k] != 0), None)
        if pivot is None:
            return None
        rows[k], rows[pivot] = rows[pivot], rows[k]
        for i in range(k + 1, size):
            if rows[i][k] != 0:
                factor = rows[i][k] / rows[k][k]
                rows[i] = [a - factor * b for a, b in zip(rows[i], rows[k], strict=True)]
                rows[i][k] = S.Zero
    found: list[Expr] = []
    for k in reversed(range(size)):
        known = _product(rows[k][k + 1 : size], found)
        found.insert(0, (rows[k][size] - known) / rows[k][k])
    return found
