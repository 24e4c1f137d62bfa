"""Positions and rates of momentum as full expressions, for joint reactions."""

from __future__ import annotations

from collections.abc import Mapping

from sympy import Expr
from sympy.physics.mechanics import Point, ReferenceFrame
from sympy.physics.vector import Vector

from mechc_codegen.derive.tree.tape import V3, Tape
from mechc_codegen.description.joints.tree import Body
from mechc_codegen.description.mechanism import Mechanism
from mechc_codegen.description.terms import multiplier


class WrittenKinetics(Tape):
    """Expressions of coordinates, speeds and their rates, none of them named.

    ``momenta``: linear momentum of each body, and angular momentum about its mass centre.
    """

    def __init__(self, mechanism: Mechanism, momenta: Mapping[Body, tuple[Vector, Vector]]) -> None:
        super().__init__(())
        self.mechanism, self.momenta = mechanism, momenta

    def keep(self, value: Expr) -> Expr:
        return value

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
