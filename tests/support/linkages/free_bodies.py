"""Trees of bodies closed by massless rods, in NumPy alone: bodies are free, joints are rows.

Each body has its own six accelerations; M a + J^T lambda = F and J a = gamma are solved densely.
Joint accelerations, reactions and the rods' tensions are read from the solution.  mechc has no part
in it but :meth:`Scene.mechanism`, which describes the same bodies to it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np
import sympy as sm
from sympy.physics.mechanics import PinJoint, PrismaticJoint, RigidBody, inertia

import mechc

Array = np.ndarray
GROUND, G = -1, 9.81
SPEEDS = {"pin": 1, "slide": 1, "ball": 3, "free": 6}  # free: of the ground alone


@dataclass
class Link:
    """A body with the joint that places it: on which body, both points, the axis in both frames."""

    kind: str
    parent: int
    at_parent: Array
    at_child: Array
    axis: Array
    mass: float
    moments: Array  # about its mass centre, along its axes


@dataclass
class Rod:
    """A rod from a point of one body to a point of another; in m."""

    parent: int
    child: int
    at_parent: Array
    at_child: Array
    length: float = 1.0


@dataclass
class Solved:
    """Accelerations of the joints, forces and torques on their children, and the rods' tensions."""

    accelerations: Array
    forces: Array
    torques: Array
    tensions: Array


