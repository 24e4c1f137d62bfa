"""Motions in absolute coordinates, in NumPy and SciPy alone: the other formulation.

Each body has the position of its mass centre, a quaternion, and both velocities in the ground's
axes; each joint is some rows Φ = 0.  M a + Jᵀλ = F, J a = γ is solved densely and integrated by
DOP853 with relative tolerance 1e-13.  Every 0.05 s positions and velocities are projected onto the
rows.  mechc's joint coordinates, its derivation and its C have no part in it.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

GROUND = -1
PROJECTED = 0.05  # s; with one projection in 0.5 s the loads of two joints drift by 1e-10
ZERO = np.zeros(3)
AXES = np.eye(3)


def turned(vector, angle=None):
    """The matrix of a rotation vector, or of an axis and an angle in rad."""
    vector = np.asarray(vector, float)
    if angle is not None:
        vector = vector / np.linalg.norm(vector) * angle
    return Rotation.from_rotvec(vector).as_matrix()


@dataclass
class Body:
    """Mass in kg, central inertia (3, 3) in its axes in kg m², and where it starts."""

    mass: float
    inertia: np.ndarray
    place: np.ndarray
    axes: np.ndarray = field(default_factory=lambda: AXES)
    velocity: np.ndarray = field(default_factory=lambda: ZERO)
    spin: np.ndarray = field(default_factory=lambda: ZERO)


class Pose:
    """Places, axes and velocities of all bodies at one state; the ground is the last."""

    def __init__(self, state, count):
        bodies = state[: 13 * count].reshape(count, 13)
        quaternion = bodies[:, [4, 5, 6, 3]]
        self.r = np.vstack([bodies[:, :3], ZERO])
        self.R = np.concatenate([Rotation.from_quat(quaternion).as_matrix(), AXES[None]])
        self.v = np.vstack([bodies[:, 7:10], ZERO])
        self.w = np.vstack([bodies[:, 10:13], ZERO])
        self.extra = state[13 * count :]

    def point(self, body, local):
        """Arm, position, velocity of a point, and its acceleration without the bodies' own."""
        arm, w = self.R[body] @ local, self.w[body]
        velocity = np.cross(w, arm)
        return arm, self.r[body] + arm, self.v[body] + velocity, np.cross(w, velocity)

    def axis(self, body, local):
        """An axis, its rate, and its second rate without the body's angular acceleration."""
        axis, w = self.R[body] @ local, self.w[body]
        rate = np.cross(w, axis)
        return axis, rate, np.cross(w, rate)


def across(i, a, j, b):
    """An axis of body i stays perpendicular to one of body j."""

    def row(at, t):
        (e, de, dde), (f, df, ddf) = at.axis(i, a), at.axis(j, b)
        normal = np.cross(e, f)
        quadratic = dde @ f + 2 * de @ df + e @ ddf
        return e @ f, de @ f + e @ df, [(i, ZERO, normal), (j, ZERO, -normal)], quadratic, 0.0

    return row


def along(k, a, i, p, j, s, speed=0.0):
    """From p on body i to s on body j it is speed · t along an axis of body k."""

    def row(at, t):
        e, de, dde = at.axis(k, a)
        (arm_i, x, vx, ax), (arm_j, y, vy, ay) = at.point(i, p), at.point(j, s)
        line = y - x
        jacobian = [
            (k, ZERO, np.cross(e, line)),
            (i, -e, -np.cross(arm_i, e)),
            (j, e, np.cross(arm_j, e)),
        ]
        quadratic = dde @ line + 2 * de @ (vy - vx) + e @ (ay - ax)
        return e @ line - speed * t, de @ line + e @ (vy - vx), jacobian, quadratic, speed

    return row


