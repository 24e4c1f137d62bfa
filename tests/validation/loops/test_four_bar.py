"""The four-bar against its exact motion, to 16 digits, with and without a change point."""

import json
from itertools import pairwise

import numpy as np
import pytest

import mechc
from tests.support import DATA


def reference(name):
    """Times (n,), states (n, 6), and the turning angle in degrees."""
    data = json.loads((DATA / f"{name}.json").read_text("utf-8"))
    states = sorted((float(t), [float(x) for x in y]) for t, y in data["states"].items())
    t, y = zip(*states, strict=True)
    return np.array(t), np.array(y), float(data["turning_angle_deg"])


@pytest.fixture(scope="module")
def model():
    return mechc.load("four_bar")


def from_rest(model, params=None):
    return model.assemble({"theta_0": np.radians(85)}, params=params)


def turning_angle(sol):
    """Largest theta_0 of the first swing, in degrees, on the dense output."""
    grid = np.linspace(0, 4, 4001)
    for _ in range(3):
        angle = sol(grid)[:, 0]
        best = int(angle.argmax())
        grid = np.linspace(grid[max(best - 1, 0)], grid[min(best + 1, len(grid) - 1)], 101)
    return np.degrees(angle.max())


REGULAR = {"l_3": 3.5}


@pytest.fixture(scope="module")
def regular(model):
    return model.simulate((0, 20), from_rest(model, REGULAR), REGULAR, rtol=1e-10)


def test_regular_error_after_twenty_seconds(regular):
    """At rtol 1e-10 every component is right to 1e-8 at 20 s."""
    t, y, _ = reference("four_bar_regular")
    assert t[-1] == 20
    np.testing.assert_allclose(regular.y[-1], y[-1], rtol=0, atol=1e-8)


def test_regular_history_and_turning_angle(regular):
    t, y, turn = reference("four_bar_regular")
    np.testing.assert_allclose(regular(t), y, rtol=0, atol=5e-8)
    assert turning_angle(regular) == pytest.approx(turn, abs=1e-7)
    assert regular.change_points == ()
    assert regular.status.ok
    assert not regular.status.warnings


def test_regular_closure_throughout(regular):
    """Below 1e-13 m at steps and between them, speeds too."""
    y = np.vstack([regular.y, regular(np.linspace(0, 20, 20001))])
    assert np.abs(regular.model.constraints(y, regular.params)).max() < 1e-13
    assert np.abs(regular.model.velocity_constraints(y, regular.params)).max() < 2e-13


def test_regular_energy(regular):
    assert np.ptp(regular.energy) < 1e-8
    assert regular.energy_drift < 1e-10


@pytest.mark.parametrize("method", ["dopri5", "dop853"])
def test_regular_error_falls_with_the_tolerance(model, method):
    _, y, _ = reference("four_bar_regular")
    start = from_rest(model, REGULAR)
    errors = [
        np.abs(model.simulate(20, start, REGULAR, rtol=r, method=method).y[-1] - y[-1]).max()
        for r in (1e-6, 1e-8, 1e-10, 1e-12)
    ]
    assert all(later < 0.1 * earlier for earlier, later in pairwise(errors))
    assert errors[-1] < 1e-10


def test_change_point_motion_of_the_first_swing(model):
    """Straight through both crossings to 762.14 degrees, and honest about having met them."""
    t, y, turn = reference("four_bar_change_point")
    sol = model.simulate((0, 4), from_rest(model), rtol=1e-10)
    assert sol.status.t > 2.5
    assert turning_angle(sol) == pytest.approx(turn, abs=1e-5)
    first = t <= 2.5
    np.testing.assert_allclose(sol(t[first]), y[first], rtol=0, atol=1e-6)
    assert sol.change_points or sol.status.warnings


def test_change_point_runs_stay_closed_and_keep_their_energy_or_say_so(model):
    for rtol in (1e-6, 1e-8, 1e-10):
        sol = model.simulate((0, 20), from_rest(model), rtol=rtol)
        assert sol.closure.max() < 1e-12
        assert sol.energy_drift < 1e-3
        assert sol.change_points or sol.status.warnings


@pytest.mark.parametrize(("crank", "rate"), [(-2.6565423, 31.1676149), (2.0, -40.0)])
def test_a_step_begun_anew_keeps_the_energy_to_the_tolerance(model, crank, rate):
    """The first step is begun from constants; what closes its loops must not move it on them."""
    start = model.assemble({"theta_0": crank}, speeds={"omega_0": rate}, guess={"theta_1": 0.33})
    sol = model.simulate(0.1, start, rtol=1e-12, method="gauss8")
    assert sol.status.ok, str(sol.status)
    departure = np.abs(np.diff(sol.energy)[:3]).max()
    assert departure < 2e-12 * model.kinetic_energy(sol.y).max()