@dataclass
class Scene:
    """Links, each after the one it hangs on, and rods; gravity acts along -z."""

    links: Sequence[Link]
    rods: Sequence[Rod] = field(default_factory=tuple)

    # -- the same for mechc -----------------------------------------------------------------------

    def mechanism(self, **more: Any) -> Any:
        ground = RigidBody("ground")
        bodies, joints = list[RigidBody](), list[Any]()
        for k, link in enumerate(self.links):
            body = RigidBody(f"body{k}", mass=link.mass)
            body.central_inertia = inertia(body.frame, *map(float, link.moments))
            on = ground if link.parent == GROUND else bodies[link.parent]
            places = {"parent_point": along(link.at_parent, on.frame),
                      "child_point": along(link.at_child, body.frame)}  # fmt: skip
            if link.kind in ("ball", "free"):
                made = mechc.BallJoint if link.kind == "ball" else mechc.FreeJoint
                joints.append(made(f"j{k}", on, body, **places))
            else:
                made = PinJoint if link.kind == "pin" else PrismaticJoint
                axis = along(link.axis, on.frame)
                joints.append(made(f"j{k}", on, body, **places, joint_axis=axis))
            bodies.append(body)
        for k, rod in enumerate(self.rods):
            sides = [ground if i == GROUND else bodies[i] for i in (rod.parent, rod.child)]
            at = [along(rod.at_parent, sides[0].frame), along(rod.at_child, sides[1].frame)]
            joints.append(mechc.Cut.rod(f"rod{k}", *sides, sm.Symbol(f"L{k}"), *at))
        lengths = {f"L{k}": rod.length for k, rod in enumerate(self.rods)}
        return mechc.from_joints(
            "scene", joints, gravity=-G * ground.z, parameters=lengths, ground=ground, **more
        )

    # -- kinematics -------------------------------------------------------------------------------

    @property
    def speeds(self) -> list[slice]:
        ends = np.cumsum([0, *(SPEEDS[link.kind] for link in self.links)])
        return [slice(a, b) for a, b in pairwise(ends)]

    def placed(self, q: Sequence[Array], u: Array) -> Placed:
        """Places, axes and velocities.

        ``q``: of each link an angle, a way, a quaternion, or a way (3,) and a quaternion.
        """
        at = Placed()
        for link, value, own in zip(self.links, q, self.speeds, strict=True):
            p, turn, slide, speed = link.parent, np.eye(3), np.zeros(3), u[own]
            if link.kind == "pin":
                turn = rotation(link.axis, float(value))
            elif link.kind == "slide":
                slide = link.axis * float(value)
            else:
                slide, turn = np.zeros(3), of_quaternion(np.asarray(value)[-4:])
                if link.kind == "free":
                    slide = np.asarray(value)[:3]
            axes = at.axes[p] @ turn
            spin, way = at.w[p].copy(), at.axes[p] @ slide
            if link.kind == "pin":
                spin += at.axes[p] @ link.axis * speed[0]
            elif link.kind != "slide":
                spin += axes @ speed[-3:]
            joint = at.r[p] + at.axes[p] @ link.at_parent + way
            going = at.v[p] + np.cross(at.w[p], joint - at.r[p])
            if link.kind == "slide":
                going = going + at.axes[p] @ link.axis * speed[0]
            elif link.kind == "free":
                going = going + speed[:3]
            arm = axes @ link.at_child
            at.add(joint - arm, axes, going - np.cross(spin, arm), spin)
        return at

    def rows(self, q: Sequence[Array]) -> Array:
        """J of the rods over the joint speeds, along unit vectors from parent to child."""
        count = self.speeds[-1].stop
        found = np.zeros((len(self.rods), count))
        for k, unit in enumerate(np.eye(count)):
            at = self.placed(q, unit)
            for i, rod in enumerate(self.rods):
                gap, rate = at.between(rod)
                found[i, k] = gap @ rate / np.linalg.norm(gap)
        return found

    def closed(self, q: Sequence[Array], u: Array) -> Array:
        """The lengths of the rods become what they are at q; the speeds nearest to u that fit."""
        at = self.placed(q, u)
        for rod in self.rods:
            rod.length = float(np.linalg.norm(at.between(rod)[0]))
        rows = self.rows(q)
        return np.asarray(u - np.linalg.pinv(rows) @ (rows @ u))

    # -- kinetics ---------------------------------------------------------------------------------

    def solved(self, q: Sequence[Array], u: Array) -> Solved:
        at, n = self.placed(q, u), len(self.links)
        mass, force = np.zeros((6 * n, 6 * n)), np.zeros(6 * n)
        for k, link in enumerate(self.links):
            about = at.axes[k] @ np.diag(link.moments) @ at.axes[k].T
            mass[6 * k : 6 * k + 3, 6 * k : 6 * k + 3] = link.mass * np.eye(3)
            mass[6 * k + 3 : 6 * k + 6, 6 * k + 3 : 6 * k + 6] = about
            force[6 * k + 2] = -link.mass * G
            force[6 * k + 3 : 6 * k + 6] = -np.cross(at.w[k], about @ at.w[k])
        rows, gamma, first = list[Array](), list[float](), list[int]()

        def hold(i: int, a: Array, j: int, b: Array, direction: Array, needed: float) -> None:
            """direction . (acceleration of point b of body j less that of a of i) = needed."""
            row, rest = np.zeros(6 * n), needed
            for body, arm, sign in ((i, a, -1), (j, b, 1)):
                if body != GROUND:
                    row[6 * body : 6 * body + 3] += sign * direction
                    row[6 * body + 3 : 6 * body + 6] += sign * np.cross(arm, direction)
                    w = at.w[body]
                    rest -= sign * direction @ np.cross(w, np.cross(w, arm))
            rows.append(row), gamma.append(rest)

        def turn(i: int, j: int, direction: Array, needed: float) -> None:
            row = np.zeros(6 * n)
            for body, sign in ((i, -1), (j, 1)):
                if body != GROUND:
                    row[6 * body + 3 : 6 * body + 6] += sign * direction
            rows.append(row), gamma.append(needed)

        for k, (link, own) in enumerate(zip(self.links, self.speeds, strict=True)):
            first.append(len(rows))
            if link.kind == "free":
                continue
            p, arm = link.parent, at.axes[k] @ link.at_child
            other, axis = at.r[k] + arm - at.r[p], at.axes[p] @ link.axis
            spin = axis * (u[own][0] if link.kind == "pin" else 0)
            coriolis = np.zeros(3)
            if link.kind == "slide":
                coriolis = 2 * np.cross(at.w[p], axis * u[own][0])
            for direction in across(axis) if link.kind == "slide" else np.eye(3):
                hold(p, other, k, arm, direction, direction @ coriolis)
            if link.kind != "ball":
                for direction in across(axis) if link.kind == "pin" else np.eye(3):
                    turn(p, k, direction, direction @ np.cross(at.w[p], spin))
        first.append(len(rows))
        for rod in self.rods:
            (gap, rate), ends = at.between(rod), at.arms(rod)
            size = np.linalg.norm(gap)
            hold(rod.parent, ends[0], rod.child, ends[1], gap / size, -rate @ rate / size)
        found = solve(mass, np.array(rows), force, np.array(gamma))
        return self._read(at, found[: 6 * n], found[6 * n :], np.array(rows), first, u)

    def _read(
        self, at: Placed, a: Array, multipliers: Array, rows: Array, first: list[int], u: Array
    ) -> Solved:
        accelerations, forces, torques = list[Array](), list[Array](), list[Array]()
        motion = np.vstack([a.reshape(-1, 6), np.zeros(6)])
        for k, (link, own) in enumerate(zip(self.links, self.speeds, strict=True)):
            p, axis = link.parent, at.axes[link.parent] @ link.axis
            arm = at.axes[k] @ link.at_child
            turning = motion[k, 3:] - motion[p, 3:]
            if link.kind == "pin":
                accelerations.append([axis @ turning])
            elif link.kind != "slide":
                if link.kind == "free":
                    beside = np.cross(motion[k, 3:], arm)
                    spun = np.cross(at.w[k], np.cross(at.w[k], arm))
                    accelerations.append(motion[k, :3] + beside + spun)
                rate = np.cross(at.w[k], at.axes[k] @ u[own][-3:])
                accelerations.append(at.axes[k].T @ (turning - rate))
            else:
                other = at.r[k] + arm - at.r[p]
                points = [motion[i, :3] + np.cross(motion[i, 3:], x)
                          + np.cross(at.w[i], np.cross(at.w[i], x))
                          for i, x in ((p, other), (k, arm))]  # fmt: skip
                accelerations.append([axis @ (points[1] - points[0])])
            part = slice(first[k], first[k + 1])
            wrench = -rows[part, 6 * k : 6 * k + 6].T @ multipliers[part]
            forces.append(wrench[:3])
            torques.append(wrench[3:] - np.cross(arm, wrench[:3]))
        tensions = multipliers[first[-1] :]
        for rod, tension in zip(self.rods, tensions, strict=True):
            gap, _ = at.between(rod)
            forces.append(-tension * gap / np.linalg.norm(gap))
            torques.append(np.zeros(3))
        return Solved(np.concatenate(accelerations), np.array(forces), np.array(torques), tensions)


