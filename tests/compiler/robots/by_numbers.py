"""Velocities and accelerations of a mechanism's bodies at its start, without derivation or code."""

import numpy as np

from mechc.compilation.newton_euler import _Bodies, _slopes

TIME, STEP = np.zeros(1), np.full(1, 0.02)


class ByNumbers:
    """The start of a mechanism, of which all parameters but g have their defaults."""

    def __init__(self, mechanism):
        self.mechanism = mechanism
        self.bodies = _Bodies(mechanism)
        self.bodies.values = [0.3] * len(mechanism.open_inputs)
        self.bodies.values += [float(p.default) for p in mechanism.parameters]
        names = [str(q.func) for q in mechanism.q]
        self.q = np.array([[mechanism.start.get(name, 0.0) for name in names]])
        self.size = len(mechanism.u)

    def closed_speeds(self):
        """Speeds that keep the loops closed."""
        _, sizes, right = np.linalg.svd(self._jacobian())
        free = right[(sizes > 1e-7 * sizes.max(initial=0)).sum() :]
        return free.T @ np.linspace(0.5, 1.0, len(free))

    def speeds(self, velocities):
        """The speeds at which the bodies have these velocities and the loops stay closed."""
        columns = [self._side_by_side(self.velocities(e), velocities) for e in np.eye(self.size)]
        rows = np.concatenate([np.array(columns).T, self._jacobian()])
        wanted = np.zeros(len(rows))
        wanted[: 6 * len(velocities)] = self._side_by_side(velocities, velocities)
        return np.linalg.lstsq(rows, wanted, rcond=None)[0]

    def _jacobian(self):
        return np.array([self._moving(e).rows[0] for e in np.eye(self.size)]).T

    def velocities(self, u):
        """Name of a body -> velocity of its mass centre and angular velocity (6,)."""
        return self._named(self._moving(u)[:2])

    def accelerations(self, u):
        """Name of a body -> acceleration of its mass centre and angular acceleration (6,)."""
        numbers = self.bodies._numbers(self.bodies._of_u, TIME, self.q, u[None])
        rates = numbers[:, self.bodies.kinematics]
        y = np.concatenate([self.q, u[None]], axis=1)
        still = np.concatenate([rates, np.zeros((1, self.size))], axis=1)
        changes = self.bodies.judge(TIME, y, still, STEP, None)[2]  # what zeros lack
        return self._named(_slopes(lambda s: self.bodies._moving(
            TIME + s, self.q + s[:, None] * rates, u + s[:, None] * changes, STEP)[:2], STEP
        ))  # fmt: skip

    def _moving(self, u):
        return self.bodies._moving(TIME, self.q, u[None], STEP)

    def _named(self, parts):
        linear, angular = parts
        names = [body.name for body in self.mechanism.bodies]
        return {n: np.r_[v, w] for n, v, w in zip(names, linear[0], angular[0], strict=True)}

    def _side_by_side(self, values, names):
        return np.concatenate([values[name] for name in names])
