"""A crank that is driven to where the other links are in line: the end of their reach."""

import numpy as np
import pytest
from sympy import cos, eye, sin
from sympy.physics.mechanics import dynamicsymbols

import mechc
from mechc.simulation.end_of_reach import rows_beyond_reach

LENGTHS = {"l_0": 2.0, "l_1": 1.0, "l_2": 1.5, "l_3": 3.0}
END = np.arccos((2.0**2 + 3.0**2 - 2.5**2) / (2 * 2.0 * 3.0))  # l_1 and l_2 are in line
DRIVEN = {**LENGTHS, "Omega_0": 0.5}


@pytest.fixture(scope="module")
def crank():
    return mechc.load("four_bar", crank_speed=True, outputs=("reactions",))


@pytest.mark.parametrize("method", ["auto", "dop853", "radau5"])
@pytest.mark.parametrize("rtol", [1e-4, 1e-9])
def test_a_run_tells_where_the_reach_ends(crank, method, rtol):
    y = crank.assemble({"theta_0": 0.2}, params=DRIVEN)
    sol = crank.simulate(5.0, y, DRIVEN, method=method, rtol=rtol)
    assert sol.status.code == "end of reach"
    assert sol.status.t == pytest.approx((END - 0.2) / 0.5, abs=1e-6)
    assert f"beyond theta_0 = {np.degrees(END):.3f}"[:-1] in sol.status.cause
    assert "lengths" in sol.status.advice


def test_a_stepper_tells_it_too(crank):
    y = crank.assemble({"theta_0": 0.2}, params=DRIVEN)
    with pytest.raises(mechc.StepError, match=r"beyond theta_0 = 55\.77") as told:
        crank.stepper(y, DRIVEN).step(5.0)
    assert told.value.status.code == "end of reach"


def test_a_batch_has_no_numbers_of_members_that_end(crank):
    lengths = [[2.0, 1.0, 2.0], [1.0, 2.0, 1.0], [1.5, 3.0, 1.2], [3.0, 3.5, 3.0]]
    params = {f"l_{k}": np.array(values) for k, values in enumerate(lengths)} | {"Omega_0": 0.5}
    batch = crank.simulate_batch(
        10.0, {"theta_0": np.array([0.2, 0.2, -0.3])}, params, until="theta_0 > 200deg",
        reduce=["max(abs(reaction_torques[0,2]))", "first(theta_0 > 20deg)", "final(theta_0)"],
    )  # fmt: skip
    assert batch.counts == {"end of reach": 2, "stopped by an event": 1}
    peaks, first = batch["max(abs(reaction_torques[0,2]))"], batch["first(theta_0 > 20deg)"]
    np.testing.assert_array_equal(np.isnan(peaks), [True, False, True])
    np.testing.assert_array_equal(np.isnan(batch["final(theta_0)"]), [True, False, True])
    expected = (np.radians(20.0) - np.array([0.2, 0.2, -0.3])) / 0.5
    np.testing.assert_allclose(first, expected, atol=1e-9)
    assert str(batch.status(0)) == str(batch[0].status)
    assert "beyond theta_0 = 55.77" in batch.status(0).cause
    assert np.degrees(np.arccos((4 + 9 - 2.2**2) / 12)) == pytest.approx(
        float(batch.status(2).cause.split("theta_0 = ")[1].split()[0]), abs=1e-3
    )


def test_change_points_are_no_ends(crank):
    square = {"l_0": 1.0, "l_1": 2.0, "l_2": 1.0, "l_3": 2.0, "Omega_0": 2.0}
    y = crank.assemble({"theta_0": 0.5}, params=square)
    sol = crank.simulate(3.0, y, square)
    assert sol.status.ok
    assert len(sol.change_points) >= 1


def test_regular_states_are_no_ends(crank):
    y = crank.assemble({"theta_0": 0.2}, params=DRIVEN)
    p = crank.system.parameter_set.resolve(DRIVEN)
    assert rows_beyond_reach(crank.system, 0.0, y[None], p).tolist() == [-1]
    assert rows_beyond_reach(crank.system, 0.0, np.full((1, len(y)), np.nan), p).tolist() == [-1]


def test_a_crank_that_is_no_coordinate_ends_at_a_time():
    q, u = dynamicsymbols("x y"), dynamicsymbols("v w")
    (x, y), a = q, 0.2 + 0.5 * dynamicsymbols._t
    loop = [
        2 * cos(a) + cos(x) + 1.5 * cos(y) - 3,
        2 * sin(a) + sin(x) + 1.5 * sin(y),
    ]
    model = mechc.compile(mechc.from_equations(q, u, eye(2), [0, 0], constraints=loop), outputs=())
    sol = model.simulate(5.0, model.assemble(guess={"x": 0.3, "y": -0.6}))
    assert sol.status.code == "end of reach"
    assert sol.status.t == pytest.approx((END - 0.2) / 0.5, abs=1e-6)
    assert "beyond this time" in sol.status.cause
