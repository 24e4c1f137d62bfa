"""Plane bodies in Exudyn, each with three coordinates of its own and joined at points."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from exudyn.itemInterface import (
    LoadMassProportional,
    LoadTorqueVector,
    MarkerBodyMass,
    MarkerBodyPosition,
    MarkerBodyRigid,
    NodePoint2D,
    NodeRigidBody2D,
    ObjectGround,
    ObjectJointRevolute2D,
    ObjectMassPoint2D,
    ObjectRigidBody2D,
)

from ...formulations.rigid_bodies import GROUND, ORIGIN, Anchor, Bodies, Body, X, Z
from ...problems.problem import Array, NotExpressibleError, Problem
from .parts import Assembled, add_springs, empty, hold


def plane_bodies(bodies: Bodies, problem: Problem) -> Assembled:
    """The problem in redundant coordinates, as Exudyn's own models of plane linkages are.

    Raises
    ------
    NotExpressibleError
        If something turns or slides out of the plane, or slides on a body.
    """
    if not all(_in_plane(body) for body in bodies.bodies):
        raise NotExpressibleError("the motion is not in the plane x, y")
    container, mbs = empty()
    places, rates = _poses(bodies, *bodies.joints(problem.start))
    plane = _Plane(mbs, bodies, mbs.AddObject(ObjectGround()))
    for body, place, rate in zip(bodies.bodies, places, rates, strict=True):
        plane.add(body, place, rate)
    for k, body in enumerate(bodies.bodies):
        if body.joint == "hinge":
            plane.pin((body.on, body.place), (k, ORIGIN))
    for a, b in bodies.loops:
        plane.pin(a, b)
    add_springs(mbs, bodies, plane.point)
    if bodies.torque:
        crank = mbs.AddMarker(MarkerBodyRigid(bodyNumber=plane.numbers[0]))
        mbs.AddLoad(LoadTorqueVector(markerNumber=crank, loadVector=[0, 0, bodies.torque]))
    mbs.Assemble()
    return Assembled(container, mbs, lambda: _state(bodies, *_present(mbs, places)))


def _in_plane(body: Body) -> bool:
    if body.joint == "slide":
        return body.on == GROUND and body.axis == X and body.place == ORIGIN
    return body.joint == "hinge" and body.axis == Z


@dataclass
class _Plane:
    """A system that bodies are added to in their order; a body's node is its mass centre."""

    mbs: Any
    bodies: Bodies
    ground: Any
    numbers: list[Any] = field(default_factory=list)

    def add(self, body: Body, place: Array, rate: Array) -> None:
        """A body where it starts, which is its reference too; what slides has no angle."""
        start = {"referenceCoordinates": place, "initialVelocities": rate}
        if body.joint == "slide":
            node = self.mbs.AddNode(NodePoint2D(**start))
            part = ObjectMassPoint2D(mass=body.mass, nodeNumber=node)
            hold(self.mbs, node, range(1, 2))
        else:
            node = self.mbs.AddNode(NodeRigidBody2D(**start))
            inertia = body.inertia[2]
            part = ObjectRigidBody2D(mass=body.mass, inertia=inertia, nodeNumber=node)
        self.numbers.append(self.mbs.AddObject(part))
        if any(self.bodies.gravity):
            mass = self.mbs.AddMarker(MarkerBodyMass(bodyNumber=self.numbers[-1]))
            weight = LoadMassProportional(markerNumber=mass, loadVector=self.bodies.gravity)
            self.mbs.AddLoad(weight)

    def point(self, anchor: Anchor) -> Any:
        """A marker at a point of a body or of the ground."""
        k, place = anchor
        if k == GROUND:
            return self.mbs.AddMarker(
                MarkerBodyPosition(bodyNumber=self.ground, localPosition=place)
            )
        local = np.subtract(place, self.bodies.bodies[k].centre)
        return self.mbs.AddMarker(
            MarkerBodyPosition(bodyNumber=self.numbers[k], localPosition=local)
        )

    def pin(self, a: Anchor, b: Anchor) -> None:
        self.mbs.AddObject(ObjectJointRevolute2D(markerNumbers=[self.point(a), self.point(b)]))


def _poses(bodies: Bodies, q: Array, u: Array) -> tuple[list[Array], list[Array]]:
    """Mass centre and angle of every body in the plane, and their rates; no angle of a slider."""
    places, rates = [], []
    frames = {GROUND: (0j, 0.0, 0j, 0.0)}
    for k, body in enumerate(bodies.bodies):
        at, angle, velocity, rate = _carried(frames[body.on], body.place)
        if body.joint == "slide":
            at, velocity = at + q[k], velocity + u[k]
        else:
            angle, rate = angle + q[k], rate + u[k]
        frames[k] = at, angle, velocity, rate
        at, angle, velocity, rate = _carried(frames[k], body.centre)
        own = 2 if body.joint == "slide" else 3
        places.append(np.array([at.real, at.imag, angle][:own]))
        rates.append(np.array([velocity.real, velocity.imag, rate][:own]))
    return places, rates


Frame = tuple[complex, float, complex, float]  # place and angle, and their rates


def _carried(frame: Frame, point: Any) -> Frame:
    """The frame moved to a point that it carries."""
    at, angle, velocity, rate = frame
    arm = complex(*point[:2]) * np.exp(1j * angle)
    return at + arm, angle, velocity + 1j * rate * arm, rate


def _present(mbs: Any, start: list[Array]) -> tuple[list[Array], list[Array]]:
    """Mass centre and angle of every body now, and their rates."""
    cuts = np.cumsum([len(place) for place in start])[:-1]
    moved = np.split(mbs.systemData.GetODE2Coordinates(), cuts)
    rates = np.split(mbs.systemData.GetODE2Coordinates_t(), cuts)
    return [place + by for place, by in zip(start, moved, strict=True)], rates


def _state(bodies: Bodies, places: list[Array], rates: list[Array]) -> Array:
    return bodies.state(_at_joints(bodies, places), _at_joints(bodies, rates))


def _at_joints(bodies: Bodies, values: list[Array]) -> Array:
    """Places of sliders; at hinges the difference of two bodies' angles, which count turns."""
    return np.array(
        [
            values[k][0]
            if body.joint == "slide"
            else values[k][2] - (values[body.on][2] if body.on != GROUND else 0.0)
            for k, body in enumerate(bodies.bodies)
        ]
    )
