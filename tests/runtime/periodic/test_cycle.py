"""Multipliers, stability, and the starts that lead to a cycle."""

import numpy as np
import pytest
from sympy import cos, pi
from sympy.physics.mechanics import dynamicsymbols

import mechc
from tests.support.pendulums import driven_pendulum, van_der_pol, walker


@pytest.mark.parametrize("mu", [0.3, 1.0])
def test_the_multiplier_of_a_limit_cycle_is_that_of_its_divergence(mu):
    """exp of the integral of mu (1 - q^2) over a period (Liouville's formula)."""
    cycle = van_der_pol().periodic({"q": 2.0}, 6.5, {"mu": mu}, rtol=1e-12)
    q = cycle.samples(2001)[:-1, 0]  # the mean of a periodic function: exact to rounding
    assert cycle.multipliers == pytest.approx([np.exp(mu * np.mean(1 - q**2) * cycle.period)])
    assert (cycle.stable, cycle.neutral) == (True, 0)


def test_multipliers_of_a_driven_motion_multiply_to_that_of_its_damping():
    cycle = driven_pendulum().periodic({"q": 0.0}, "2*pi/Omega", {"gamma": 0.5})
    assert np.prod(cycle.multipliers) == pytest.approx(np.exp(-1.5 * np.pi), rel=1e-9)


@pytest.mark.slow
def test_differences_in_place_of_derivatives_give_the_same_cycle():
    """Friction of no force takes the exact derivatives away."""
    model, strike = walker()
    start = {"theta": 0.2003, "phi": 0.4006, "w": -0.1998, "v": -0.0158}
    exact = model.periodic(start, 3.9, events=[strike])
    rough = model.periodic(start, 3.9, events=[strike, mechc.DryFriction("v", mu=0.0)])
    assert rough.period == pytest.approx(exact.period, abs=1e-8)
    np.testing.assert_allclose(rough.multipliers[:2], exact.multipliers[:2], atol=1e-4)
    assert "derivatives are differences" in str(rough)


def test_differences_where_only_the_period_is_sought():
    model = mechc.load("pendulum")
    held, friction = ["theta_0", "omega_0"], mechc.DryFriction("omega_0", mu=0.0)
    cycle = model.periodic({"theta_0": "60deg"}, 2.1, hold=held, events=[friction])
    assert "derivatives are differences" in str(cycle)
    assert cycle.period == pytest.approx(
        model.periodic({"theta_0": "60deg"}, 2.1, hold=held).period
    )


def test_which_of_two_mirrored_cycles_a_start_leads_to():
    """Compared with the angle about which each motion by itself swings at last, and with whether it
    has the period at all: there are longer ones beside them."""
    pendulum, given = driven_pendulum(), {"gamma": 1.03}
    late = pendulum.simulate(60, {"q": 0.1}, given).y[-1]
    cycle = pendulum.periodic(late, "2*pi/Omega", given)
    mirrored = pendulum.periodic(-cycle.solution(0.5), "2*pi/Omega", given)
    starts = np.random.default_rng(1).uniform([-3, -20], [3, 20], (12, 2))
    found = cycle.basin(starts, mirrored, periods=60)
    assert {*found} == {-1, 0, 1}
    for which, start in zip(found, starts, strict=True):
        sol = pendulum.simulate(60, start, given)
        returns = np.abs(np.subtract(*sol([59.0, 60.0]))).max() < 1e-3
        assert returns == (which >= 0)
        if returns:
            assert (_lean(sol) == _lean(cycle.solution)) == (which == 0)
    assert (cycle.basin(starts, periods=1) == -1).all()


def _lean(sol):
    """The side to which the angle of the last period leans."""
    q = sol(sol.span[1] - np.linspace(0, 1, 500))[:, 0]
    middle = (q.min() + q.max()) / 2
    return np.sign(middle - 2 * np.pi * np.round(middle / (2 * np.pi)))


def test_a_cycle_prints_its_numbers():
    cycle = van_der_pol().periodic({"q": 2.0}, 6.5)
    assert str(cycle).startswith("cycle of van_der_pol: period 6.6632868")
    assert "multiplier" in str(cycle)
    assert repr(cycle) == "<mechc.Cycle of van_der_pol: period 6.66328686 s, stable>"
    assert cycle.solution.y[-1] == pytest.approx(cycle.y0, abs=1e-9)


def test_a_relaxation_oscillation_is_reached_from_everywhere():
    """It leaps: points of the curve at even distances in time are far apart there."""
    cycle = van_der_pol().periodic({"q": 2.0}, 19.0, {"mu": 10.0})
    starts = np.random.default_rng(2).uniform(-3, 3, (20, 2))
    assert (cycle.basin(starts, periods=6) == 0).all()


@pytest.mark.slow
def test_what_grows_by_a_given_length_is_not_compared():
    q, u = dynamicsymbols("q u")
    push = 1 - u + 0.3 * cos(2 * pi * dynamicsymbols._t)
    belt = mechc.compile(mechc.from_equations([q], [u], None, [push], name="belt"))
    cycle = belt.periodic({"q": 0.0, "u": 1.0}, 1.0, advance={"q": 1.0})
    assert (cycle.basin([[0.3, 0.0], [0.0, 3.0]], periods=30) == 0).all()
