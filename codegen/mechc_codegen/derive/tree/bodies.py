"""Inertia of the links, and the wrench at each reference point, from bodies and loads."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from sympy import Expr, S
from sympy.physics.mechanics import Particle, ReferenceFrame, RigidBody
from sympy.physics.vector import Dyadic, Vector

from mechc_codegen.derive.tree.frames import NotATreeError
from mechc_codegen.derive.tree.links import GROUND, Links, PointMotion
from mechc_codegen.derive.tree.tape import V3, ZERO
from mechc_codegen.description.mechanism import Mechanism, is_rigid
from mechc_codegen.description.placement import dot

Symmetric3 = Sequence[V3]
NOTHING: Symmetric3 = (ZERO, ZERO, ZERO)


@dataclass(frozen=True)
class LinkBody:
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
            value = links.frames.along(vector.xreplace(mechanism.rates))
            if isinstance(place, ReferenceFrame):
                link, wrench = links.with_frame(place), (value, ZERO)
            else:
                at = links.motion(place)
                link, wrench = at.link, (self.tape.cross(at.arm, value), value)
            if link != GROUND:
                self._applied.setdefault(link, []).append(wrench)

    def inertia(self, link: int) -> tuple[Expr, V3, Symmetric3]:
        """Mass, mass times arm, and inertia about the reference point.

        Of this only the entries about axes that the link can turn about, on which alone its energy
        depends: what only slides needs no moments of inertia.
        """
        tape = self.tape
        mass, moment, bodies = S.Zero, ZERO, [b for b in self.bodies if b.centre.link == link]
        omega = self.links.frame_of(link).omega
        for body in bodies:
            mass += body.mass
            moment = tape.total(moment, tape.scale(body.mass, body.centre.arm))

        def about(i: int, j: int) -> Expr:
            """Central inertia and that of the mass in the centre, m (r.r E - r r^T)."""
            total: Expr = S.Zero
            if omega[i] == 0 or omega[j] == 0:
                return total
            for body in bodies:
                arm = body.centre.arm
                square = dot(arm, arm) if i == j else S.Zero
                total = sum((body.inertia[i][j], body.mass * (square - arm[i] * arm[j])), total)
            return total

        return tape.keep(mass), moment, tape.symmetric(about)

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

    def _body(self, body: RigidBody | Particle) -> LinkBody:
        frames, local = self.links.frames, self.links.local
        mass = local.to_symbols(S(body.mass))
        if not local.constant([mass]):
            raise NotATreeError(f"the mass of {body.name} changes")
        centre = self.links.motion(body.masscenter)
        if not is_rigid(body):
            return LinkBody(body.name, mass, centre, NOTHING)
        frame = frames.motion(body.frame)
        rows = [local.entries(row) for row in _entries(body.central_inertia, body.frame)]
        if not all(local.constant(row) for row in rows):
            raise NotATreeError(f"the inertia of {body.name} changes")
        half = [self.tape.transform(rows, axis) for axis in frame.rotation]
        turned = [[dot(axis, h) for h in half] for axis in frame.rotation]
        kept = self.tape.symmetric(lambda i, j: turned[i][j])
        return LinkBody(body.name, mass, self.links.turning(centre, frame), kept)


def _entries(inertia: Dyadic, frame: ReferenceFrame) -> list[list[Expr]]:
    """The entries along the axes of a frame; SymPy's own method takes each apart nine times."""
    rows: list[list[Expr]] = [[S.Zero] * 3 for _ in range(3)]
    for value, left, right in inertia.args:
        for i, one in enumerate(_components(left, frame)):
            for j, other in enumerate(_components(right, frame)):
                if one != 0 and other != 0:
                    rows[i][j] += value * one * other
    return rows


def _components(vector: Vector, frame: ReferenceFrame) -> Sequence[Expr]:
    if len(vector.args) == 1 and vector.args[0][1] is frame:
        return list(vector.args[0][0])
    return list(vector.to_matrix(frame))
