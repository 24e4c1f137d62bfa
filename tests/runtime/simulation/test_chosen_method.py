"""What ``method="auto"`` takes for a run by itself."""

import copy
import pickle

import numpy as np
import pytest

import mechc
from mechc.native._codes import METHODS

TOP = [0.0, 0.6, 0.0, 1.0, 50.0, -2.0]
NAMES = {number: name for name, number in METHODS.items()}


@pytest.fixture(scope="module")
def pendulum():
    return mechc.load("pendulum", outputs=("energy", "sensitivities"))


def taken(sol):
    """The methods of its steps."""
    return {NAMES[number] for number in sol.record.last.steps.methods()}


@pytest.mark.parametrize(
    ("name", "start", "method"),
    [("pendulum", [1.0, 0.0], "taylor"), ("heavy_top", TOP, "taylor"),
     ("planar_chain", None, "gauss8"), ("four_bar", None, "gauss8")],
)  # fmt: skip
def test_series_are_taken_where_no_order_waits_for_linear_equations(name, start, method):
    model = mechc.load(name)
    sol = model.simulate(0.5, model.assemble() if start is None else start, rtol=1e-9)
    assert sol.method == method
    assert taken(sol) == {method}
    other = model.simulate(0.5, sol.y[0], rtol=1e-12, method="dop853")
    np.testing.assert_allclose(sol.y[-1], other.y[-1], rtol=0, atol=1e-7)
    again = model.simulate(0.5, sol.y[0], rtol=1e-9, method=sol.method)
    assert np.array_equal(again.y, sol.y)


def test_long_runs_are_left_to_collocation_before_the_first_step(pendulum):
    """It is symmetric: the phase of a series drifts with the square of the time."""
    sol = pendulum.simulate(200.0, [1.0, 0.0], rtol=1e-9)
    assert taken(sol) == {"gauss8"}
    assert sol.method == "gauss8"
    assert taken(pendulum.simulate(200.0, [1.0, 0.0], rtol=1e-9, method="taylor")) == {"taylor"}
    exact = pendulum.simulate(200.0, [1.0, 0.0], rtol=1e-13, method="gauss8")
    np.testing.assert_allclose(sol.y[-1], exact.y[-1], rtol=0, atol=1e-9)


def test_derivatives_and_steppers_have_collocation(pendulum):
    assert pendulum.simulate(1.0, [1.0, 0.0], sensitivities=["l_0"]).method == "gauss8"
    assert pendulum.simulate(1.0, [1.0, 0.0], checkpoints=1e6).method == "gauss8"
    assert pendulum.stepper([1.0, 0.0])._policy.method == "gauss8"
    batch = pendulum.simulate_batch(1.0, [[1.0, 0.0]], sensitivities=["l_0"], progress=False)
    assert batch.method == "gauss8"


@pytest.mark.parametrize("more", [{}, {"sensitivities": ["l_0"]}])
def test_a_solution_is_read_by_the_method_that_it_began_with(pendulum, tmp_path, more):
    sol = pendulum.simulate(2.0, [1.0, 0.0], **more)
    sol.save(tmp_path / "run.nc")
    for again in (mechc.open(tmp_path / "run.nc"), pickle.loads(pickle.dumps(sol)), copy.copy(sol)):
        assert again.method == sol.method
        assert np.array_equal(again.y, sol.y)
        assert np.array_equal(again(np.linspace(0, 2, 7)), sol(np.linspace(0, 2, 7)))


def test_stiff_runs_go_over_from_series(pendulum):
    from sympy import Symbol
    from sympy.physics.mechanics import dynamicsymbols

    from benchmarks.problems.particle import particle

    q, u = dynamicsymbols("q u")
    k, c = Symbol("k"), Symbol("c")
    damped = mechc.compile(
        particle([q], [u], [-k * q - c * u]), defaults={k: 1.0, c: 1e3, "m": 1.0}, outputs=()
    )
    sol = damped.simulate(0.15, [1.0, 0.0], rtol=1e-8)
    fast = np.roots([1.0, 1e3, 1.0])[0]
    slow = 1.0 / fast  # of the product 1, without the cancellation
    exact = (np.exp(slow * 0.15) * -fast + np.exp(fast * 0.15) * slow) / (slow - fast)
    assert sol.method == "taylor"
    assert sol.stats["steps"] < 100
    assert sol.y[-1, 0] == pytest.approx(exact, abs=1e-9)


def test_a_method_that_auto_cannot_begin_with_is_refused(pendulum):
    with pytest.raises(mechc.UnknownNameError, match="nothing"):
        pendulum.simulate(1.0, [1.0, 0.0], method="auto from nothing")
