"""What `auto` takes in a batch, and that it repeats by its name."""

import numpy as np
import pytest
from sympy import Symbol
from sympy.physics.mechanics import dynamicsymbols

import mechc
from benchmarks.problems.particle import particle

k, c = Symbol("k"), Symbol("c")


@pytest.fixture(scope="module")
def pendulum():
    return mechc.load("pendulum")


@pytest.fixture(scope="module")
def damped():
    """A mass on a spring and a damper: of linear equations, whose series has no sum."""
    q, u = dynamicsymbols("q u")
    return mechc.compile(
        particle([q], [u], [-k * q - c * u]), defaults={k: 1.0, "m": 1.0}, outputs=()
    )


@pytest.mark.parametrize(
    ("name", "rtol", "method"),
    [
        ("four_bar", 1e-6, "dop853"),
        ("four_bar", 1e-9, "gauss8 in lockstep"),
        ("pendulum", 1e-6, "taylor"),
        ("pendulum", 1e-9, "taylor"),
    ],
)
def test_a_member_is_repeated_by_the_method_that_the_batch_took(name, rtol, method):
    model = mechc.load(name)
    starts = np.array([model.assemble({"theta_0": 0.9 + 0.1 * i}) for i in range(9)])
    batch = model.simulate_batch(2.0, starts, rtol=rtol, progress=False)
    assert batch.method == method
    for member in (0, 4, 8):
        sol = model.simulate(2.0, starts[member], rtol=rtol, method=batch.method)
        assert sol.method == method
        np.testing.assert_array_equal(sol.y[-1], batch.y[member])
        np.testing.assert_array_equal(batch[member].y[-1], batch.y[member])
        exact = model.simulate(2.0, starts[member], rtol=1e-12).y[-1]
        np.testing.assert_allclose(batch.y[member], exact, rtol=0, atol=100 * rtol)


def test_members_with_sensitivities_are_runs_of_their_own(pendulum):
    model = mechc.load("pendulum", outputs=("sensitivities",))
    batch = model.simulate_batch(1.0, [[1.0, 0.0]], sensitivities=["y0"], progress=False)
    assert batch.method == "gauss8"


@pytest.mark.parametrize("rtol", [1e-5, 1e-9])
@pytest.mark.parametrize("damping", [1e3, 1e6])
def test_stiff_members_leave_the_explicit_methods(damped, rtol, damping):
    """After a while the motion is exp(-k t / c), though 1/c is the time of its fast component."""
    starts = np.tile([1.0, 0.0], (16, 1))
    batch = damped.simulate_batch(2.0, starts, {"c": damping}, rtol=rtol, progress=False)
    assert batch.method == "taylor"
    assert batch.steps.max() < 100
    fast, slow = np.roots([1.0, damping, 1.0])
    slow = 1.0 / fast  # of the product 1, without the cancellation
    exact = (np.exp(slow * 2.0) * -fast + np.exp(fast * 2.0) * slow) / (slow - fast)
    np.testing.assert_allclose(batch.y[:, 0], exact, rtol=0, atol=100 * rtol)
    explicit = damped.simulate_batch(
        2.0, starts[:1], {"c": 1e3}, rtol=rtol, method="taylor", progress=False
    )
    assert explicit.steps[0] > 200


def test_fast_rotation_is_not_taken_for_stiff():
    model = mechc.load("heavy_top")
    start = [0.0, 0.0, 0.0, 0.0, 150.0, -4.61538]
    steps = [
        model.simulate_batch(1.0, [start], method=method, progress=False).steps[0]
        for method in ("auto", "taylor")
    ]
    assert steps[0] == steps[1]


def test_words_after_a_method_that_has_no_lockstep_are_refused(pendulum):
    with pytest.raises(mechc.MechcError, match="no lockstep"):
        pendulum.simulate(1.0, [1.0, 0.0], method="radau5 in lockstep")
