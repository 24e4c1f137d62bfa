"""model.optimise without optional packages: what is found, from where, and what is said of it."""

import numpy as np
import pytest

import mechc
from benchmarks.problems import optimal as problems
from mechc.optimal.solvers import ScaledProblem, _is_stationary


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
    assert "missed most is" in str(found)


def test_bounds_along_the_motion_hold_at_its_end_too():
    model = problems.double_integrator().model
    asked = {"integral": "F**2", "final": "-100*x", "intervals": 4, "solver": "slsqp"}
    found = model.optimise(
        2.0,
        [0.0, 0.0],
        {"F": (-20, 20)},
        bounds={"x": (None, 1.0)},
        end={"x": (0.1, None)},
        **asked,
    )
    assert found.nodes[1][-1, 0] <= 1.0 + 1e-8
    with pytest.raises(mechc.ValueOutOfBoundsError, match="x cannot be"):
        model.optimise(2.0, [0, 0], {"F": None}, bounds={"x": (None, 1)}, end={"x": 2}, **asked)


@pytest.mark.parametrize("solver", ["ipopt", "slsqp"])
@pytest.mark.parametrize(("mass", "way", "seconds"), [(1e-9, 1e-6, 1e-3), (1e5, 1.0, 1.0)])
def test_small_and_large_costs_are_as_exact_as_others(mass, way, seconds, solver):
    """The least effort from rest to rest is 12 m^2 d^2 / T^3, by a force that falls evenly."""
    if solver == "ipopt":
        pytest.importorskip("casadi")
    found = problems.double_integrator().model.optimise(
        seconds, [0.0, 0.0], {"F": None}, {"m": mass}, integral="F**2",
        end={"2*x": 2.0 * way, "v": 0.0}, intervals=3, solver=solver,
    )  # fmt: skip
    assert found.converged
    assert found.cost == pytest.approx(12.0 * mass**2 * way**2 / seconds**3, rel=1e-6)


def test_kinks_of_given_inputs_are_ends_of_the_quadrature():
    """The work of a pulse on a mass from rest is its square over twice the mass."""
    pulse = mechc.Signal([0.0, 0.4, 0.55, 2.0], [0.0, 5.0, 0.0, 0.0], "previous")
    found = problems.double_integrator().model.optimise(
        2.0, {"x": 0.0, "v": 0.0}, free={"m": (1.0, 3.0)}, inputs={"F": pulse}, integral="F*v",
        intervals=3, solver="slsqp",
    )  # fmt: skip
    assert found.values["m"] == pytest.approx(3.0)
    assert found.cost == pytest.approx((5.0 * 0.15) ** 2 / 6.0, rel=1e-9)
    assert found.cost_of_solution == pytest.approx(found.cost, rel=1e-9)


def test_what_bounds_are_exceeded_by_between_the_intervals_is_told():
    found = problems.double_integrator().model.optimise(
        3.0, [0.0, 0.0], {"F": None}, integral="F**2", end={"x": 3.0, "v": 0.0},
        bounds={"v": (None, 1.2), "2*x": (None, 6.0)}, intervals=3, solver="slsqp",
    )  # fmt: skip
    t = np.linspace(0.0, 3.0, 30001)
    highest = found.solution(t)[:, 1]
    excess, when = found.excess["v"]
    assert excess == pytest.approx(highest.max() - 1.2, rel=1e-2)
    assert excess > 0.01
    assert when == pytest.approx(t[highest.argmax()], abs=0.1)
    assert "2*x" not in found.excess
    assert "v is beyond its bound by" in str(found)


def test_a_cost_that_the_quadrature_misses_is_told():
    """Seven turns within the one interval: eight points do not see the square of its sine."""
    found = problems.double_integrator().model.optimise(
        1.0, [0.0, 0.0], {"F": (-1.0, 1.0)}, integral="sin(45*t)**2", intervals=1, solver="slsqp"
    )
    exact = 0.5 - np.sin(90.0) / 180.0
    assert abs(found.cost / exact - 1.0) > 0.01
    assert found.cost_of_solution == pytest.approx(exact, rel=1e-6)
    assert "along the whole motion the cost is" in str(found)


@pytest.mark.parametrize("solver", ["ipopt", "slsqp"])
def test_a_search_that_comes_to_no_derivative_keeps_what_was_nearest(monkeypatch, solver):
    if solver == "ipopt":
        pytest.importorskip("casadi")
    calls, slopes = [], ScaledProblem.slopes

    def lost(self, z):
        calls.append(z)
        if len(calls) > 3:
            raise mechc.MechcError("the motion has no derivatives: it grazes")
        return slopes(self, z)

    monkeypatch.setattr(ScaledProblem, "slopes", lost)
    found = problems.double_integrator().optimise(intervals=4, solver=solver)
    assert not found.converged
    assert np.isfinite(found.cost)
    assert "it came to where the motion has no derivatives" in str(found)


def test_a_search_that_ends_where_no_motion_exists_keeps_what_was_nearest(cart, monkeypatch):
    scaled = ScaledProblem(cart.problem, 1.0)
    z, at = cart.x / scaled.size, scaled.at

    def only_there(other):
        if not np.array_equal(other, z):
            raise mechc.AssemblyError("the loops do not close")
        return at(z)

    monkeypatch.setattr(scaled, "at", only_there)
    scaled.value(z)
    end = scaled.end_at(z + 1.0, True, "", 1, 0.0)
    assert not end.converged
    assert end.cost == pytest.approx(cart.cost)


@pytest.mark.parametrize("solver", ["ipopt", "slsqp"])
def test_the_same_seed_finds_the_same(solver):
    if solver == "ipopt":
        pytest.importorskip("casadi")
    asked = {"intervals": 2, "starts": 2, "seed": 7, "solver": solver}
    one, two = (problems.double_integrator().optimise(**asked) for _ in range(2))
    assert one.ends == two.ends
    assert one.x.tolist() == two.x.tolist()


@pytest.mark.parametrize(
    ("seconds", "force", "intervals", "cost"), [(1.0, None, 3, 432.0), (2.0, (-8, 8), 6, None)]
)
def test_a_minimum_beside_which_rounding_decides_is_found(seconds, force, intervals, cost):
    """SLSQP ends by a step that lowers nothing; elsewhere it ends without a minimum as before."""
    asked = {"integral": "F**2", "end": {"x": 3.0, "v": 0.0}, "intervals": intervals,
             "solver": "slsqp", "tol": 1e-14}  # fmt: skip
    model, given = problems.double_integrator().model, (seconds, [0.0, 0.0], {"F": force})
    found = model.optimise(*given, **asked)
    assert found.converged
    assert found.cost == pytest.approx(cost or found.cost, rel=1e-12)
    assert ": found" in str(found)
    cut = model.optimise(*given, **asked, max_iterations=2)
    assert not cut.converged
    scaled = ScaledProblem(found.problem, found.cost)
    at, before = (x / scaled.size for x in (found.x, cut.x))
    assert _is_stationary(scaled, at)
    assert not _is_stationary(scaled, before)
    assert not _is_stationary(scaled, at + 1e-3 * (before - at))
