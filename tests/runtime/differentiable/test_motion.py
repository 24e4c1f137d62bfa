"""Products with derivatives of motions on NumPy arrays."""

import sys

import numpy as np
import pytest

import mechc
from mechc.differentiable.motion import motion_of
from tests.support.differences import apart, extrapolated
from tests.support.pendulums import pushed_mass

TIMES = np.array([0.4, 1.1, 2.0])
START = {"theta_0": 0.8, "omega_0": 0.3}


@pytest.fixture(scope="module")
def pendulum():
    return mechc.load("pendulum", outputs=("energy", "points", "sensitivities"))


def test_along_a_direction(pendulum):
    along = {"l_0": 0.7, "theta_0": -0.4, "omega_0": 1.2}
    y, moved = pendulum.jvp(TIMES, START, {"l_0": 1.3}, along=along, rtol=1e-11)

    def run(step):
        start = {name: value + step * along[name] for name, value in START.items()}
        params = {"l_0": 1.3 + step * along["l_0"]}
        return pendulum.simulate(2.0, start, params, t_eval=TIMES, rtol=1e-13).y

    assert y.shape == moved.shape == (3, 2)
    assert apart(y, run(0.0)) < 1e-9
    assert apart(moved, extrapolated(run, 0.01)) < 1e-8


def test_pulling_back_is_the_transpose(pendulum):
    y0, weights = np.array([0.8, 0.3]), np.random.default_rng(0).normal(size=(3, 2))
    y, pull = pendulum.vjp(TIMES, y0, by=["l_0", "y0", "g"], t0=-0.5)
    found = pull(weights)
    assert found["y0"].shape == (2,)
    for along in ({"l_0": 1.0}, {"g": 1.0}, {"y0": [1.0, 0.0]}, {"y0": [0.0, 1.0]}):
        there, moved = pendulum.jvp(TIMES, y0, along=along, t0=-0.5)
        np.testing.assert_array_equal(there, y)
        (name, tangent), = along.items()  # fmt: skip
        assert np.dot(found[name], tangent) == pytest.approx((weights * moved).sum(), rel=1e-12)


def test_the_end_is_pulled_back_by_the_adjoint(pendulum):
    y0, names = np.array([0.8, 0.3]), ["l_0", "y0", "g"]
    end, pull = pendulum.vjp(2.0, y0, by=names)
    every, forwards = pendulum.vjp(TIMES, y0, by=names)
    np.testing.assert_array_equal(end, every[-1])
    weights = np.array([0.4, -1.3])
    wanted = forwards(np.array([[0.0, 0.0], [0.0, 0.0], weights]))
    for name, found in pull(weights).items():
        np.testing.assert_allclose(found, wanted[name], rtol=1e-9)
    with pytest.raises(mechc.UnknownNameError, match="l_7"):
        pendulum.vjp(2.0, y0, by=["l_7"])


def test_one_time_is_the_end(pendulum):
    y, moved = pendulum.jvp(2.0, START, along={"l_0": 1.0})
    assert y.shape == moved.shape == (2,)
    np.testing.assert_array_equal(y, pendulum.simulate(2.0, START, method="gauss8").y[-1])


@pytest.mark.parametrize("times", [0.0, [0.0], [0.0, 0.5]])
def test_a_first_time_at_the_start_is_the_start(pendulum, times):
    """A time of t0 alone was refused; the derivatives there are those of the start."""
    y0 = np.array([0.8, 0.3])
    y, moved = pendulum.jvp(times, y0, along={"y0": [1.0, 2.0]})
    np.testing.assert_array_equal(np.atleast_2d(y)[0], y0)
    np.testing.assert_array_equal(np.atleast_2d(moved)[0], [1.0, 2.0])
    _, pull = pendulum.vjp(times, y0, by=["y0", "l_0"])
    first = np.zeros_like(y)
    first[(0,) * (y.ndim - 1)] = 3.0, 4.0
    found = pull(first)
    np.testing.assert_array_equal(found["y0"], [3.0, 4.0])
    assert found["l_0"] == 0.0


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"t": [1.0, 0.5], "along": {"l_0": 1.0}}, "times must rise"),
        ({"t": 1.0, "along": {"y0": [1.0]}}, r"tangent of y0 has the shape \(2,\)"),
        ({"t": 1.0, "along": {"l_7": 1.0}}, "l_7"),
        ({"t": 1.0, "t0": 1.5, "along": {"l_0": 1.0}}, "t0"),
    ],
)
def test_wrong_arguments(pendulum, given, words):
    with pytest.raises(mechc.MechcError, match=words):
        pendulum.jvp(y0=np.array([0.8, 0.3]), **given)


def test_a_cotangent_of_another_shape(pendulum):
    _, pull = pendulum.vjp(2.0, START, by=["l_0"])
    with pytest.raises(mechc.ValueOutOfBoundsError, match="shape of the states"):
        pull(np.ones(3))


