"""Members of a batch whose explicit steps are short for stability: collocation takes over."""

import numpy as np
import pytest
import sympy as sm
from sympy.physics.mechanics import dynamicsymbols

import mechc
from benchmarks.problems.particle import particle


@pytest.fixture(scope="module")
def damped():
    """A mass on a spring and a damper: of linear equations, whose series has no sum."""
    q, u = dynamicsymbols("q u")
    k, c = sm.Symbol("k"), sm.Symbol("c")
    return mechc.compile(
        particle([q], [u], [-k * q - c * u]), defaults={k: 1.0, "m": 1.0}, outputs=()
    )


@pytest.mark.parametrize("rtol", [1e-5, 1e-9])
@pytest.mark.parametrize("damping", [1e3, 1e6])
def test_stiff_members_leave_the_explicit_methods(damped, rtol, damping):
    """After a while the motion is exp(-k t / c), though 1/c is the time of its fast component."""
    starts = np.tile([1.0, 0.0], (16, 1))
    batch = damped.simulate_batch(2.0, starts, {"c": damping}, rtol=rtol, progress=False)
    assert batch.method == "taylor in lockstep"
    assert batch.steps.max() < 100
    np.testing.assert_array_equal(batch[7].y[-1], batch.y[7])
    fast, slow = np.roots([1.0, damping, 1.0])
    slow = 1.0 / fast  # of the product 1, without the cancellation
    exact = (np.exp(slow * 2.0) * -fast + np.exp(fast * 2.0) * slow) / (slow - fast)
    np.testing.assert_allclose(batch.y[:, 0], exact, rtol=0, atol=100 * rtol)
    explicit = damped.simulate_batch(
        2.0, starts[:1], {"c": 1e3}, rtol=rtol, method="taylor", progress=False
    )
    assert explicit.steps[0] > 200


@pytest.mark.parametrize("rtol", [1e-6, 1e-9])
@pytest.mark.parametrize("method", ["dop853", "gauss8"])
def test_extremes_of_a_fast_component(damped, method, rtol):
    """Steps are not judged by E5 alone, which vanishes at h lambda = -5.65."""
    k, c = 1e6, np.geomspace(1e4, 1e6, 200)
    batch = damped.simulate_batch(
        1e-3,
        [1.0, 0.0],
        {"c": c, "k": k},
        rtol=rtol,
        method=method,
        reduce=["min(u)"],
        progress=False,
    )
    root = np.sqrt(c**2 - 4 * k)
    slow, fast = -2 * k / (c + root), -(c + root) / 2
    at = np.log(fast / slow) / (slow - fast)
    exact = slow * fast / (fast - slow) * (np.exp(slow * at) - np.exp(fast * at))
    np.testing.assert_allclose(batch["min(u)"], exact, rtol=20 * rtol)


@pytest.mark.slow(cases=99)
@pytest.mark.parametrize("rtol", [1e-4, 1e-8])
def test_where_a_fast_component_has_died_out_members_leave_the_explicit_pair(rtol):
    """There errors shrink by a lower order, and steps with them, below what stability bears."""
    model = mechc.load("flyball_governor")
    start = model.assemble()
    batch = model.simulate_batch(
        5.0, [start], rtol=rtol, method="dop853 in lockstep", progress=False
    )
    assert batch.method == "dop853 in lockstep"
    assert batch.steps[0] < 1.5 * model.simulate(5.0, start, rtol=rtol).stats["steps"]


def test_fast_rotation_is_not_taken_for_stiff():
    model = mechc.load("heavy_top")
    start = [0.0, 0.0, 0.0, 0.0, 150.0, -4.61538]
    steps = [
        model.simulate_batch(1.0, [start], method=method, progress=False).steps[0]
        for method in ("auto", "taylor")
    ]
    assert steps[0] == steps[1]


@pytest.fixture(scope="module")
def follower():
    """u' = -c (u - cos 5t), which follows the cosine the closer the stiffer it is."""
    q, u = dynamicsymbols("q u")
    c, t = sm.Symbol("c"), dynamicsymbols._t
    given = mechc.from_equations(
        [q], [u], sm.Matrix([1]), [-c * (u - sm.cos(5 * t))], name="follower", defaults={c: 1e4}
    )
    return mechc.compile(given)


def test_stiff_members_have_dense_output_reductions_and_events(follower):
    """Collocation takes over from Taylor series, whose dense output has more rows."""
    stiffness, times = np.geomspace(1e3, 1e5, 16), np.linspace(0, 5, 101)
    batch = follower.simulate_batch(
        5.0, np.zeros((16, 2)), {"c": stiffness}, rtol=1e-8, t_eval=times, progress=False,
        reduce=["max(u)"], events=[mechc.Event("u", direction=-1)],
    )  # fmt: skip
    assert batch.method == "taylor in lockstep"
    for k, c in enumerate(stiffness):
        size, phase = c / np.hypot(c, 5.0), np.arctan2(5.0, c)
        exact = size * (np.cos(5 * times - phase) - np.cos(phase) * np.exp(-c * times))
        np.testing.assert_allclose(batch.y_eval[k, :, 1], exact, rtol=0, atol=2e-9)
        np.testing.assert_allclose(batch[k](times)[:, 1], exact, rtol=0, atol=2e-9)
        assert batch["max(u)"][k] == pytest.approx(size, abs=1e-9)
        zeros = (np.pi / 2 + phase + 2 * np.pi * np.arange(4)) / 5
        assert batch[k].events[0].t == pytest.approx(zeros, abs=1e-9)


def test_stiff_members_do_not_depend_on_the_others(follower):
    stiffness = np.geomspace(1.0, 1e4, 12)
    asked = {"rtol": 1e-7, "progress": False, "events": [mechc.Event("u", reset={"u": "u + 0.1"})]}
    batch = follower.simulate_batch(0.5, np.zeros((12, 2)), {"c": stiffness}, threads=1, **asked)
    for k in range(12):
        one = follower.simulate_batch(0.5, np.zeros((1, 2)), {"c": stiffness[k : k + 1]}, **asked)
        np.testing.assert_array_equal(one.y[0], batch.y[k])
        np.testing.assert_array_equal(one.event_latest[0], batch.event_latest[k])


def test_collocation_keeps_its_rows_of_dense_output_after_an_explicit_pair():
    """Members begin stiff, by collocation, among explicit steps whose dense output has fewer."""
    q, u = dynamicsymbols("q u")
    c, t = sm.Symbol("c"), dynamicsymbols._t
    force = -c * sm.exp(-4 * t) * u - 2 * sm.sin(q) - sm.sinh(q) / 20
    model = mechc.compile(
        mechc.from_equations(
            [q], [u], sm.Matrix([1]), [force], kinematics={q: 2 * u}, name="softening",
            defaults={c: 1e4},
        )
    )  # fmt: skip
    times = np.linspace(0, 5, 501)
    batch = model.simulate_batch(5.0, [[1.0, 0.0]], rtol=1e-8, t_eval=times, progress=False)
    assert batch.method == "dop853 in lockstep"
    exact = model.simulate(5.0, [1.0, 0.0], method="gauss8", rtol=1e-12)
    np.testing.assert_allclose(batch.y_eval[0], exact(times), rtol=0, atol=2e-9)