def apart(i, p, j, s, length):
    """The distance of two points, in m."""

    def row(at, t):
        (arm_i, x, vx, ax), (arm_j, y, vy, ay) = at.point(i, p), at.point(j, s)
        line, rate = y - x, vy - vx
        size = np.linalg.norm(line)
        e = line / size
        quadratic = e @ (ay - ax) + (rate @ rate - (e @ rate) ** 2) / size
        jacobian = [(i, -e, -np.cross(arm_i, e)), (j, e, np.cross(arm_j, e))]
        return size - length, e @ rate, jacobian, quadratic, 0.0

    return row


def ball(i, p, j, s):
    return [along(GROUND, e, i, p, j, s) for e in AXES]


def pin(i, p, a, j, s, b):
    """Axis a of body i is axis b of body j: both are unit vectors."""
    return ball(i, p, j, s) + [across(i, e, j, b) for e in normals(a)]


def slide(i, p, a, j, s):
    """Body j moves along axis a of body i; both have the same axes when it is made."""
    return [
        *(along(i, e, i, p, j, s) for e in normals(a)),
        across(i, AXES[0], j, AXES[1]),
        across(i, AXES[1], j, AXES[2]),
        across(i, AXES[2], j, AXES[0]),
    ]


def normals(axis):
    """Two unit vectors across an axis."""
    first = np.cross(axis, AXES[np.argmin(np.abs(axis))])
    first /= np.linalg.norm(first)
    return first, np.cross(axis, first)


def line_force(i, p, j, s, law):
    """A load: law(length, its rate) pulls the two points together."""

    def load(at, t, wrench):
        (arm_i, x, vx, _), (arm_j, y, vy, _) = at.point(i, p), at.point(j, s)
        line = y - x
        size = np.linalg.norm(line)
        e = line / size
        pull = law(size, e @ (vy - vx)) * e
        push(wrench, i, pull, arm_i)
        push(wrench, j, -pull, arm_j)

    return load


def push(wrench, body, force, arm=ZERO, torque=ZERO):
    """Add a force at an arm from the mass centre, and a torque."""
    wrench[body, :3] += force
    wrench[body, 3:] += np.cross(arm, force) + torque


