"""Motions under JAX: its own checks of derivatives, jit, vmap."""

import numpy as np
import pytest

import mechc
from tests.support.differences import has_the_options_of_simulate

jax = pytest.importorskip("jax")
pytestmark = [
    pytest.mark.slow,  # imports JAX
    pytest.mark.filterwarnings("ignore::DeprecationWarning"),
]
START, PARAMS = {"theta_0": 1.4835, "omega_0": 0.3}, {"l_3": 3.5, "m_1": 2.0}
TIMES = np.array([0.5, 1.0])


@pytest.fixture(scope="module")
def bar():
    return mechc.load("four_bar", outputs=("energy", "multipliers", "sensitivities"))


@pytest.fixture
def doubles():
    with jax.enable_x64(True) if hasattr(jax, "enable_x64") else jax.experimental.enable_x64():
        yield


@pytest.mark.usefixtures("doubles")
def test_check_grads(bar):
    from jax.test_util import check_grads

    f = mechc.jax(bar, rtol=1e-12)
    check_grads(f, (TIMES, START, PARAMS), order=1, rtol=1e-6, eps=1e-5)


@pytest.mark.usefixtures("doubles")
def test_a_whole_state_and_a_later_start():
    pendulum = mechc.load("pendulum", outputs=("energy", "points", "sensitivities"))
    f = mechc.jax(pendulum, t0=-0.3)
    y0 = np.array([0.8, 0.3])
    jacobian = jax.jacrev(lambda y: f(1.0, y, {"l_0": 1.3}))(y0)
    for column, unit in zip(jacobian.T, np.eye(2), strict=True):
        _, wanted = pendulum.jvp(1.0, y0, {"l_0": 1.3}, along={"y0": unit}, t0=-0.3)
        np.testing.assert_allclose(column, wanted, rtol=1e-12)


@pytest.mark.usefixtures("doubles")
def test_options():
    has_the_options_of_simulate(mechc.jax)


@pytest.mark.usefixtures("doubles")
def test_jit_and_vmap_give_the_same(bar):
    f = mechc.jax(bar)

    def rocker(crank):
        return f(1.0, START | {"theta_0": crank}, PARAMS)[2]

    cranks = np.linspace(1.4, 1.5, 5)
    y0 = [bar.assemble({"theta_0": a}, {"omega_0": 0.3}, params=PARAMS) for a in cranks]
    wanted = [bar.simulate(1.0, y, PARAMS).y[-1, 2] for y in y0]
    np.testing.assert_allclose(jax.jit(jax.vmap(rocker))(cranks), wanted, rtol=1e-9)
    slopes = jax.vmap(jax.grad(rocker))(cranks)
    np.testing.assert_allclose(slopes, [jax.jit(jax.grad(rocker))(a) for a in cranks], rtol=1e-12)


@pytest.mark.usefixtures("doubles")
@pytest.mark.parametrize("transform", ["vmap", "jit", "grad", "jvp"])
def test_vmap_is_one_batch(bar, transform, monkeypatch):
    """Also with grad and jvp within it and jit around it: no single run is made."""
    f = mechc.jax(bar)

    def rocker(crank):
        return f(1.0, START | {"theta_0": crank}, PARAMS)[2]

    slope = {
        "vmap": rocker, "jit": rocker, "grad": jax.grad(rocker),
        "jvp": lambda crank: jax.jvp(rocker, (crank,), (1.0,))[1],
    }[transform]  # fmt: skip
    cranks = np.linspace(1.4, 1.5, 3)
    alone = [slope(a) for a in cranks]
    calls = []
    batched = type(bar).simulate_batch

    def counted(model, *args, **policy):
        calls.append(len(policy.get("sensitivities", ())))
        return batched(model, *args, **policy)

    monkeypatch.setattr(type(bar), "simulate_batch", counted)
    monkeypatch.setattr(type(bar), "simulate", None)
    together = jax.vmap(slope)
    found = (jax.jit(together) if transform == "jit" else together)(cranks)
    np.testing.assert_allclose(found, alone, rtol=1e-12)
    assert sorted(calls) == ([0] if transform in ("vmap", "jit") else [0, 4])


def test_single_precision_is_refused(bar):
    with pytest.raises(mechc.MechcError, match="jax_enable_x64"):
        mechc.jax(bar)(1.0, START, PARAMS)
