"""Batches of a scene of one's own: without loops, oddly named, in another process by its key."""

import json
import pickle
import subprocess
import sys

import numpy as np
import pytest

import mechc
from tests.support.pendulums import pendulum

AGAIN = """
import json, sys, numpy as np
from mechc.assembly.initial_values import Assembly
from mechc.model import Model
from mechc.system.reference import ModelReference
reference = ModelReference("odd", custom=True, key=sys.argv[1], defaults=json.loads(sys.argv[2]))
model = Model.of_reference(reference)
batch = model.simulate_batch(1.0, Assembly({"q/$x": np.linspace(0, 1, 5)}), threads=1)
print(batch.y.tobytes().hex())
"""
START = mechc.Assembly({"q/$x": np.linspace(0, 1, 5)})


@pytest.fixture(scope="module")
def model():
    return mechc.compile(pendulum(name="odd", angle="q/$x", speed="u ̇"))


def test_a_pendulum_needs_no_loop_and_keeps_its_energy(model):
    batch = model.simulate_batch(
        1.0, START, {"l": [1.0, 1.5, 2.0, 2.5, 3.0]}, reduce="range(energy)"
    )
    assert batch.counts == {"finished": 5}
    assert (batch["range(energy)"] < 1e-7).all()
    starts = np.column_stack([np.linspace(0, 1, 5), np.zeros(5)])
    same = model.simulate_batch(1.0, starts, {"l": [1.0, 1.5, 2.0, 2.5, 3.0]})
    assert np.array_equal(batch.y, same.y)


def test_odd_names_are_stored_and_read_again(model, tmp_path):
    xarray = pytest.importorskip("xarray")
    pytest.importorskip("zarr")
    batch = model.simulate_batch(1.0, START, out=tmp_path / "batch", reduce=["max(kinetic_energy)"])
    assert batch.to_xarray()["q__x"].attrs["long_name"] == "q/$x"
    data = xarray.open_zarr(tmp_path / "batch" / "data.zarr", consolidated=False)
    assert np.array_equal(data.reduction_0, batch["max(kinetic_energy)"])
    again = mechc.open(tmp_path / "batch")
    assert again.model.build["key"] == model.build["key"]
    assert again.model.defaults == model.defaults
    assert np.array_equal(again.y, batch.y)
    with pytest.raises(mechc.MechcError, match="the model 'four_bar' has others"):
        mechc.open(tmp_path / "batch", mechc.load("four_bar"))


@pytest.mark.slow
@pytest.mark.thorough
@pytest.mark.parametrize("sensitivities", [(), ("l",)])
def test_outputs_compiled_on_demand_are_stored_and_sent(tmp_path, sensitivities):
    pytest.importorskip("xarray")
    pytest.importorskip("zarr")
    lean = mechc.compile(pendulum(name="odd", angle="q/$x", speed="u ̇"), outputs=())
    ask = {"t_eval": [0.0, 1.0], "outputs": ["points"], "reduce": "max(energy)", "progress": False}
    batch = lean.simulate_batch(
        1.0, START, **ask, sensitivities=sensitivities, out=tmp_path / "batch"
    )
    sent = pickle.loads(pickle.dumps(batch))
    assert sent.model.build["key"] == lean.build["key"]
    for again in (mechc.open(tmp_path / "batch", lean), sent):
        for name in ("y", "points", "max(energy)", *(["sensitivity"] if sensitivities else [])):
            assert np.array_equal(again[name], batch[name])
        assert np.array_equal(again[1].y[-1], batch.y[1])
        assert again.to_xarray().sizes["member"] == 5


def test_another_process_finds_it_by_its_key_alone(model):
    batch = model.simulate_batch(1.0, START)
    defaults = json.dumps(model.system.reference.defaults)
    command = [sys.executable, "-c", AGAIN, model.build["key"], defaults]
    told = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    assert told.strip() == batch.y.tobytes().hex()
