"""Every problem starts on its manifold and knows its end; the short form is the right one."""

import numpy as np

import mechc
from benchmarks import problems
from benchmarks.problems import four_bar


def test_every_problem_starts_on_its_manifold_and_knows_its_end():
    """Shapes and finite exact values; the start observed is not the end."""
    for name in problems.NAMES:
        problem = problems.problem(name)
        observed = problem.observe(problem.start)
        assert observed.shape == problem.exact.shape == (len(problem.quantities),), name
        assert np.isfinite(problem.exact).all(), name
        assert problem.error(observed) > 0.01, name


def test_the_forms_given_to_peers_are_the_right_equations():
    """The hand-written accelerations equal the compiled ones on the loop."""
    model = mechc.load("four_bar")
    params = {"l_3": 3.5}
    y = model.assemble({"theta_0": 1.1}, speeds={"omega_0": 2.0}, params=params)
    resolved = model.system.parameter_set.resolve(params)
    p = dict(zip(model.parameters, resolved, strict=True))
    given = four_bar.accelerations(y[:3], y[3:], p, np.sin, np.cos)
    np.testing.assert_allclose(given, model.rhs(0.0, y, params)[3:], rtol=1e-11)
