"""The four-bar along the tangent of its closure: equations that are regular at dead points.

With n_i = l_j l_k sin(theta_k - theta_j), (i, j, k) in turn, q' = w n keeps the loop closed, and
the one equation left is A w' = -(w^2 A' / 2 + V'), A = n.M n, ' along n: no constraint, no row to
solve for, no dependent coordinate.  n vanishes at change points only.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any

import mpmath


def elbow_up(theta: Any, lengths: Sequence[Any]) -> list[Any]:
    """All angles, of the crank's, in mpmath: by the triangle of coupler and rocker."""
    l0, l1, l2, l3 = map(mpmath.mpmathify, lengths)
    reach = l3 - l0 * mpmath.expj(theta)  # = l1 z1 + l2 z2
    size = abs(reach)
    second = mpmath.arg(reach) + mpmath.acos((l1**2 + size**2 - l2**2) / (2 * l1 * size))
    return [theta, second, mpmath.arg(reach - l1 * mpmath.expj(second))]


TURN = ((1, 2), (2, 0), (0, 1))
PAIRS = ((0, 1), (0, 2), (1, 2))


class TangentBar:
    """A four-bar of thin rods; lengths (4,) in m, masses (3,) in kg, free fall in m/s^2.

    ``number``, ``sin`` and ``cos`` are those of an arithmetic: of floats, or of mpmath.
    """

    def __init__(
        self, lengths: Sequence[float], masses: Sequence[float], g: float = 9.81, *,
        number: Any = float, sin: Any = math.sin, cos: Any = math.cos,
    ) -> None:  # fmt: skip
        self.sin, self.cos = sin, cos
        inertia = [number(masses[k] * lengths[k] ** 2 / 12) for k in range(3)]  # as doubles have it
        l, m, g = [number(x) for x in lengths[:3]], [number(x) for x in masses], number(g)
        after = [sum(m[k + 1 :]) for k in range(3)]
        products = [l[j] * l[k] for j, k in TURN]
        self.products = [x / max(products) for x in products]
        self.diagonal = [inertia[k] + (m[k] / 4 + after[k]) * l[k] ** 2 for k in range(3)]
        self.coupled = [l[i] * l[j] * (m[j] / 2 + after[j]) for i, j in PAIRS]
        self.weight = [g * l[k] * (m[k] / 2 + after[k]) for k in range(3)]

    def normal(self, q: Sequence[Any]) -> list[Any]:
        return [
            size * self.sin(q[k] - q[j]) for size, (j, k) in zip(self.products, TURN, strict=True)
        ]

    def rates(self, y: Sequence[Any]) -> list[Any]:
        """Of (theta_0..2, w)."""
        *q, w = y
        n = self.normal(q)
        dn = [
            size * self.cos(q[k] - q[j]) * (n[k] - n[j])
            for size, (j, k) in zip(self.products, TURN, strict=True)
        ]
        between = [(self.cos(q[i] - q[j]), self.sin(q[i] - q[j])) for i, j in PAIRS]
        return [*(w * x for x in n), self.acceleration(w, n, dn, between, map(self.cos, q))]

    def acceleration(
        self, w: Any, n: Sequence[Any], dn: Sequence[Any], between: Iterable[tuple[Any, Any]],
        level: Iterable[Any],
    ) -> Any:  # fmt: skip
        """w' of A w' + w^2 A' / 2 + V' = 0, q' = w n and n' = w dn; of cosines and sines between
        links, and cosines of their angles."""
        A = sum(d * x * x for d, x in zip(self.diagonal, n, strict=True))
        slope = sum(2 * d * x * dx for d, x, dx in zip(self.diagonal, n, dn, strict=True))
        for size, (i, j), (c, s) in zip(self.coupled, PAIRS, between, strict=True):
            A += 2 * size * n[i] * n[j] * c
            slope += (
                2 * size * ((dn[i] * n[j] + n[i] * dn[j]) * c - n[i] * n[j] * s * (n[i] - n[j]))
            )
        force = sum(f * c * x for f, c, x in zip(self.weight, level, n, strict=True))
        return -(w * w * slope / 2 + force) / A

    def state(self, y: Sequence[Any]) -> list[Any]:
        """[theta, omega] of (theta_0..2, w)."""
        return [*y[:3], *(y[3] * x for x in self.normal(y[:3]))]
