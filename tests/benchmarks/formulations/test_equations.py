"""The equations that peers are given are those that mechc integrates, derived another way."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from benchmarks import problems
from benchmarks.formulations.equations import equations_of
from benchmarks.peers import scipy_ivp
from benchmarks.problems import windows_motion

# What is compared is what other tools are given; the library's own scenes have tests of theirs.
OWN_COORDINATES = ["pendulum_1", "four_bar_regular", "four_bar_change_point"]
OTHERS = ["pendulum_5", "slider_crank", "andrews", "heavy_top", "flyball_governor"]


@pytest.mark.parametrize(
    "name", [*OWN_COORDINATES, *(pytest.param(n, marks=pytest.mark.thorough) for n in OTHERS)]
)
def test_the_equations_given_to_peers_are_those_of_the_model(name):
    """KanesMethod, elimination written out and mechc's own derivation agree along the motion."""
    problem = problems.problem(name)
    equations, model = equations_of(problem), problem.model
    function = equations.rates().function("math")
    without_cse = scipy_ivp.without_cse(equations)
    end = problem.t_end / (1000 if problem.stiff else 20)
    for y in model.simulate(end, problem.start, problem.params, rtol=1e-6).y[::4]:
        expected = model.rhs(0.0, y, problem.params)
        scale = np.abs(expected).max()
        for found in (function(*y.tolist()), without_cse(0.0, y)):
            np.testing.assert_allclose(found, expected, atol=1e-10 * scale, rtol=0)


@pytest.mark.parametrize("count", [1, pytest.param(2, marks=pytest.mark.thorough)])
def test_windows_in_other_coordinates_are_the_same_windows(count):
    """What tools with equations are given follows the closed form, before the first crossing."""
    problem = problems.problem(f"windows_{count}")
    equations = equations_of(problem)
    function = equations.rates().function("math")
    run = solve_ivp(lambda t, y: function(*y.tolist()), (0, 0.5), equations.start,
                    method="DOP853", rtol=1e-11, atol=1e-11)  # fmt: skip
    exact = windows_motion.first_upright_motion(count, 0.5)
    np.testing.assert_allclose(equations.observe(run.y[:, -1]), exact, atol=1e-8)
    np.testing.assert_allclose(problem.observe(problem.start), [0, 1, 1, 0], atol=1e-15)


def test_elimination_gives_what_the_shortest_form_gives():
    """Where a form by hand is given, the general one gives the same accelerations."""
    problem = problems.problem("four_bar_regular")
    equations = equations_of(problem)
    general = replace(equations, shortest=None).rates().function("math")
    y = problem.model.simulate(0.7, problem.start, problem.params).y[-1]
    np.testing.assert_allclose(
        general(*y.tolist()), equations.rates().function("math")(*y.tolist()), atol=1e-11
    )


def test_a_residual_vanishes_at_the_rates_and_multipliers_and_not_beside_them():
    problem = problems.problem("four_bar_regular")
    equations = equations_of(problem)
    residual = equations.residual().function("math")
    y = problem.model.simulate(0.7, problem.start, problem.params).y[-1]
    rates = np.array(equations.rates().function("math")(*y.tolist()))
    values = equations.entries().function("math")(*y.tolist())
    _, M, F, J, _ = (np.array(part) for part in equations.matrices(values))
    M, J = M.reshape(3, 3), J.reshape(2, 3)
    multipliers = np.linalg.lstsq(J.T, F - M @ rates[3:], rcond=None)[0]
    at = residual(*y, *multipliers, *rates)
    assert np.abs(at).max() < 1e-11
    assert np.abs(residual(*y, *(multipliers + 1.0), *rates)).max() > 0.1
