"""Joint reactions of a tree: positions and rates of momentum link by link."""

from __future__ import annotations

from sympy import Expr
from sympy.physics.mechanics import Point
from sympy.physics.vector import Vector

from mechc_codegen.derive.equations import Symbols
from mechc_codegen.derive.tree.accelerations import LinkAccelerations
from mechc_codegen.derive.tree.bodies import LinkBodies
from mechc_codegen.derive.tree.links import Links
from mechc_codegen.derive.tree.tape import V3
from mechc_codegen.description.joints.tree import Body
from mechc_codegen.description.mechanism import Mechanism


class TreeKinetics:
    """Positions and momentum rates as values on the tape."""

    def __init__(
        self, mechanism: Mechanism, links: Links, loaded: LinkBodies, symbols: Symbols
    ) -> None:
        self.mechanism, self.links, self.symbols = mechanism, links, symbols
        self.bodies = dict(zip(mechanism.bodies, loaded.bodies, strict=True))
        self.moving = LinkAccelerations(links, symbols)
        tape = links.tape
        self.total, self.difference = tape.total, tape.difference
        self.cross, self.scale = tape.cross, tape.scale

    def along(self, vector: Vector) -> V3:
        return self.links.frames.along(vector.xreplace(self.mechanism.rates))

    def position(self, point: Point) -> V3:
        return self.links.motion(point).position

    def multiplier(self, row: int) -> Expr:
        return self.symbols.multipliers[row]

    def momentum_rates(self, body: Body) -> tuple[V3, V3]:
        tape, on = self.links.tape, self.bodies[body]
        omega = self.links.frame_of(on.centre.link).omega
        momentum = tape.transform(on.inertia, omega)
        turning = tape.transform(on.inertia, self.moving.of_frame(on.centre.link))
        linear = tape.scale(on.mass, self.moving.of_point(on.centre))
        return linear, tape.total(turning, tape.cross(omega, momentum))
