"""Inertia of the links, and the wrench at each reference point, from bodies and loads."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from sympy import Expr, S
from sympy.physics.mechanics import Particle, ReferenceFrame, RigidBody
from sympy.physics.vector import Vector

from mechc_codegen.derive.tree.frames import NotATreeError
from mechc_codegen.derive.tree.links import GROUND, Links, PointMotion
from mechc_codegen.derive.tree.tape import V3, ZERO, dot
from mechc_codegen.description.mechanism import Mechanism, is_rigid

Symmetric3 = Sequence[V3]
NOTHING: Symmetric3 = (ZERO, ZERO, ZERO)


@dataclass(frozen=True)
class Body:
    """One body on its link: mass, motion of the mass centre, central inertia."""

    name: str
    mass: Expr
    centre: PointMotion
    inertia: Symmetric3


class LinkBodies:
    """Sums over the bodies and loads of each link."""

    def __init__(self, mechanism: Mechanism, links: Links) -> None:
        self.links, self.tape = links, links.tape
        self.mechanism = mechanism
        self.bodies = [self._body(body) for body in mechanism.bodies]
        self._applied: dict[int, list[tuple[V3, V3]]] = {}
        self.gravity = ZERO
        if mechanism.gravity is not None:
            self.gravity = links.frames.along(mechanism.gravity)
            if not links.local.constant(self.gravity):
                raise NotATreeError("gravity is not uniform")
        for place, vector in mechanism.loads:
            self._apply(place, vector)

    def inertia(self, link: int) -> tuple[Expr, V3, Symmetric3]:
        """Mass, mass times arm, and inertia about the reference point."""
        tape = self.tape
        mass, moment, about = S.Zero, ZERO, NOTHING
        for body in self._of(link):
            arm = body.centre.arm
            mass += body.mass
            moment = tape.total(moment, tape.scale(body.mass, arm))
            about = _sum(about, body.inertia, self._offset(body.mass, arm))
        return tape.keep(mass), moment, self._keep_matrix(about)

    def wrench(self, link: int) -> tuple[V3, V3]:
        """Moment about the reference point and force: loads minus inertia forces at u' = 0."""
        tape = self.tape
        mass, moment, about = self.inertia(link)
        omega = self.links.frame_of(link).omega
        torque = tape.cross(moment, self.gravity)
        force = tape.scale(mass, self.gravity)
        for arm, load in self._applied.get(link, ()):
            torque, force = tape.total(torque, arm), tape.total(force, load)
        momentum = tape.transform(about, omega)
        gyroscopic = tape.cross(omega, momentum)
        centripetal = tape.cross(omega, tape.cross(omega, moment))
        return tape.difference(torque, gyroscopic), tape.difference(force, centripetal)

    def _of(self, link: int) -> list[Body]:
        return [b for b in self.bodies if b.centre.link == link]

    def _body(self, body: RigidBody | Particle) -> Body:
        frames, local = self.links.frames, self.links.local
        mass = local.to_symbols(S(body.mass))
        if not local.constant([mass]):
            raise NotATreeError(f"the mass of {body.name} changes")
        centre = self.links.motion(body.masscenter)
        if not is_rigid(body):
            return Body(body.name, mass, centre, NOTHING)
        frame = frames.motion(body.frame)
        given = body.central_inertia.to_matrix(body.frame).tolist()
        rows = [local.entries(row) for row in given]
        if not all(local.constant(row) for row in rows):
            raise NotATreeError(f"the inertia of {body.name} changes")
        half = [self.tape.transform(rows, axis) for axis in frame.rotation]
        turned = [[dot(axis, h) for h in half] for axis in frame.rotation]
        return Body(body.name, mass, self.links.turning(centre, frame), self._keep_matrix(turned))

    def _apply(self, place: object, vector: Vector) -> None:
        value = self.links.frames.along(vector.xreplace(self.mechanism.rates))
        if isinstance(place, ReferenceFrame):
            link, wrench = self.links.with_frame(place), (value, ZERO)
        else:
            at = self.links.motion(place)
            link, wrench = at.link, (self.tape.cross(at.arm, value), value)
        if link != GROUND:
            self._applied.setdefault(link, []).append(wrench)

    def _offset(self, mass: Expr, arm: V3) -> Symmetric3:
        """The inertia of a point mass, m (r.r E - r r^T)."""
        square = dot(arm, arm)
        rows = [
            [mass * ((square if i == j else S.Zero) - arm[i] * arm[j]) for j in range(3)]
            for i in range(3)
        ]
        return [(row[0], row[1], row[2]) for row in rows]

    def _keep_matrix(self, matrix: Sequence[Sequence[Expr]]) -> Symmetric3:
        """A symmetric matrix whose lower half is stored on the tape."""
        names = {(i, j): self.tape.keep(matrix[i][j]) for i in range(3) for j in range(i + 1)}
        rows = [[names[max(i, j), min(i, j)] for j in range(3)] for i in range(3)]
        return [(row[0], row[1], row[2]) for row in rows]


def _sum(*matrices: Symmetric3) -> Symmetric3:
    rows = [[sum((m[i][j] for m in matrices), S.Zero) for j in range(3)] for i in range(3)]
    return [(row[0], row[1], row[2]) for row in rows]