@dataclass
class World:
    """Bodies, joints (rows by name), loads, gravity in m/s²; more states, if `rates` is given.

    `rates(at, t)` gives the rates of the additional states `at.extra`.
    """

    bodies: list[Body]
    joints: dict[str, list[Callable]] = field(default_factory=dict)
    loads: list[Callable] = field(default_factory=list)
    gravity: np.ndarray = field(default_factory=lambda: ZERO)
    extra: tuple = ()
    rates: Callable | None = None

    def __post_init__(self):
        self.rows = [row for rows in self.joints.values() for row in rows]

    def start(self):
        states = []
        for body in self.bodies:
            quaternion = Rotation.from_matrix(body.axes).as_quat()[[3, 0, 1, 2]]
            states += [body.place, quaternion, body.velocity, body.spin]
        return np.concatenate([*states, self.extra]).astype(float)

    def _rows(self, at, t):
        count = len(self.bodies)
        value, rate, quadratic = (np.zeros(len(self.rows)) for _ in range(3))
        jacobian = np.zeros((len(self.rows), count + 1, 6))
        for n, row in enumerate(self.rows):
            value[n], rate[n], entries, quadratic[n], wanted = row(at, t)
            rate[n] -= wanted
            for body, linear, angular in entries:
                jacobian[n, body, :3] += linear
                jacobian[n, body, 3:] += angular
        return value, rate, jacobian[:, :count].reshape(len(self.rows), -1), quadratic

    def _masses(self, at):
        inverse = np.zeros((6 * len(self.bodies), 6 * len(self.bodies)))
        for n, body in enumerate(self.bodies):
            inverse[6 * n : 6 * n + 3, 6 * n : 6 * n + 3] = AXES / body.mass
            turned_inverse = at.R[n] @ np.linalg.inv(body.inertia) @ at.R[n].T
            inverse[6 * n + 3 : 6 * n + 6, 6 * n + 3 : 6 * n + 6] = turned_inverse
        return inverse

    def solve(self, at, t):
        """Accelerations (bodies, 6) and the multipliers of M a + Jᵀλ = F."""
        count = len(self.bodies)
        wrench = np.zeros((count + 1, 6))
        for n, body in enumerate(self.bodies):
            wrench[n, :3] = body.mass * self.gravity
            turned_inertia = at.R[n] @ body.inertia @ at.R[n].T
            wrench[n, 3:] = -np.cross(at.w[n], turned_inertia @ at.w[n])
        for load in self.loads:
            load(at, t, wrench)
        inverse = self._masses(at)
        free = inverse @ wrench[:count].ravel()
        if not self.rows:
            return free.reshape(count, 6), np.zeros(0)
        _, _, J, quadratic = self._rows(at, t)
        weighted = inverse @ J.T
        multipliers = np.linalg.lstsq(J @ weighted, J @ free + quadratic, rcond=1e-11)[0]
        return (free - weighted @ multipliers).reshape(count, 6), multipliers

    def _rhs(self, t, state):
        count = len(self.bodies)
        at = Pose(state, count)
        accelerations, _ = self.solve(at, t)
        rates = np.zeros((count, 13))
        q = state[: 13 * count].reshape(count, 13)[:, 3:7]
        w = at.w[:count]
        rates[:, :3] = at.v[:count]
        rates[:, 3] = -0.5 * np.sum(w * q[:, 1:], axis=1)
        rates[:, 4:7] = 0.5 * (q[:, :1] * w + np.cross(w, q[:, 1:]))
        rates[:, 7:] = accelerations
        extra = self.rates(at, t) if self.rates else ()
        return np.concatenate([rates.ravel(), extra])

    def _projected(self, state, t):
        """The nearest state on the rows, in the metric of the masses."""
        count = len(self.bodies)
        bodies = state[: 13 * count].reshape(count, 13)
        bodies[:, 3:7] /= np.linalg.norm(bodies[:, 3:7], axis=1)[:, None]
        for _ in range(3 if self.rows else 0):
            at = Pose(state, count)
            value, _, J, _ = self._rows(at, t)
            weighted = self._masses(at) @ J.T
            move = -weighted @ np.linalg.lstsq(J @ weighted, value, rcond=1e-11)[0]
            move = move.reshape(count, 6)
            bodies[:, :3] += move[:, :3]
            step = Rotation.from_rotvec(move[:, 3:])
            turn = step * Rotation.from_quat(bodies[:, [4, 5, 6, 3]])
            bodies[:, 3:7] = turn.as_quat()[:, [3, 0, 1, 2]]
        if self.rows:
            at = Pose(state, count)
            _, rate, J, _ = self._rows(at, t)
            weighted = self._masses(at) @ J.T
            move = weighted @ np.linalg.lstsq(J @ weighted, rate, rcond=1e-11)[0]
            bodies[:, 7:] -= move.reshape(count, 6)
        return state

    def motion(self, times):
        """The poses at ascending times after 0."""
        state, now, poses = self.start(), 0.0, []
        for time in times:
            for stop in np.linspace(now, time, math.ceil((time - now) / PROJECTED) + 1)[1:]:
                run = solve_ivp(
                    self._rhs, (now, stop), state, method="DOP853", rtol=1e-13, atol=1e-14
                )
                assert run.success, run.message
                state, now = self._projected(run.y[:, -1].copy(), stop), float(stop)
            poses.append(Pose(state, len(self.bodies)))
        return poses

    def reaction(self, at, t, joint, body, point):
        """Force and torque (N, N m) of a joint on a body, the torque about a point in space."""
        _, multipliers = self.solve(at, t)
        _, _, J, _ = self._rows(at, t)
        first = next(n for n, row in enumerate(self.rows) if row is self.joints[joint][0])
        mine = slice(first, first + len(self.joints[joint]))
        wrench = -J[mine, 6 * body : 6 * body + 6].T @ multipliers[mine]
        return wrench[:3], wrench[3:] + np.cross(at.r[body] - point, wrench[:3])
