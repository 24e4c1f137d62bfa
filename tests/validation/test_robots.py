"""Public robots in URDF: forward and inverse dynamics are those of Pinocchio.

The largest deviation of each robot is printed by
``pytest -s -m slow tests/validation/test_robots.py``.
"""

from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

import mechc

pytestmark = pytest.mark.slow
pinocchio = pytest.importorskip("pinocchio", reason="pip install 'mechc[robots]'")
ROBOTS = Path(pinocchio.__file__).parents[4] / "share/example-robot-data/robots"
STATES = 20
CLOSE = 1e-9  # of the largest acceleration or torque

CASES = {
    "ur5": ("ur_description/urdf/ur5_robot.urdf", False),
    "xarm7": ("xarm_description/urdf/xarm7.urdf", False),
    "kinova": ("kinova_description/robots/kinova.urdf", False),
    "double pendulum, continuous": (
        "double_pendulum_description/urdf/double_pendulum_continuous.urdf",
        False,
    ),
    "panda, whose fingers mimic": ("panda_description/urdf/panda.urdf", False),
    "solo12, a floating base": ("solo_description/robots/solo12.urdf", True),
}


class Engine:
    """Pinocchio's model of a file, with states and torques in mechc's order."""

    def __init__(self, path, floating):
        root = [pinocchio.JointModelFreeFlyer()] if floating else []
        self.model = pinocchio.buildModelFromUrdf(str(path), *root, mimic=True)
        self.data, self.floating = self.model.createData(), floating
        self.own = [
            (name, joint)
            for name, joint in zip(self.model.names, self.model.joints, strict=True)
            if name not in ("universe", "root_joint") and joint.nv == 1 and joint.nq and
            "Mimic" not in joint.shortname()
        ]  # fmt: skip

    def state(self, at):
        """q and v from values by name."""
        q, v = pinocchio.neutral(self.model), np.zeros(self.model.nv)
        for name, joint in self.own:
            angle = at[f"q_{name}"]
            q[joint.idx_q : joint.idx_q + joint.nq] = (
                angle if joint.nq == 1 else (np.cos(angle), np.sin(angle))
            )
            v[joint.idx_v] = at[f"u_{name}"]
        if self.floating:
            attitude = np.array([at[f"q{k}_base"] for k in (1, 2, 3, 0)])
            q[:7] = *(at[f"{axis}_base"] for axis in "xyz"), *(attitude / np.linalg.norm(attitude))
            turned = self._turned(q).T
            v[:3] = turned @ [at[f"v{axis}_base"] for axis in "xyz"]
            v[3:6] = [at[f"w{axis}_base"] for axis in "xyz"]
        return q, v

    def rates(self, given, q, v):
        """The rates of v from the rates of speeds by name."""
        a = np.zeros(self.model.nv)
        for name, joint in self.own:
            a[joint.idx_v] = given[f"u_{name}"]
        if self.floating:  # the velocity is in the axes of the base there
            linear = self._turned(q).T @ [given[f"v{axis}_base"] for axis in "xyz"]
            a[:3] = linear - np.cross(v[3:6], v[:3])
            a[3:6] = [given[f"w{axis}_base"] for axis in "xyz"]
        return a

    def torques(self, q, v, a):
        return pinocchio.rnea(self.model, self.data, q, v, a)

    def accelerations(self, q, v, torques):
        """By the mass matrix and the bias: the recursive algorithm knows no mimics."""
        upper = np.triu(pinocchio.crba(self.model, self.data, q))
        mass = upper + upper.T - np.diag(np.diag(upper))
        return np.linalg.solve(mass, torques - self.torques(q, v, np.zeros(self.model.nv)))

    @staticmethod
    def _turned(q):
        return pinocchio.Quaternion(q[3:7]).toRotationMatrix()


def _states(model, rng):
    """Random states: angles and quaternions of the order of one, every joint moving."""
    names = (*model.coordinates, *model.speeds)
    return names, rng.normal(size=(STATES, len(names)))


@pytest.mark.parametrize("case", CASES)
def test_forward_and_inverse_dynamics(case):
    """Relative to the largest acceleration, or torque, of the state."""
    file, floating = CASES[case]
    path = ROBOTS / file
    if not path.exists():
        pytest.skip("pip install 'mechc[robots]'")
    robot = mechc.from_urdf(path, driven="all", floating=floating)
    engine = Engine(path, floating)
    model = mechc.compile(robot, outputs=())
    assert {f"tau_{name}" for name, _ in engine.own} == set(model.inputs)
    damping = _damping(path)
    rng = np.random.default_rng(19)
    names, states = _states(model, rng)
    worst = [0.0, 0.0]
    for y in states:
        at = dict(zip(names, y, strict=True))
        torques = {name: rng.normal(scale=10.0) for name in model.inputs}
        rates = model.with_inputs(torques).rhs(0.0, y)[len(model.coordinates) :]
        q, v = engine.state(at)
        a = engine.rates(dict(zip(model.speeds, rates, strict=True)), q, v)
        applied = np.zeros_like(v)
        for name, joint in engine.own:
            damper = damping.get(name, 0.0) * at[f"u_{name}"]
            applied[joint.idx_v] = torques[f"tau_{name}"] - damper
        expected = engine.accelerations(q, v, applied)
        worst[0] = max(worst[0], abs(a - expected).max() / abs(expected).max())
        found = model.inverse_dynamics(y, rates, inputs=model.inputs).inputs
        needed = engine.torques(q, v, a)
        back = [
            needed[joint.idx_v] + damping.get(name, 0.0) * at[f"u_{name}"]
            for name, joint in engine.own
        ]
        wanted = dict(zip((f"tau_{name}" for name, _ in engine.own), back, strict=True))
        gaps = [abs(x - wanted[n]) for n, x in zip(model.inputs, found, strict=True)]
        worst[1] = max(worst[1], max(gaps) / abs(needed).max())
    print(f"\n{case}: {len(model.speeds)} speeds, accelerations {worst[0]:.1e}, "
          f"torques {worst[1]:.1e}")  # fmt: skip
    assert max(worst) < CLOSE


def _damping(path):
    """The damping of each joint, with that of the joints that mimic it, by the square of the ratio;
    the engine reads it and does not apply it."""
    found = {}
    for joint in ElementTree.parse(path).getroot().iter("joint"):
        dynamics, mimic = joint.find("dynamics"), joint.find("mimic")
        damping = 0.0 if dynamics is None else float(dynamics.get("damping", 0.0))
        name, ratio = joint.get("name"), 1.0
        if mimic is not None:
            name, ratio = mimic.get("joint"), float(mimic.get("multiplier", 1.0))
        found[name] = found.get(name, 0.0) + ratio**2 * damping
    return found
