"""The equations that peers are given are those that mechc integrates, derived another way."""

import numpy as np
import pytest


def state_on_the_manifold(model, problem, rng):
    """A state somewhere along the motion."""
    tightness = {"rtol": 1e-10, "method": "radau5" if problem.stiff else "auto"}
    end = problem.t_end * rng.uniform(0.05, 0.3)
    return model.simulate(end, problem.start, problem.params, **tightness).y[-1]


NAMES = ("four_bar_regular", "four_bar_change_point")


@pytest.mark.parametrize("name", NAMES)
def test_the_equations_given_to_peers_are_those_of_the_model(module, name):
    """KanesMethod, elimination written out and mechc's own derivation agree along the motion."""
    problem = module("problems").problem(name)
    equations = module("_equations").equations_of(problem)
    function = equations.rates().function("math")
    scipy_ivp = module("peers.scipy_ivp")
    rng = np.random.default_rng(0)
    for _ in range(3):
        y = state_on_the_manifold(problem.model, problem, rng)
        expected = problem.model.rhs(0.0, y, problem.params)
        scale = np.abs(expected).max()
        for found in (function(*y.tolist()), scipy_ivp.without_cse(equations)(0.0, y)):
            np.testing.assert_allclose(found, expected, atol=1e-10 * scale, rtol=0)


def test_elimination_gives_what_the_shortest_form_gives(module):
    """Where a form by hand is given, the general one gives the same accelerations."""
    from dataclasses import replace

    problem = module("problems").problem("four_bar_regular")
    equations = module("_equations").equations_of(problem)
    general = replace(equations, shortest=None).rates().function("math")
    y = problem.model.simulate(0.7, problem.start, problem.params).y[-1]
    np.testing.assert_allclose(
        general(*y.tolist()), equations.rates().function("math")(*y.tolist()), atol=1e-11
    )


def test_a_residual_vanishes_at_the_rates_and_multipliers_and_not_beside_them(module):
    problem = module("problems").problem("four_bar_regular")
    equations = module("_equations").equations_of(problem)
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
