"""Positions and rates of momentum as full expressions, for joint reactions."""

from __future__ import annotations

from collections.abc import Mapping

from sympy import Expr, S
from sympy.physics.mechanics import Point, ReferenceFrame
from sympy.physics.vector import Vector

from mechc_codegen.description.joints.tree import Body
from mechc_codegen.description.mechanism import Mechanism
from mechc_codegen.description.terms import multiplier

V3 = tuple[Expr, Expr, Expr]


class WrittenKinetics:
    """Expressions of coordinates, speeds and their rates.

    ``momenta``: linear momentum of each body, and angular momentum about its mass centre.
    """

    def __init__(self, mechanism: Mechanism, momenta: Mapping[Body, tuple[Vector, Vector]]) -> None:
        self.mechanism, self.momenta = mechanism, momenta

    def total(self, *vectors: V3) -> V3:
        x, y, z = (sum(parts, S.Zero) for parts in zip(*vectors, strict=True))
        return x, y, z

    def difference(self, a: V3, b: V3) -> V3:
        return self.total(a, self.scale(S.NegativeOne, b))

    def cross(self, a: V3, b: V3) -> V3:
        return (
            a[1] * b[2] - a[2] * b[1],
            a[2] * b[0] - a[0] * b[2],
            a[0] * b[1] - a[1] * b[0],
        )

    def scale(self, factor: Expr, a: V3) -> V3:
        return factor * a[0], factor * a[1], factor * a[2]

    def along(self, vector: Vector) -> V3:
        frame: ReferenceFrame = self.mechanism.frame
        return vector.dot(frame.x), vector.dot(frame.y), vector.dot(frame.z)

    def position(self, point: Point) -> V3:
        return self.along(point.pos_from(self.mechanism.origin))

    def multiplier(self, row: int) -> Expr:
        return multiplier(row)

    def momentum_rates(self, body: Body) -> tuple[V3, V3]:
        linear, angular = (self.along(p.dt(self.mechanism.frame)) for p in self.momenta[body])
        return linear, angular
