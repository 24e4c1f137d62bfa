"""Public robots in URDF, their motors driven: dynamics and places are those of Pinocchio.

The largest deviation of each robot is printed by
``pytest -s -m slow tests/validation/test_robots.py``; `mechc bench robots` has every robot.
"""

import numpy as np
import pytest

import mechc
from benchmarks.peers.pinocchio_robot import PinocchioRobot
from benchmarks.suite.robots import robots_folder

pytestmark = pytest.mark.slow
pytest.importorskip("pinocchio", reason="pip install 'mechc[robots]'")
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


@pytest.mark.parametrize("case", CASES)
def test_forward_and_inverse_dynamics(case):
    """Relative to the largest acceleration, or torque, of the state."""
    file, floating = CASES[case]
    path = robots_folder() / file
    if not path.exists():
        pytest.skip("pip install 'mechc[robots]'")
    unbounded = dict.fromkeys(("limits", "friction", "effort", "meshes"), "ignore")
    mechanism = mechc.from_urdf(path, driven="all", floating=floating, **unbounded)
    model = mechc.compile(mechanism, outputs=("points",))
    engine = PinocchioRobot(path, model.coordinates, model.speeds)
    own = [model.speeds.index(f"u_{name.removeprefix('tau_')}") for name in model.inputs]
    assert len(own) == len(model.speeds) - 6 * floating
    rng = np.random.default_rng(19)
    worst = dict.fromkeys(("accelerations", "mass matrix", "torques", "places"), 0.0)
    for y in rng.normal(size=(STATES, len(model.coordinates) + len(model.speeds))):
        state, torques = engine.state(y), np.zeros(len(model.speeds))
        torques[own] = rng.normal(scale=10.0, size=len(own))
        driven = model.with_inputs(dict(zip(model.inputs, torques[own], strict=True)))
        rates = driven.rhs(0.0, y)[len(model.coordinates) :]
        found = {
            "accelerations": (rates, engine.accelerations(state, torques)),
            "mass matrix": (driven.mass_matrix(y), engine.mass_matrix(state)),
            "torques": (
                model.inverse_dynamics(y, rates, inputs=model.inputs).inputs,
                engine.torques(state, rates)[own],
            ),
            "places": (model.points(y), engine.positions(state, model.point_names)),
        }
        for name, (one, other) in found.items():
            worst[name] = max(worst[name], abs(one - other).max() / abs(other).max())
    figures = ", ".join(f"{name} {gap:.1e}" for name, gap in worst.items())
    print(f"\n{case}: {len(model.speeds)} speeds, {figures}")
    assert max(worst.values()) < CLOSE