@pytest.mark.parametrize("start", [("theta_0", "omega_0"), None])
def test_derivatives_of_several_motions_are_one_batch(pendulum, start, monkeypatch):
    """Each with times of its own; whole states and assembled starts."""
    motion = motion_of(pendulum, start, ("l_0",), 0.0, {"rtol": 1e-10})
    t = np.array([[0.5, 1.0], [0.2, 2.0], [0.5, 1.0]])
    x = np.array([[0.8, 0.3, 1.3], [0.7, 0.2, 1.1], [-0.4, 0.0, 1.0]])
    alone = [motion.slopes(*each) for each in zip(t, x, strict=True)]
    states = [motion.states(*each) for each in zip(t, x, strict=True)]
    calls = []
    batched, single = type(pendulum).simulate_batch, type(pendulum).simulate

    def counted(model, *args, **policy):
        calls.append("batch")
        return batched(model, *args, **policy)

    monkeypatch.setattr(type(pendulum), "simulate_batch", counted)
    monkeypatch.setattr(type(pendulum), "simulate", lambda *_, **__: calls.append("single"))
    np.testing.assert_allclose(motion.slopes(t, x), alone, rtol=1e-8, atol=1e-9)
    np.testing.assert_allclose(motion.states(t, x), states, rtol=1e-8, atol=1e-9)
    weights = np.arange(12.0).reshape(3, 2, 2)
    wanted = [np.einsum("ti,tik->k", w, s) for w, s in zip(weights, alone, strict=True)]
    np.testing.assert_allclose(motion.pull_back(t, x, weights), wanted, rtol=1e-8)
    assert calls == ["batch"] * 3
    monkeypatch.setattr(type(pendulum), "simulate", single)
    together = motion.slopes(t[[0, 2]], x[[0, 2]])
    np.testing.assert_array_equal(together, [alone[0], alone[2]])


def test_a_member_that_fails_after_its_own_time_is_kept(pendulum):
    motion = motion_of(pendulum, None, (), 0.0, {"max_steps": 40, "method": "dop853"})
    t, x = np.array([[0.1], [60.0]]), np.array([[0.8, 0.3], [0.8, 0.3]])
    found, slopes = motion.states(t, x), motion.slopes(t, x)
    np.testing.assert_array_equal(found[0], motion.states(t[0], x[0]))
    np.testing.assert_array_equal(slopes[0], motion.slopes(t[0], x[0]))
    assert np.isnan(found[1]).all()
    assert np.isnan(slopes[1]).all()


@pytest.mark.parametrize("method", ["auto", "gauss8 in lockstep"])
def test_several_motions_have_the_steps_of_simulate(pendulum, method):
    motion = motion_of(pendulum, None, (), 0.0, {"method": method})
    t, x = np.array([[0.4, 1.1]]), np.array([[0.8, 0.3], [0.7, 0.2]])
    found = motion.states(t, x)
    for row, each in zip(x, found, strict=True):
        np.testing.assert_array_equal(each, motion.states(t[0], row))


def test_several_motions_are_a_batch_with_the_inputs_of_the_model():
    model = mechc.compile(pushed_mass(), defaults={"m": 2.0, "k": 1.0}, outputs=("sensitivities",))
    for force in (0.7, lambda t: 0.7 + 0.0 * t):
        motion = motion_of(model.with_inputs({"F": force}), ("q", "u"), ("k",), 0.0, {})
        x = np.array([[0.1, 0.2, 1.0], [0.3, -0.2, 2.0]])
        found = motion.states(TIMES[None], x)
        assert found.shape == (2, 3, 2)
        for row, each in zip(x, found, strict=True):
            np.testing.assert_array_equal(each, motion.states(TIMES, row))


@pytest.mark.parametrize("tool", ["jax", "torch"])
def test_without_the_tool(pendulum, tool, monkeypatch):
    monkeypatch.setitem(sys.modules, tool, None)
    with pytest.raises(mechc.MissingPackageError, match=f"pip install {tool}"):
        getattr(mechc, tool)(pendulum)


@pytest.mark.slow
def test_past_a_change_point_lengths_are_refused():
    """By the start, lengths held, there is a derivative; the error says so."""
    bar = mechc.load("four_bar", outputs=("energy", "multipliers", "sensitivities"))
    start, words = {"theta_0": np.radians(85)}, "by l_3: none from t = .*change point.*lengths held"
    with pytest.raises(mechc.MechcError, match=words):
        bar.jvp(2.0, start, along={"l_3": 1.0})
    _, pull = bar.vjp(2.0, start, by=["theta_0", "l_3"])
    with pytest.raises(mechc.MechcError, match=words):
        pull(np.ones(6))
    _, moved = bar.jvp(2.0, start, along={"theta_0": 1.0})
    _, pull = bar.vjp(2.0, start, by=["theta_0", "m_1"])
    assert pull(np.ones(6))["theta_0"] == pytest.approx(moved.sum(), rel=1e-8)
