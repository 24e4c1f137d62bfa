"""model.optimise without optional packages: what is found, from where, and what is said of it."""

import numpy as np
import pytest

import mechc
from benchmarks.problems import optimal as problems


@pytest.fixture(scope="module")
def cart():
    return problems.double_integrator().optimise(solver="slsqp", intervals=8)


def test_the_least_time_of_a_double_integrator(cart):
    assert cart.converged
    assert cart.cost == cart.duration == pytest.approx(4.0, rel=1e-8)
    np.testing.assert_allclose(cart.signals["F"].values[:-1], 4 * [1.5] + 4 * [-1.5], atol=1e-7)


def test_the_whole_motion_is_that_of_the_search(cart):
    again = mechc.Model.of_system(cart.problem.system).simulate(
        cart.duration, cart.y0, cart.params, inputs=cart.inputs
    )
    np.testing.assert_allclose(again.y[-1], [3.0, 0.0], atol=1e-8)
    assert cart.deviation < 1e-8
    times, states = cart.nodes
    np.testing.assert_allclose(states, cart.solution(times), atol=1e-8)


def test_the_report_tells_what_is_at_its_bound(cart):
    assert cart.active == {"F": "at its lower bound -1.5, 4 of 8; at its upper bound 1.5, 4 of 8"}
    assert "least duration: found" in str(cart)
    assert "slsqp" in str(cart)


def test_the_figure_has_a_row_for_each_input_and_coordinate(cart):
    assert len(cart.plot().axes) == 2
    assert len(cart.plot("x", "F*v").axes) == 3


def test_expressions_along_the_motion(cart):
    t = np.array([0.5, 1.0, 3.5])
    v = np.array([0.375, 0.75, 0.375])
    np.testing.assert_allclose(
        cart.along("F*v", "v - v[0]", t=t), np.column_stack([[1.5, 1.5, -1.5] * v, v]), atol=1e-7
    )


def test_bounds_along_the_motion():
    """With a speed of at most 1: up and down for 4/3 s each over 2/3 m, between them at 1 m/s."""
    found = problems.double_integrator().optimise(
        solver="slsqp", intervals=13, bounds={"v": (None, 1.0)}
    )
    assert found.converged
    assert found.duration == pytest.approx(13.0 / 3.0, rel=1e-7)
    assert "v" in found.active


def test_the_lower_of_two_minima_is_found_from_several_starts():
    """x^4 - 2 x^2 + 0.3 x over the start has minima beside 1 and -1."""
    well = "x[0]**4 - 2*x[0]**2 + 0.3*x[0]"
    asked = {"final": well, "free": {"x": (-2.0, 2.0)}, "inputs": {"F": 0.0}, "intervals": 1}
    model, start = problems.double_integrator().model, {"x": 0.9, "v": 0.0}
    one = model.optimise(1.0, start, **asked, solver="slsqp")
    many = model.optimise(1.0, start, **asked, solver="slsqp", starts=4)
    minima = [x for x in np.roots([4.0, 0.0, -4.0, 0.3]) if abs(x) > 0.5]
    assert one.values["x"] == pytest.approx(max(minima), abs=1e-3)
    assert many.values["x"] == pytest.approx(min(minima), abs=1e-3)
    assert [cost for cost, _ in many.ends] == sorted(cost for cost, _ in many.ends)
    assert "the starts led to" in str(many)


def test_what_is_not_found_is_said_with_what_was_nearest():
    problem = problems.double_integrator()
    found = problem.model.optimise(
        1.0, [0.0, 0.0], {"F": (-1.5, 1.5)}, integral="F**2", end={"x": 3.0, "v": 0.0},
        intervals=4, solver="slsqp",
    )  # fmt: skip
    assert not found.converged
    assert found.violation > 0.1
    assert ": not found" in str(found)
    assert "nearest" in str(found)
