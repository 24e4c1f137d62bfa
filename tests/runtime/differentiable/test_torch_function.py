"""Motions under PyTorch: its own check of gradients, vmap, second derivatives refused."""

import numpy as np
import pytest

import mechc
from tests.support.differences import has_the_options_of_simulate

torch = pytest.importorskip("torch")
pytestmark = pytest.mark.slow  # imports PyTorch
START = {"theta_0": 1.4835, "omega_0": 0.3}


@pytest.fixture(scope="module")
def bar():
    return mechc.load("four_bar", outputs=("energy", "multipliers", "sensitivities"))


def tensors(*values):
    return [torch.tensor(value, dtype=torch.float64, requires_grad=True) for value in values]


@pytest.mark.filterwarnings("ignore::UserWarning", "ignore::DeprecationWarning")
def test_gradcheck(bar):
    f = mechc.torch(bar, rtol=1e-12)

    def states(t, crank, pace, length, mass):
        return f(t, {"theta_0": crank, "omega_0": pace}, {"l_3": length, "m_1": mass})

    given = tensors([0.5, 1.0], 1.4835, 0.3, 3.5, 2.0)
    for times in ([0.5, 1.0], [1.0]):  # forwards, and by the adjoint
        given[0] = tensors(times)[0]
        assert torch.autograd.gradcheck(states, given, check_forward_ad=True, eps=1e-5, atol=1e-6)


def test_options():
    has_the_options_of_simulate(mechc.torch)


def test_vmap_is_a_batch(bar, monkeypatch):
    f, batched, calls = mechc.torch(bar), type(bar).simulate_batch, []

    def counted(model, *args, **policy):
        calls.append(len(policy.get("sensitivities", ())))
        return batched(model, *args, **policy)

    def rocker(crank):
        return f(1.0, {"theta_0": crank, "omega_0": 0.3}, {"l_3": 3.5})[2]

    cranks = torch.linspace(1.4, 1.5, 4, dtype=torch.float64)
    with monkeypatch.context() as patched:
        patched.setattr(type(bar), "simulate_batch", counted)
        patched.setattr(type(bar), "simulate", None)
        together = torch.func.vmap(rocker)(cranks)
        slopes = torch.func.vmap(torch.func.grad(rocker))(cranks)
        along = torch.func.jvp(torch.func.vmap(rocker), (cranks,), (torch.ones_like(cranks),))[1]
    assert sorted(calls) == [0, 0, 0, 3, 3]
    np.testing.assert_allclose(along, slopes, rtol=1e-12)
    for crank, value, slope in zip(cranks.tolist(), together, slopes, strict=True):
        y, moved = bar.jvp(1.0, START | {"theta_0": crank}, {"l_3": 3.5}, along={"theta_0": 1.0})
        assert value.item() == pytest.approx(y[2], rel=1e-9)
        assert slope.item() == pytest.approx(moved[2], rel=1e-9)


def test_what_it_does_not_do(bar):
    f = mechc.torch(bar)
    (length,) = tensors(3.5)
    (slope,) = torch.autograd.grad(f(1.0, START, {"l_3": length}).sum(), length, create_graph=True)
    with pytest.raises(mechc.MechcError, match="first derivatives only"):
        slope.backward()
    with pytest.raises(mechc.MechcError, match="float64"):
        f(1.0, START, {"l_3": torch.tensor(3.5)})
    with pytest.raises(mechc.UnknownNameError, match="l_8"):
        f(np.array([1.0]), START, {"l_8": length})
