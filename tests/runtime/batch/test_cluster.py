"""Batches on a Dask cluster of real processes on this machine."""

import os
import signal

import numpy as np
import pytest

import mechc
from mechc.compilation.find import system_of
from mechc.system.reference import ModelReference
from tests.support.differences import have_the_same_arrays

distributed = pytest.importorskip("distributed")
pytestmark = pytest.mark.filterwarnings("default")  # of distributed's own and its sockets


@pytest.fixture(scope="module")
def client(tmp_path_factory):
    with (
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None,
            local_directory=str(tmp_path_factory.mktemp("dask")),
        ) as cluster,
        distributed.Client(cluster) as client,
    ):  # fmt: skip
        yield client


def request(members, seconds):
    start = mechc.Assembly({"theta_0": np.linspace(0.9, 1.9, members)})
    return (seconds, start, {"l_3": 3.5}), {
        "reduce": ["max(theta_2)"], "method": "gauss8", "rtol": 1e-8, "chunk": 20,
    }  # fmt: skip


def test_a_cluster_returns_the_same_arrays(model, client, tmp_path):
    arguments, options = request(90, 0.5)
    here = model.simulate_batch(*arguments, **options)
    have_the_same_arrays(here, model.simulate_batch(*arguments, **options, client=client))
    streamed = model.simulate_batch(*arguments, **options, client=client, out=tmp_path / "b")
    have_the_same_arrays(here, streamed)
    options["events"] = [mechc.Stop("theta_0 - 0.2", 0.8), "omega_0"]
    here = model.simulate_batch(*arguments, **options)
    assert here.event_counts.any()
    have_the_same_arrays(here, model.simulate_batch(*arguments, **options, client=client))


def test_a_killed_worker_loses_nothing(model, client, monkeypatch):
    """Killed after the first chunk came back, with others under way."""
    from mechc.batch import simulate as batch

    arguments, options = request(1200, 3.0)
    killed = []

    def kill(self, done):
        if 0 < done < 600 and not killed:
            killed.append(next(iter(client.run(os.getpid).values())))
            os.kill(killed[0], signal.SIGKILL)

    with monkeypatch.context() as patch:
        patch.setattr(batch.CountBar, "update_count", kill)
        there = model.simulate_batch(*arguments, **options, client=client)
    assert killed
    have_the_same_arrays(model.simulate_batch(*arguments, **options), there)


def test_what_travels_is_a_description(model):
    """No compiled object and no code: a name, options, numbers."""
    import pickle

    reference = model.system.reference.exactly(model.instruction_set)
    sent = pickle.loads(pickle.dumps(reference))
    assert (sent.mechanism, sent.options, sent.key) == ("four_bar", {}, "")
    assert sent.instruction_set == model.instruction_set
    assert b"PyCapsule" not in pickle.dumps(reference)
    assert system_of(sent).instruction_set == model.instruction_set


def test_a_scene_that_is_not_in_the_cache_is_refused(model):
    with pytest.raises(mechc.MechcError, match="not in the cache"):
        system_of(ModelReference("mine", custom=True, key="0" * 64))
    with pytest.raises(mechc.MechcError, match="not the key"):
        system_of(ModelReference("mine", custom=True, key="../../etc"))


def test_workers_are_asked_once_all_is_compiled(model, monkeypatch):
    """Also by ``python -O``: what waits is no assertion."""
    from mechc.batch import cluster

    asked = []

    class Client:
        def nthreads(self):
            return {"worker": 1}

        def submit(self, function, reference, recipe, pure):
            asked.append("submitted")
            raise InterruptedError

    monkeypatch.setattr(type(model.system), "wait", lambda self: asked.append("waited"))
    recipe = model.simulate_batch(0.1, model.assemble()).recipe
    with pytest.raises(InterruptedError):
        next(cluster.compute_on(Client(), model.system, recipe, [(0, 1)], lambda done: None))
    assert asked == ["waited", "submitted"]
