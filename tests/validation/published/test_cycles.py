"""Cycles against published numbers."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import mechc
from tests.support.impacts import G, points_on_a_line
from tests.support.pendulums import driven_pendulum, van_der_pol, walker

START = {"theta": 0.2003, "phi": 0.4006, "w": -0.1998, "v": -0.0158}
DOUBLINGS = 1.0663, 1.0793, 1.0821  # Taylor, Classical Mechanics (2005), section 12.4


def test_van_der_pols_period():
    """P. Amore (2021, arXiv:2111.12198) has it to many digits; those here were computed once more,
    by Taylor series in 40 digits."""
    cycle = van_der_pol().periodic({"q": 2.0}, 6.0, rtol=1e-13)
    assert cycle.period == pytest.approx(6.6632868593231301896997, abs=1e-13)
    assert cycle.closure < 1e-13


def test_a_driven_pendulum_doubles_its_period_again_and_again():
    pendulum = driven_pendulum()
    late = pendulum.simulate(60, {"q": 0.0}, {"gamma": 1.06}).y[-1]
    cycle, found = pendulum.periodic(late, "2*pi/Omega", {"gamma": 1.06}), []
    for _ in DOUBLINGS:
        branch = cycle.follow("gamma", (1.06, 1.085), step=0.2)
        found.append(branch.doublings[0].value)
        cycle = branch.doublings[0].switch(0.02)
        assert cycle.stable
    assert found == pytest.approx(DOUBLINGS, abs=1e-4)  # their last digit
    assert cycle.period == pytest.approx(8.0, abs=1e-12)


@pytest.mark.slow
def test_the_simplest_walker_walks_as_it_was_published():
    """Garcia, Chatterjee, Ruina and Coleman (1998, J. Biomech. Eng. 120): stable for slopes up to
    0.0151 rad; on small ones theta = 0.970956 gamma^(1/3) and w = -1.045203 theta + 1.062895 gamma
    after the heel strike, to the next order."""
    model, strike = walker()
    cycle = model.periodic(START, 3.9, events=[strike], rtol=1e-12)
    branch = cycle.follow("gamma", (0.009, 0.017), step=0.2)
    assert [p.kind for p in branch.special] == ["period doubling"]
    assert branch.special[0].value == pytest.approx(0.0151, abs=5e-5)
    down = cycle.follow("gamma", (0.009, 1e-5))
    assert down.stable.all()
    for one in down[-3:]:
        slope, after = one.params["gamma"], one.solution.segments[1].y0
        assert after[0] == pytest.approx(0.970956 * slope ** (1 / 3), abs=0.2 * slope)
        series = -1.045203 * after[0] + 1.062895 * slope
        assert after[2] == pytest.approx(series, abs=3 * slope ** (5 / 3))


def test_the_walkers_multipliers_are_those_of_its_stride_by_another_integrator():
    """Of the map of theta and w after the heel strike; its derivative by differences."""
    model, strike = walker()
    cycle = model.periodic(START, 3.9, events=[strike], rtol=1e-12)
    after = cycle.solution.segments[1].y0
    np.testing.assert_allclose(_stride(after[[0, 2]]), after[[0, 2]], atol=1e-10)
    h, units = 5e-5, np.eye(2)
    columns = [
        (8 * (_stride(z + h * e) - _stride(z - h * e)) - _stride(z + 2 * h * e)
         + _stride(z - 2 * h * e)) / (12 * h)
        for z in (after[[0, 2]],) for e in units
    ]  # fmt: skip
    expected = np.linalg.eigvals(np.array(columns).T)
    np.testing.assert_allclose(cycle.multipliers[:2].real, expected.real, atol=1e-7)
    np.testing.assert_allclose(abs(cycle.multipliers[:2].imag), abs(expected.imag), atol=1e-7)
    assert abs(cycle.multipliers[2]) < 1e-9  # the reset leaves no trace of phi and its rate


def _stride(z, gamma=0.009):
    theta, w = z

    def rates(_, y):
        falls = np.sin(y[0] - gamma)
        swings = falls + (y[2] ** 2 - np.cos(y[0] - gamma)) * np.sin(y[1])
        return [y[2], y[3], falls, swings]

    def strike(_, y):
        return y[1] - 2 * y[0]

    strike.direction, strike.terminal = 1.0, True
    y, tight = [theta, 2 * theta, w, w * (1 - np.cos(2 * theta))], {"rtol": 1e-13, "atol": 1e-15}
    away = solve_ivp(rates, (0, 0.1), y, "DOP853", **tight).y[:, -1]
    (end,) = solve_ivp(rates, (0.1, 9), away, "DOP853", events=strike, **tight).y_events[0]
    return np.array([-end[0], np.cos(2 * end[0]) * end[2]])


def test_a_ball_on_a_vibrating_table_doubles_its_period_where_the_closed_form_says():
    """Once a period until A w^2/g = sqrt((pi (1-e)/(1+e))^2 + (2 (1+e^2)/(1+e)^2)^2): of the two
    impact phases with sin = -pi g (1-e) / ((1+e) A w^2) the one with cos > 0; multipliers multiply
    to e^2 (Tufillaro, Abbott and Reilly 1992, An experimental approach to nonlinear dynamics,
    chapter 1, worked out here for the exact map).  Only the gap contains time."""
    ball = points_on_a_line("ball", 1, lambda q, u, m: -G * m, parameters={"e": 0.5, "h": 0.0})
    e, w, strength = 0.8, 20 * np.pi, 1.02
    height, phase = strength * G / w**2, np.arcsin(-np.pi * (1 - e) / ((1 + e) * strength))
    low = height * np.cos(phase)
    rise = e * G * 0.1 / (1 + e) - height * w * np.sin(phase)  # after the impact
    highest = low + rise * 0.05 - G * 0.05**2 / 2
    table = mechc.Stop(f"q_0 - h*cos({w!r}*t)", "e")
    cycle = ball.periodic(
        {"q_0": 1.02 * highest, "u_0": rise - G * 0.05}, 0.1, {"e": e, "h": height},
        events=[table], t0=phase / w + 0.05,
    )  # fmt: skip
    assert cycle.y0[0] == pytest.approx(highest, rel=1e-9)
    assert np.prod(cycle.multipliers) == pytest.approx(e**2, rel=1e-6)
    (doubling,) = cycle.follow("h", (height, 1.1 * G / w**2), step=0.2).special
    closed = np.hypot(np.pi * (1 - e) / (1 + e), 2 * (1 + e**2) / (1 + e) ** 2)
    assert doubling.value * w**2 / G == pytest.approx(closed, rel=1e-7)
    twice = doubling.switch()
    assert (twice.period, len(twice.solution.events[0].t), twice.stable) == (0.2, 2, True)
