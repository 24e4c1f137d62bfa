"""Rigid bodies with joints: the description of a problem for multibody engines.

Every body is the child of one joint, whose parent is the ground or a body before it; loops are
closed by points of two bodies that coincide.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from ..problems.problem import Array

Vector = tuple[float, float, float]
Anchor = tuple[int, Vector]  # a body by its index, and a point in its frame
GROUND = -1
EULER = "ZXY"  # precession, nutation, spin of the top
ORIGIN, X, Y, Z = (0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)


@dataclass(frozen=True)
class Body:
    """A rigid body and the joint to its parent; its frame is at the joint.

    At zero the frame is parallel to the parent's frame.  ``place`` is the joint's position in the
    parent's frame (m), ``centre`` the mass centre's in the body's frame (m), and
    ``inertia`` the moments about the mass centre along the body's axes (kg m^2), which are
    principal.
    """

    name: str
    on: int
    place: Vector
    mass: float
    centre: Vector
    inertia: Vector
    axis: Vector = Z
    joint: str = "hinge"


@dataclass(frozen=True)
class Spring:
    """A spring (N/m) with a damper (N s/m) between two points, and its rest length (m)."""

    ends: tuple[Anchor, Anchor]
    stiffness: float
    damping: float
    length: float


@dataclass(frozen=True)
class Bodies:
    """A problem's bodies, the closures of their loops, and the loads.

    The joints' coordinates are ``turns @ q + offset``, where q are the coordinates of mechc's
    model; both have their rates as speeds.
    """

    bodies: tuple[Body, ...]
    turns: Array
    loops: tuple[tuple[Anchor, Anchor], ...] = ()
    springs: tuple[Spring, ...] = ()
    gravity: Vector = ORIGIN
    torque: float = 0.0  # on the first body, about its hinge (N m)
    offset: Array | float = 0.0

    def joints(self, y: Array) -> tuple[Array, Array]:
        """Coordinates and rates of the joints in a state of the model."""
        q, u = np.split(np.asarray(y, float), 2)
        return self.turns @ q + self.offset, self.turns @ u

    def state(self, q: Array, u: Array) -> Array:
        """The model's state from coordinates and rates of the joints."""
        return np.concatenate(
            [np.linalg.solve(self.turns, q - self.offset), np.linalg.solve(self.turns, u)]
        )


@dataclass(frozen=True)
class Top(Bodies):
    """One body on a ball joint.

    Coordinates are its quaternion, scalar first, and speeds its angular velocity in its own axes.
    """

    def joints(self, y: Array) -> tuple[Array, Array]:
        return Rotation.from_euler(EULER, y[:3]).as_quat(scalar_first=True), y[3:].copy()

    def state(self, q: Array, u: Array) -> Array:
        angles = Rotation.from_quat(q, scalar_first=True).as_euler(EULER)
        return np.concatenate([angles, u])
