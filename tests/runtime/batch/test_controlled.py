"""Sampled controllers in batches: every member is its own run, to the last bit."""

import pickle

import numpy as np
import pytest

import mechc

STARTS = np.array([[1.0, 0.0], [-0.5, 0.3], [0.2, -1.0]])
AT = np.array([0.0, 0.7, 1.01, 2.0])


class Integrating:
    """A controller with a memory."""

    def __init__(self, gain):
        self.gain, self.sum = gain, 0.0

    def __call__(self, t, q, u):
        self.sum += q[0]
        return -self.gain * (20.0 * q[0] + 6.0 * u[0] + 0.1 * self.sum)


def each(**more):
    return [mechc.Sampled(Integrating(g), 0.05, 0.012, **more) for g in (0.5, 1.0, 1.5)]


@pytest.mark.slow
@pytest.mark.parametrize("method", ["auto", "dop853", "dopri5"])
def test_members_with_controllers_are_the_runs_of_their_own(pushed, method):
    options = {"method": method, "rtol": 1e-8, "t_eval": AT}
    p = {"k": np.array([10.0, 20.0, 30.0])}
    batch = pushed.simulate_batch(
        2.0, STARTS, p, inputs={"F": each(jitter=0.01)}, outputs=("power",),
        reduce=("max(q)",), **options,
    )  # fmt: skip
    for k, sampled in enumerate(each(jitter=0.01)):
        sol = pushed.simulate(2.0, STARTS[k], {"k": p["k"][k]}, inputs={"F": sampled}, **options)
        np.testing.assert_array_equal(batch["y_eval"][k], sol.y)
        power = sol.model.output("power", sol.y, sol.params, sol.t)
        np.testing.assert_array_equal(batch["power"][k], power)
        assert batch["max(q)"][k] >= sol.y[:, 0].max() - 1e-12
    assert batch.ok.all()
    assert pickle.loads(pickle.dumps(batch)).y.shape == (3, 2)


def test_one_controller_for_all_and_starts_that_are_assembled(pushed):
    sampled = mechc.Sampled(lambda t, q, u: -15.0 * q[0] - 5.0 * u[0], 0.1)
    starts = {"q": STARTS[:, 0], "u": STARTS[:, 1]}
    batch = pushed.simulate_batch(2.0, starts, {"k": 3.0}, inputs={"F": sampled}, until="q < -0.1")
    for k, start in enumerate(STARTS):
        alone = pushed.simulate(batch.t[k], start, {"k": 3.0}, inputs={"F": sampled})
        np.testing.assert_allclose(batch.y[k], alone.y[-1], atol=1e-8)
    assert (batch.t < 2.0).any()


def test_controllers_that_a_batch_cannot_have(pushed, tmp_path):
    sampled = mechc.Sampled(lambda t: 0.0, 0.1)
    with pytest.raises(mechc.MechcError, match="in this process only"):
        pushed.simulate_batch(1.0, STARTS, inputs={"F": sampled}, out=tmp_path / "kept")
    with pytest.raises(mechc.MechcError, match=r"F \(2\)"):
        pushed.simulate_batch(1.0, STARTS, inputs={"F": [sampled, sampled]})
    with pytest.raises(mechc.MechcError, match="'G'"):
        pushed.simulate_batch(1.0, STARTS, inputs={"G": sampled})
    fails = mechc.Sampled(lambda t: 1 / 0, 0.1)
    with pytest.raises(mechc.InputError, match="ZeroDivisionError"):
        pushed.simulate_batch(1.0, STARTS, inputs={"F": fails})


@pytest.mark.parametrize(
    "event",
    [
        mechc.Stop("q", 0.6),
        pytest.param(mechc.DryFriction("u", 0.4), marks=pytest.mark.slow),
        mechc.Event("q < 0", reset={"u": "-u"}, terminal=3),
    ],
)
def test_members_with_controllers_and_contact_are_the_runs_of_their_own(pushed, event):
    """Controllers with a memory are called once; each member has the bits of its own run."""
    starts = np.abs(STARTS) * [1.0, -1.0]
    batch = pushed.simulate_batch(
        2.0, starts, {"k": 3.0}, inputs={"F": each()}, events=event, reduce=["min(q)"], t_eval=AT
    )
    for k, sampled in enumerate(each()):
        sol = pushed.simulate(2.0, starts[k], {"k": 3.0}, inputs={"F": sampled}, events=event)
        np.testing.assert_array_equal(batch.y[k], sol.y[-1])
        assert batch.t[k] == sol.t[-1]
        assert batch.status(k).code == sol.status.code
        assert batch.event_counts[k].tolist() == [len(sol.events[0].t)]
        assert sampled.controller.sum != 0.0
    low = batch["min(q)"] > -1e-9
    assert low.all() or isinstance(event, mechc.DryFriction)
