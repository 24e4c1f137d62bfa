"""The equations that peers are given are those that mechc integrates, derived another way."""

import numpy as np
import pytest

import mechc

OWN_COORDINATES = (
    "pendulum_1",
    "pendulum_5",
    "four_bar_regular",
    "four_bar_change_point",
    "slider_crank",
    "andrews",
    "heavy_top",
    "flyball_governor",
)


def interpreted(problem):
    """The problem's model without a compiler, which costs these tests nothing."""
    options = {**problem.compile_options, "outputs": (), "backend": "numpy"}
    return mechc.compile(problem.mechanism(), **options)


@pytest.mark.parametrize("name", OWN_COORDINATES)
def test_the_equations_given_to_peers_are_those_of_the_model(module, name):
    """KanesMethod, elimination written out and mechc's own derivation agree along the motion."""
    problem = module("problems").problem(name)
    equations, model = module("_equations").equations_of(problem), interpreted(problem)
    function = equations.rates().function("math")
    without_cse = module("peers.scipy_ivp").without_cse(equations)
    end = problem.t_end / (1000 if problem.stiff else 20)
    for y in model.simulate(end, problem.start, problem.params, rtol=1e-6).y[::4]:
        expected = model.rhs(0.0, y, problem.params)
        scale = np.abs(expected).max()
        for found in (function(*y.tolist()), without_cse(0.0, y)):
            np.testing.assert_allclose(found, expected, atol=1e-10 * scale, rtol=0)


@pytest.mark.parametrize("count", [1, 2])
def test_windows_in_other_coordinates_are_the_same_windows(module, count):
    """What tools with equations are given follows the closed form, before the first crossing."""
    from scipy.integrate import solve_ivp

    problem = module("problems").problem(f"windows_{count}")
    equations = module("_equations").equations_of(problem)
    function = equations.rates().function("math")
    run = solve_ivp(lambda t, y: function(*y.tolist()), (0, 0.5), equations.start,
                    method="DOP853", rtol=1e-11, atol=1e-11)  # fmt: skip
    exact = module("_windows").first_upright_motion(count, 0.5)
    np.testing.assert_allclose(equations.observe(run.y[:, -1]), exact, atol=1e-8)
    np.testing.assert_allclose(problem.observe(problem.start), [0, 1, 1, 0], atol=1e-15)


def test_elimination_gives_what_the_shortest_form_gives(module):
    """Where a form by hand is given, the general one gives the same accelerations."""
    from dataclasses import replace

    problem = module("problems").problem("four_bar_regular")
    equations = module("_equations").equations_of(problem)
    general = replace(equations, shortest=None).rates().function("math")
    y = interpreted(problem).simulate(0.7, problem.start, problem.params).y[-1]
    np.testing.assert_allclose(
        general(*y.tolist()), equations.rates().function("math")(*y.tolist()), atol=1e-11
    )


def test_a_residual_vanishes_at_the_rates_and_multipliers_and_not_beside_them(module):
    problem = module("problems").problem("four_bar_regular")
    equations = module("_equations").equations_of(problem)
    residual = equations.residual().function("math")
    y = interpreted(problem).simulate(0.7, problem.start, problem.params).y[-1]
    rates = np.array(equations.rates().function("math")(*y.tolist()))
    values = equations.entries().function("math")(*y.tolist())
    _, M, F, J, _ = (np.array(part) for part in equations.matrices(values))
    M, J = M.reshape(3, 3), J.reshape(2, 3)
    multipliers = np.linalg.lstsq(J.T, F - M @ rates[3:], rcond=None)[0]
    at = residual(*y, *multipliers, *rates)
    assert np.abs(at).max() < 1e-11
    assert np.abs(residual(*y, *(multipliers + 1.0), *rates)).max() > 0.1


def test_a_straight_line_program_solves_constrained_equations(module):
    """The elimination by symbols against NumPy, with more rows than one."""
    import sympy

    tapes, rng = module("_program"), np.random.default_rng(1)
    B, J = rng.normal(size=(5, 5)), rng.normal(size=(3, 5))
    M, F, gamma = B @ B.T + 5 * np.eye(5), rng.normal(size=5), rng.normal(size=3)
    symbols = sympy.symbols("a0:5")
    tape = tapes.Tape()
    found = tape.accelerations(
        [[sympy.Float(x) for x in row] for row in M], list(symbols),
        [[sympy.Float(x) for x in row] for row in J], [sympy.Float(x) for x in gamma],
    )  # fmt: skip
    function = tapes.Program(symbols, *tape.finished(found)).function("math")
    A = np.block([[M, J.T], [J, np.zeros((3, 3))]])
    expected = np.linalg.solve(A, np.concatenate([F, gamma]))[:5]
    np.testing.assert_allclose(function(*F.tolist()), expected, rtol=1e-11)
