"""States and accelerations of MuJoCo, whose equality constraints are solved exactly.

``mj_forward`` lets constraints yield; here M a = f + J' lambda and J a = -J' v are solved together,
with MuJoCo's mass matrix, forces and Jacobian, which is differentiated along the motion by finite
differences.
"""

import numpy as np

STENCIL = ((-2, 1 / 12), (-1, -2 / 3), (1, 2 / 3), (2, -1 / 12))  # a first derivative, order four
STEP = 1e-3
LETTERS = {
    0: (("x", "y", "z", "q0", "q1", "q2", "q3"), ("vx", "vy", "vz", "wx", "wy", "wz")),
    1: (("q0", "q1", "q2", "q3"), ("wx", "wy", "wz")),
    2: (("q",), ("u",)),
    3: (("q",), ("u",)),
}  # of MuJoCo's kinds of joints


def write_model(folder, text):
    path = folder / "model.xml"
    path.write_text(text)
    return path


class Reference:
    """The model in a file, without contacts, limits and dry friction."""

    def __init__(self, path):
        import mujoco

        self.mujoco, self.model = mujoco, mujoco.MjModel.from_xml_path(str(path))
        bits = mujoco.mjtDisableBit
        for bit in (bits.mjDSBL_CONTACT, bits.mjDSBL_LIMIT, bits.mjDSBL_FRICTIONLOSS):
            self.model.opt.disableflags |= int(bit)
        self.model.opt.jacobian = int(mujoco.mjtJacobian.mjJAC_DENSE)
        self.data = mujoco.MjData(self.model)

    def names(self, names_of_joints):
        """The coordinates in MuJoCo's order, and the speeds."""
        kinds = [LETTERS[kind] for kind in self.model.jnt_type]
        return tuple(
            [f"{letter}_{name}" for kind, name in zip(kinds, names_of_joints, strict=True)
             for letter in kind[part]]
            for part in (0, 1)
        )  # fmt: skip

    def state(self, rng, spread=1.0):
        """A random state on the constraints."""
        q = self._moved(self.model.qpos0, rng.normal(scale=spread, size=self.model.nv))
        for _ in range(30):
            residual, jacobian = self._constraints(q)
            if len(residual) == 0 or abs(residual).max() < 1e-14:
                break
            q = self._moved(q, -np.linalg.pinv(jacobian, rcond=1e-9) @ residual)
        assert abs(self._constraints(q)[0]).max(initial=0.0) < 1e-12
        v = rng.normal(size=self.model.nv)
        jacobian = self._constraints(q)[1]
        return q, v - np.linalg.pinv(jacobian, rcond=1e-9) @ (jacobian @ v)

    def accelerations(self, q, v, control=()):
        jacobian = self._constraints(q)[1]
        drift = np.zeros(len(jacobian))
        for steps, weight in STENCIL:
            there = self._constraints(self._moved(q, steps * STEP * v))[1]
            drift += weight / STEP * (there @ v)
        data, n = self.data, self.model.nv
        data.qpos[:], data.qvel[:], data.ctrl[:] = q, v, control
        self.mujoco.mj_forward(self.model, data)
        if not len(drift):
            return data.qacc.copy()
        mass = np.zeros((n, n))
        self.mujoco.mj_fullM(self.model, data, mass)
        whole = np.block([[mass, jacobian.T], [jacobian, np.zeros((len(drift),) * 2)]])
        found = np.linalg.lstsq(whole, np.concatenate([data.qfrc_smooth, -drift]), rcond=1e-12)
        return found[0][:n]

    def _moved(self, q, way):
        q = np.array(q)
        self.mujoco.mj_integratePos(self.model, q, np.asarray(way), 1.0)
        return q

    def _constraints(self, q):
        self.data.qpos[:], self.data.qvel[:] = q, 0.0
        self.mujoco.mj_forward(self.model, self.data)
        rows = self.data.nefc
        return self.data.efc_pos[:rows].copy(), self.data.efc_J.reshape(rows, self.model.nv).copy()


def differences(model, reference, names_of_joints, *, states=5, spread=1.0, inputs=(), params=None):
    """The largest difference of accelerations, relative to the largest of each state.

    ``inputs``: those of the model, in MuJoCo's order of actuators.
    """
    rng = np.random.default_rng(7)
    coordinates, speeds = reference.names(names_of_joints)
    of_q, of_u = (
        [here.index(name) for name in there]
        for here, there in ((coordinates, model.coordinates), (speeds, model.speeds))
    )
    worst = 0.0
    for _ in range(states):
        q, v = reference.state(rng, spread)
        control = rng.normal(size=reference.model.nu) * bool(inputs)
        driven = model.with_inputs(dict(zip(inputs, control, strict=True))) if inputs else model
        y = np.concatenate([q[of_q], v[of_u]])
        found = driven.rhs(0.0, y, params)[len(of_q) :]
        wanted = reference.accelerations(q, v, control)[of_u]
        worst = max(worst, abs(found - wanted).max() / abs(wanted).max())
    return worst