class Placed:
    """Mass centres, axes and velocities of the bodies at a state; the ground is the last."""

    def __init__(self) -> None:
        self.r, self.axes = [np.zeros(3)], [np.eye(3)]
        self.v, self.w = [np.zeros(3)], [np.zeros(3)]

    def add(self, *motion: Array) -> None:
        for kept, new in zip((self.r, self.axes, self.v, self.w), motion, strict=True):
            kept.insert(len(kept) - 1, new)

    def arms(self, rod: Rod) -> tuple[Array, Array]:
        return self.axes[rod.parent] @ rod.at_parent, self.axes[rod.child] @ rod.at_child

    def between(self, rod: Rod) -> tuple[Array, Array]:
        """The vector from the rod's parent to its child, and its rate."""
        (a, b), (i, j) = self.arms(rod), (rod.parent, rod.child)
        gap = self.r[j] + b - self.r[i] - a
        return gap, self.v[j] + np.cross(self.w[j], b) - self.v[i] - np.cross(self.w[i], a)


def along(components: Array, frame: Any) -> Any:
    x, y, z = map(float, components)
    return x * frame.x + y * frame.y + z * frame.z


def rotation(axis: Array, angle: float) -> Array:
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def of_quaternion(q: Array) -> Array:
    angle, size = 2 * np.arctan2(np.linalg.norm(q[1:]), q[0]), np.linalg.norm(q[1:])
    return np.eye(3) if size == 0 else rotation(q[1:] / size, angle)


def across(axis: Array) -> Array:
    """Two unit vectors across an axis and each other."""
    return np.linalg.svd(axis[None])[2][1:]


def solve(mass: Array, rows: Array, force: Array, gamma: Array) -> Array:
    """a and lambda of M a + J^T lambda = F, J a = gamma, corrected once for rounding."""
    count = len(gamma)
    whole = np.block([[mass, rows.T], [rows, np.zeros((count, count))]])
    right = np.concatenate([force, gamma])
    found = np.linalg.solve(whole, right)
    exact = right.astype(np.longdouble) - whole.astype(np.longdouble) @ found
    return found + np.linalg.solve(whole, exact.astype(float))
