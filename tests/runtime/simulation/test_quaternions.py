"""A free body by quaternions whose first component passes zero."""

import time

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tests.validation.models.catalogue import MODELS
from tests.validation.models.use import compiled, started

pytestmark = pytest.mark.slow
T_END = 10.0
NAMES = ("x", "y", "z", "q0", "q1", "q2", "q3", "v_x", "v_y", "v_z", "w_x", "w_y", "w_z")


@pytest.fixture(scope="module")
def drone():
    """(model, start, parameters)"""
    script = MODELS["quadrotor_with_its_norm_as_a_constraint"].derive()
    model = compiled(script)
    return model, started(model, script), {str(k): x for k, x in script.constants.items()}


def newton_euler(p):
    """The textbook's equations of a rigid body, with q' = q w / 2."""
    inertia = np.array([p["I_x"], p["I_y"], p["I_z"]])
    torque = np.array([p["tau_x"], p["tau_y"], p["tau_z"]])

    def rates(t, y):
        (a, b, c, d), v, w = y[3:7], y[7:10], y[10:]
        up = np.array([2 * (b * d + a * c), 2 * (c * d - a * b), 1 - 2 * (b * b + c * c)])
        turn = [
            -b * w[0] - c * w[1] - d * w[2], a * w[0] + c * w[2] - d * w[1],
            a * w[1] - b * w[2] + d * w[0], a * w[2] + b * w[1] - c * w[0],
        ]  # fmt: skip
        pull = (p["T"] * up - p["d"] * v) / p["m"] - [0, 0, p["g"]]
        spin = (torque - np.cross(w, inertia * w)) / inertia
        return np.concatenate([v, 0.5 * np.array(turn), pull, spin])

    return rates


def by_names(sol):
    return np.stack([sol[name] for name in NAMES], axis=1)


@pytest.fixture(scope="module")
def exact(drone):
    model, start, p = drone
    y0 = [start[(*model.coordinates, *model.speeds).index(name)] for name in NAMES]
    run = solve_ivp(newton_euler(p), (0, T_END), y0, "DOP853", rtol=1e-13, atol=1e-13)
    return run.y[:, -1]


@pytest.mark.parametrize("method", ["auto", "dopri5", "dop853", "radau5", "gauss8"])
@pytest.mark.parametrize("rtol", [1e-6, 1e-9, 1e-12])
def test_nothing_happens_where_the_first_component_is_zero(drone, exact, method, rtol):
    model, start, _ = drone
    sol = model.simulate(T_END, start, rtol=rtol, method=method)
    assert sol.status.ok
    assert sol["q0"].min() < -0.8 < 0.99 < sol["q0"].max()
    assert np.abs(by_names(sol)[-1] - exact).max() < 200 * rtol * np.abs(exact).max() + 1e-10
    assert sol.closure.max() < 1e-12
    if method != "radau5":  # of order 5, with many steps at tight tolerances
        assert sol.stats["rejected"] <= 0.1 * sol.stats["steps"] + 3


def test_it_is_faster_than_solve_ivp_of_the_textbooks_equations(drone):
    model, start, p = drone
    rates, y0 = newton_euler(p), np.array([*start[:13]])

    def seconds(run):
        begun = time.perf_counter()
        run()
        return time.perf_counter() - begun

    def theirs():
        solve_ivp(rates, (0, T_END), y0, "DOP853", rtol=1e-9, atol=1e-9)

    def ours():
        model.simulate(T_END, start, rtol=1e-9)

    assert min(seconds(ours) for _ in range(5)) < 0.2 * min(seconds(theirs) for _ in range(3))
