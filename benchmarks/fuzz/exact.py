"""The motion of a case in 50 digits, from equations written by hand: the third way, where the two
runs of the judge end apart.

An end of a crank goes around a circle, p = c + a cos q + b sin q, so that its mass has the inertia
m r^2; a rod between two ends is one row, (|p_j - p_i|^2 - L^2) / 2 = 0.  M q'' + J^T lambda = F,
J q'' = gamma, solved for the multipliers first; Gragg's extrapolation.  The rod that is redundant
is left out.
"""

from __future__ import annotations

from typing import Any

import mpmath
import numpy as np
from mpmath import mpf

from ..references.extrapolation import Vector, by_extrapolation
from ..timing.cases import Array
from .draw import Case
from .scenes import TOPOLOGIES

LONGEST = "0.02"  # s
UP = (mpf(0), mpf(4) / 5, mpf(3) / 5)
ROUNDS = 8  # of Newton's method from a start that is closed in doubles


class Cranks:
    """A case's cranks and its rods that are not redundant."""

    def __init__(self, case: Case) -> None:
        shape = TOPOLOGIES[case.topology]
        self.rods = shape.rods[: shape.cranks - 1]
        self.lengths = [mpf(case.params[f"L_{i}{j}"]) for i, j in self.rods]
        self.circles = [_circle(case.params, k) for k in range(shape.cranks)]
        self.masses = [mpf(case.params[f"m_{k}"]) for k in range(shape.cranks)]
        radii = [mpf(case.params[f"r_{k}"]) for k in range(shape.cranks)]
        self.inertia = [m * r * r for m, r in zip(self.masses, radii, strict=True)]
        self.g = mpf(case.params["g"])

    def rates(self, y: Vector) -> Vector:
        """Of [q, u]."""
        size = len(y) // 2
        q, u = y[:size], y[size:]
        slopes = [self.moved(k, x, 1) for k, x in enumerate(q)]
        loads = [
            -m * self.g * _dot(UP, slope) for m, slope in zip(self.masses, slopes, strict=True)
        ]
        rows, bends = self.rows(q), self.bends(q, u)
        free = [f / i for f, i in zip(loads, self.inertia, strict=True)]
        across = mpmath.matrix(len(rows))
        for i, row in enumerate(rows):
            for j, other in enumerate(rows):
                across[i, j] = _dot(row, [x / m for x, m in zip(other, self.inertia, strict=True)])
        wanted = [_dot(row, free) - bend for row, bend in zip(rows, bends, strict=True)]
        pulls = mpmath.lu_solve(across, mpmath.matrix(wanted))
        held = [sum(row[k] * pulls[i] for i, row in enumerate(rows)) for k in range(size)]
        return [*u, *(a - h / m for a, h, m in zip(free, held, self.inertia, strict=True))]

    def moved(self, k: int, q: Any, order: int) -> Vector:
        """The end of crank k, or its first or second derivative."""
        centre, a, b = self.circles[k]
        c, s = mpmath.cos(q), mpmath.sin(q)
        along, across = ((c, s), (-s, c), (-c, -s))[order]
        origin = [mpf(0)] * 3 if order else centre
        return [o + along * x + across * z for o, x, z in zip(origin, a, b, strict=True)]

    def rows(self, q: Vector) -> list[Vector]:
        found = []
        for i, j in self.rods:
            apart, row = self._apart(q, i, j), [mpf(0)] * len(q)
            row[i] = -_dot(apart, self.moved(i, q[i], 1))
            row[j] = _dot(apart, self.moved(j, q[j], 1))
            found.append(row)
        return found

    def bends(self, q: Vector, u: Vector) -> Vector:
        """gamma: what the rows lack at constant speeds."""
        found = []
        for i, j in self.rods:
            ends = [(k, [u[k] * x for x in self.moved(k, q[k], 1)]) for k in (i, j)]
            speed = _less(ends[1][1], ends[0][1])
            turn = _less(*([u[k] ** 2 * x for x in self.moved(k, q[k], 2)] for k in (j, i)))
            found.append(-_dot(speed, speed) - _dot(self._apart(q, i, j), turn))
        return found

    def gaps(self, q: Vector) -> Vector:
        apart = [self._apart(q, i, j) for i, j in self.rods]
        return [(_dot(d, d) - l * l) / 2 for d, l in zip(apart, self.lengths, strict=True)]

    def _apart(self, q: Vector, i: int, j: int) -> Vector:
        return _less(self.moved(j, q[j], 0), self.moved(i, q[i], 0))

    def closed(self, y: Vector) -> Vector:
        """The nearest state with closed loops."""
        size = len(y) // 2
        q, u = y[:size], y[size:]
        for _ in range(ROUNDS):
            q = _less(q, _least(self.rows(q), self.gaps(q)))
        rows = self.rows(q)
        return [*q, *_less(u, _least(rows, [_dot(row, u) for row in rows]))]

    def energy(self, y: Vector) -> Any:
        size = len(y) // 2
        kinetic = sum(i * u * u / 2 for i, u in zip(self.inertia, y[size:], strict=True))
        heights = [_dot(UP, self.moved(k, x, 0)) for k, x in enumerate(y[:size])]
        return kinetic + self.g * _dot(self.masses, heights)


def end(case: Case, y0: Array) -> Array:
    """The state at the end, rounded."""
    cranks = Cranks(case)
    start = cranks.closed([mpf(float(x)) for x in y0])
    (last,) = by_extrapolation(cranks.rates, start, [case.t_end], LONGEST)
    return np.array(last, float)


def _circle(params: dict[str, float], k: int) -> tuple[Vector, Vector, Vector]:
    """Centre, and the radii where q is 0 and 90 degrees."""
    x, y, z, a, b, r, h = (mpf(params[f"{kind}_{k}"]) for kind in "xyzabrh")
    ca, sa, cb, sb = mpmath.cos(a), mpmath.sin(a), mpmath.cos(b), mpmath.sin(b)
    axes = [[cb, sa * sb, -ca * sb], [mpf(0), ca, sa], [sb, -sa * cb, ca * cb]]
    centre = [p + h * n for p, n in zip((x, y, z), axes[2], strict=True)]
    return centre, [r * n for n in axes[0]], [r * n for n in axes[1]]


def _least(rows: list[Vector], gaps: Vector) -> Vector:
    """The shortest step that closes gaps."""
    across = mpmath.matrix([[_dot(row, other) for other in rows] for row in rows])
    shares = mpmath.lu_solve(across, mpmath.matrix(gaps))
    return [sum(row[k] * shares[i] for i, row in enumerate(rows)) for k in range(len(rows[0]))]


def _less(a: Vector, b: Vector) -> Vector:
    return [x - y for x, y in zip(a, b, strict=True)]


def _dot(a: Any, b: Any) -> Any:
    return mpmath.fdot(zip(a, b, strict=True))
