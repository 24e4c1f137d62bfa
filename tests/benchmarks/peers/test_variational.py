"""What other tools are given for derivatives is right: theirs are those of the references."""

from types import SimpleNamespace

import numpy as np
import pytest
from mechc_codegen.library.chains.pendulum import pendulum

from benchmarks.formulations.equations import derive
from benchmarks.peers import equal_error, variational
from benchmarks.references.sensitivities.derivatives import posed

pytestmark = pytest.mark.thorough  # compiles much
# Tolerances, and the errors that they keep: multistep methods end far off their tolerance.
PROMISES = {"heyoka": (1e-12, 1e-10), "CVODES": (1e-10, 1e-5), "IDAS": (1e-10, 1e-5)}


@pytest.mark.parametrize("name", ["pendulum", "four_bar_regular", "stiff_masses"])
@pytest.mark.parametrize("package", ["heyoka", "casadi"])
def test_derivatives_are_those_of_the_references(name, package):
    pytest.importorskip(package)
    given = posed(name)
    motion = equal_error.differentiated(given, equal_error.MECHANISMS[name]())
    tools = {"heyoka": ["heyoka"], "casadi": ["CVODES", "IDAS"]}[package]
    made = getattr(variational, f"by_{package}")
    for tool in tools:
        tolerance, limit = PROMISES[tool]
        runs = [run for run in made(motion, [tolerance]) if run.tool == tool]
        ways = ["forwards"] if tool == "heyoka" else ["forwards", "backwards"]
        assert [run.way for run in runs] == ways
        for run in runs:
            assert equal_error.error_of(run, given.exact) < limit


def test_the_order_of_the_states_is_the_models():
    double = pendulum(2)
    turned = SimpleNamespace(coordinates=("theta_1", "theta_0"), speeds=("omega_1", "omega_0"))
    plain, other = (derive(m, {}) for m in (double, equal_error.ordered(double, turned)))
    y, parameters = np.array([0.3, 1.1, -0.7, 0.4]), [1.2, 0.9, 1.5, 0.8, 9.81]
    values = dict(zip(sorted(p.name for p in plain.parameters), parameters, strict=True))

    def rates(equations, state):
        own = [values[p.name] for p in equations.parameters]
        return equations.rates().function()(*state, *own)

    order = [1, 0, 3, 2]
    np.testing.assert_allclose(rates(other, y[order]), np.array(rates(plain, y))[order], rtol=1e-12)


def test_a_wrong_derivative_shows():
    exact = {"a": np.array([1.0, 2.0]), "b": np.array([0.0, 4.0])}
    columns = np.column_stack(list(exact.values()))
    run = variational.Run("", "", 1.0, lambda: columns + np.array([[0.0, 0.0], [0.0, 0.4]]))
    assert equal_error.error_of(run, exact) == pytest.approx(0.1)
    backwards = run._replace(run=lambda: np.array([1.2, 0.0]))
    assert equal_error.error_of(backwards, exact) == pytest.approx(0.1)
    assert equal_error.error_of(run._replace(run=lambda: None), exact) == np.inf
