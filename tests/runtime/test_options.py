"""Options of verbs that other tests do not pass: each does what its page says."""

import numpy as np
import pytest

import mechc
from benchmarks.problems import optimal as problems
from tests.support.pendulums import driven_pendulum, pushed_mass, van_der_pol

NUMBERS, REST = {"m": 2.0, "k": 30.0}, {"q": 0.1, "u": 0.0}
W = np.sqrt(15.0)


@pytest.fixture(scope="module")
def cart():
    outputs = ("energy", "sensitivities")
    return mechc.compile(pushed_mass(), name="cart", defaults=NUMBERS, outputs=outputs)


def test_a_stepper_begins_at_its_time_with_its_tolerances():
    """The equations contain cos(2 pi t); a coarse absolute tolerance shows."""
    model, start = driven_pendulum(), np.array([0.2, 0.0])
    exact = model.simulate((0.3, 0.8), start, rtol=1e-12).y[-1]
    steps = []
    for atol, error in ((1e-10, 1e-4), (1e-2, 1.0)):
        stepper = model.stepper(start, t=0.3, rtol=1e-6, atol=atol, method="dopri5")
        assert np.abs(stepper.step(0.5) - exact).max() < error
        steps.append(stepper.stats["steps"])
    assert steps[1] < 0.5 * steps[0]


def test_a_stepper_stops_at_a_change_point_where_it_is_asked_to(model):
    y0 = model.assemble({"theta_0": np.radians(85)})
    stepper = model.stepper(y0, on_change_point="stop")
    with pytest.raises(mechc.MechcError, match="change point"):
        stepper.step(6.0)


def test_a_linear_model_at_a_time(cart):
    """dq'/dt of an equation with cos(2 pi t): the linear model is the same, its rates are not."""
    model, y = driven_pendulum(), np.array([0.2, 0.1])
    early, late = (model.linearize(y, t=t) for t in (0.0, 0.25))
    np.testing.assert_array_equal(early.A, late.A)
    assert early.rates[1] - late.rates[1] == pytest.approx((3 * np.pi) ** 2 * 1.06)


def test_continue_to_reports_its_progress(cart):
    told = []
    cart.simulate(0.1, REST, inputs={"F": 0.0}).continue_to(30.0, progress=told.append)
    assert told == sorted(told)
    assert told[-1] == pytest.approx(1.0)


def test_a_report_without_a_comparison_derives_nothing_else():
    fixed = mechc.compile(pushed_mass(), name="fixed", defaults=NUMBERS, fix={"m": 2.0})
    assert len(str(fixed.report(compare=False))) < len(str(fixed.report()))


def test_gradients_of_a_driven_motion(cart):
    """q = F/k + (q0 - F/k) cos(w t): the derivative by F is (1 - cos(w t)) / k."""
    y, pull = cart.vjp(0.7, REST, by=["F"], inputs={"F": 3.0}, rtol=1e-11)
    assert y[0] == pytest.approx(0.1, abs=1e-9)
    assert pull([1.0, 0.0])["F"] == pytest.approx((1.0 - np.cos(0.7 * W)) / 30.0, abs=1e-10)


def test_optimal_motions_from_a_line_and_from_the_motion_begin_at_a_time():
    for begin in ("line", "motion"):
        found = problems.double_integrator().optimise(
            solver="slsqp", intervals=8, begin=begin, t0=2.0
        )
        assert (found.status, found.solution.span[0]) == ("converged", 2.0)
        assert found.duration == pytest.approx(4.0, rel=1e-7)


@pytest.mark.slow
def test_cycles_of_a_driven_motion_by_a_method(cart):
    """A mass on a spring under sin(t) has the cycle q = sin(t) / (k - m), and another problem has
    too few iterations."""
    start, inputs = {"q": 0.0, "u": 0.03}, {"F": "sin(t)"}
    cycle = cart.periodic(start, 2 * np.pi, inputs=inputs, method="dop853")
    np.testing.assert_allclose(cycle.y0, [0.0, 1.0 / 28.0], atol=1e-8)
    assert "dop853" in cycle.solution.method
    with pytest.raises(mechc.MechcError, match="no cycle was found"):
        van_der_pol().periodic({"q": 1.0}, 6.0, max_iterations=1)


def test_starts_near_a_cycle_within_a_tolerance():
    cycle = van_der_pol().periodic({"q": 2.0}, 6.5, {"mu": 0.3})
    start = np.array([[2.3, 0.0]])
    assert cycle.basin(start, periods=1, tol=1.0) == [0]
    assert cycle.basin(start, periods=1, tol=1e-6) == [-1]


def test_a_fit_ends_when_it_is_told_to(cart):
    t = np.linspace(0.0, 2.0, 41)
    data = (t, 0.1 * np.cos(np.sqrt(16.0) * t))
    given = {"measured": "q", "y0": REST, "inputs": {"F": 0.0}}
    early = cart.fit(data, {"k": (10.0, 60.0)}, **given, max_evaluations=2)
    assert early.status != "converged"
    loose, tight = (cart.fit(data, {"k": (10.0, 60.0)}, **given, tol=tol) for tol in (1e-2, 1e-12))
    assert abs(tight["k"] - 32.0) < 1e-9
    assert loose.motions < tight.motions


@pytest.mark.slow
def test_members_of_a_batch_by_their_tolerances_and_steps(cart):
    starts, given = np.tile([0.1, 0.0], (3, 1)), {"inputs": {"F": 0.0}, "progress": False}
    plain = cart.simulate_batch(5.0, starts, **given)
    small = cart.simulate_batch(5.0, starts, max_step=0.01, first_step=1e-4, **given)
    rough = cart.simulate_batch(5.0, starts, rtol=1e-3, atol=1e-3, method="dopri5", **given)
    assert small["steps"].min() > 500 > plain["steps"].max()
    exact = 0.1 * np.cos(5.0 * W)
    assert np.abs(small.y[:, 0] - exact).max() < 1e-9 < np.abs(rough.y[:, 0] - exact).max() < 1e-2
