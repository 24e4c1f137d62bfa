"""Near misses that a step's ends alone do not show; the ends of the motion were integrated by
Gauss collocation in quadruple precision."""

import pytest

import mechc
from tests.support.loops import double_window

METHODS = ("dopri5", "dop853", "gauss8")


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("rtol", [1e-4, 1e-6, 1e-9])
def test_two_near_misses_within_one_step_are_seen(method, rtol):
    model = mechc.load("four_bar")
    lengths = {"l_0": 2.796875, "l_1": 3.7499999996978386, "l_2": 2.796875, "l_3": 3.75}
    params = lengths | {"m_0": 0.792, "m_1": 0.296, "m_2": 4.489}
    start = model.assemble(
        {"theta_0": 1.2019444600348876}, speeds={"omega_0": -2.2806280593736563}, params=params,
        guess={"theta_1": -1.521, "theta_2": 0.418},
    )  # fmt: skip
    sol = model.simulate(4.0, start, params, rtol=rtol, method=method)
    assert sol.status.ok
    assert abs(sol["theta_0"][-1] + 1.729) < 1e-3


@pytest.fixture(scope="module")
def windows():
    return mechc.compile(double_window())


@pytest.mark.slow
@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("rtol", [1e-6, 1e-9])
def test_a_second_weak_row_is_followed_behind_the_first(windows, method, rtol):
    params = {"g_1": 0.9999999999689277, "g_2": 2.0}
    angle = 1.3746
    upright = {"q_1": -angle, "q_2": angle - 3.14, "q_3": 0.0, "q_4": angle - 3.14}
    start = windows.assemble({"q_0": angle}, speeds={"u_0": -0.5656}, params=params, guess=upright)
    sol = windows.simulate(2.5, start, params, rtol=rtol, method=method)
    assert sol.status.ok
    assert abs(sol["q_0"][-1] - 1.6966) < 2e-4
