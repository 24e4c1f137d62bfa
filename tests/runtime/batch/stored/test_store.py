"""Streamed batches: the same arrays as in memory, after a kill as well."""

import json
import os
import signal
import subprocess
import sys
import time
from functools import partial

import numpy as np
import pytest

import mechc
from tests.support.differences import have_the_same_arrays

pytest.importorskip("zarr")

CALL = """
import sys, numpy as np, mechc
theta = np.linspace(0.9, 1.9, 400)
start = mechc.Assembly({"theta_0": theta})
batch = mechc.load("four_bar").simulate_batch(
    float(sys.argv[2]), start, {"l_3": 3.5}, t_eval=[0.0, 0.5], reduce=["max(theta_2)"],
    method="gauss8", rtol=1e-7, out=sys.argv[1] or None, chunk=10, threads=1)
"""


@pytest.fixture
def start():
    return mechc.Assembly({"theta_0": np.linspace(0.9, 1.5, 23)})


def options(**changed):
    return {
        "params": {"l_3": 3.5}, "t_eval": [0.0, 0.5], "outputs": ["points"],
        "reduce": ["max(theta_2)"], "method": "gauss8", "chunk": 10,
    } | changed  # fmt: skip


def test_a_stream_holds_what_memory_would(model, start, tmp_path):
    held = model.simulate_batch(0.5, start, **options())
    streamed = model.simulate_batch(0.5, start, **options(), out=tmp_path / "batch")
    have_the_same_arrays(held, streamed)
    again = mechc.open(tmp_path / "batch")
    assert again.complete
    have_the_same_arrays(held, again)
    assert again.to_xarray().identical(held.to_xarray())


def test_what_a_killed_call_was_writing_is_removed_by_the_next(model, start, tmp_path):
    folder = tmp_path / "batch"
    model.simulate_batch(0.5, start, **options(), out=folder)
    whole = sorted(folder.rglob("*"))
    for name in ("data.zarr/y/c/0.4f.partial", f"mechc/.request.json.{'0' * 16}.part"):
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_text("half")
    model.simulate_batch(0.5, start, **options(), out=folder)
    assert sorted(folder.rglob("*")) == whole


def test_xarray_reads_the_folder_by_itself(model, start, tmp_path):
    xarray = pytest.importorskip("xarray")
    batch = model.simulate_batch(0.5, start, **options(), out=tmp_path / "batch")
    data = xarray.open_zarr(tmp_path / "batch" / "data.zarr", consolidated=False)
    assert np.array_equal(data.y, batch.y)
    assert data.y.dims == ("member", "state")


def test_another_request_is_refused_by_what_differs(model, start, tmp_path):
    out = tmp_path / "batch"
    model.simulate_batch(0.5, start, **options(), out=out)
    for changed, told in [
        ({"rtol": 1e-6}, "rtol is 1e-09, not 1e-06"),
        ({"params": {"l_3": 3.6}}, "params"),
        ({"chunk": 5}, "chunk is 10, not 5"),
        ({"reduce": ["min(theta_2)"]}, "reductions"),
    ]:
        with pytest.raises(mechc.MechcError, match=told):
            model.simulate_batch(0.5, start, **options(**changed), out=out)


def test_a_folder_of_other_things_is_left_alone(model, start, tmp_path):
    (tmp_path / "thesis.tex").write_text("mine")
    with pytest.raises(mechc.MechcError, match=r"thesis\.tex"):
        model.simulate_batch(0.5, start, **options(), out=tmp_path)
    with pytest.raises(mechc.MechcError, match="no batch"):
        mechc.open(tmp_path)
    (tmp_path / "mechc").mkdir()
    (tmp_path / "mechc" / "request.json").write_text("[]")
    with pytest.raises(mechc.MechcError, match="JSON object"):
        mechc.open(tmp_path)


def test_ctrl_c_leaves_a_folder_that_goes_on(model, start, tmp_path, monkeypatch):
    from mechc.batch import simulate as batch

    def interrupt(self, done):
        if done > 10:
            raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(batch.CountBar, "update_count", interrupt)
        with pytest.raises(KeyboardInterrupt) as stopped:
            model.simulate_batch(0.5, start, **options(), out=tmp_path / "batch")
    cut = stopped.value.batch
    assert not cut.complete
    assert cut.counts == {"not run": 13, "finished": 10}
    assert not mechc.open(tmp_path / "batch").complete
    whole = model.simulate_batch(0.5, start, **options(), out=tmp_path / "batch")
    have_the_same_arrays(whole, model.simulate_batch(0.5, start, **options()))


def test_a_part_of_a_chunk_is_kept(model, start, tmp_path, monkeypatch):
    """Ctrl-C amid the only chunk: what has a manifest is kept, and not computed again."""
    from mechc.batch import simulate as batch

    monkeypatch.setattr(batch, "KEEP_EVERY", 0.0)
    monkeypatch.setattr(batch, "WRITING", np.inf)
    lanes, reports = model.system.scene.lanes, []

    def interrupt(self, done):
        if done > 2 * lanes:
            raise KeyboardInterrupt

    call = partial(model.simulate_batch, 0.5, threads=1, out=tmp_path / "batch")
    members = mechc.Assembly({"theta_0": np.linspace(0.9, 1.5, 4 * lanes + 1)})
    asked = options(chunk=3 * lanes + 1)
    with monkeypatch.context() as patch:
        patch.setattr(batch.CountBar, "update_count", interrupt)
        with pytest.raises(KeyboardInterrupt) as stopped:
            call(members, **asked)
    assert stopped.value.batch.counts == {"not run": 2 * lanes + 1, "finished": 2 * lanes}
    again = mechc.open(tmp_path / "batch")
    assert not again.complete
    assert again.counts == stopped.value.batch.counts
    monkeypatch.setattr(batch.CountBar, "update_count", lambda _, done: reports.append(done))
    whole = call(members, **asked)
    assert reports[0] == 2 * lanes
    have_the_same_arrays(whole, model.simulate_batch(0.5, members, **asked))
    have_the_same_arrays(whole, mechc.open(tmp_path / "batch"))


def test_a_damaged_part_of_a_chunk_is_found(model, start, tmp_path, monkeypatch):
    from mechc.batch import simulate as batch

    folder, made = tmp_path / "batch", []

    def interrupt(self, done):
        made.append(done)
        if len(set(made)) > 2:
            raise KeyboardInterrupt

    monkeypatch.setattr(batch, "KEEP_EVERY", 0.0)
    monkeypatch.setattr(batch, "WRITING", np.inf)
    with monkeypatch.context() as patch:
        patch.setattr(batch.CountBar, "update_count", interrupt)
        with pytest.raises(KeyboardInterrupt):
            model.simulate_batch(0.5, start, **options(chunk=23), threads=1, out=folder)
    mechc.open(folder)
    values = folder / "data.zarr" / "y" / "c" / "0" / "0"
    held = bytearray(values.read_bytes())
    held[0] ^= 1
    values.write_bytes(held)
    with pytest.raises(mechc.MechcError, match="another sha256"):
        mechc.open(folder)
    again = model.simulate_batch(0.5, start, **options(chunk=23), out=folder)
    have_the_same_arrays(again, model.simulate_batch(0.5, start, **options()))


def chunks(folder):
    return {path.name: path.stat().st_mtime_ns for path in (folder / "mechc").glob("chunk-*.json")}


@pytest.mark.slow
def test_killed_at_any_point_the_same_call_finishes_with_the_same_arrays(tmp_path):
    """SIGKILL twice in mid-run: what had a manifest is not computed again."""
    out, seconds = tmp_path / "batch", "3.0"
    command = [sys.executable, "-c", CALL, str(out), seconds]
    for least in (2, 8):
        running = subprocess.Popen(command)
        while len(chunks(out)) < least and running.poll() is None:
            time.sleep(0.002)
        running.send_signal(signal.SIGKILL)
        assert running.wait() == -signal.SIGKILL, "it ended before it could be killed"
        assert least <= len(chunks(out)) < 40
    before = chunks(out)
    subprocess.run(command, check=True)
    after = chunks(out)
    assert len(after) == 40
    assert {name: after[name] for name in before} == before
    model = mechc.load("four_bar")
    start = mechc.Assembly({"theta_0": np.linspace(0.9, 1.9, 400)})
    held = model.simulate_batch(
        float(seconds), start, {"l_3": 3.5}, t_eval=[0.0, 0.5], reduce=["max(theta_2)"],
        method="gauss8", rtol=1e-7,
    )  # fmt: skip
    have_the_same_arrays(held, mechc.open(out))
    told = json.loads((out / "mechc" / "chunk-000000000010.json").read_text())
    assert told["members"] == [10, 20]


def test_two_calls_do_not_write_into_one_folder(model, start, tmp_path):
    import fcntl

    out = tmp_path / "batch"
    out.mkdir()
    with (out / ".mechc-lock").open("w") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        with pytest.raises(mechc.MechcError, match="another call"):
            model.simulate_batch(0.5, start, **options(), out=out)


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write anywhere")
def test_a_folder_that_cannot_be_written_is_told(model, start, tmp_path):
    tmp_path.chmod(0o500)
    with pytest.raises(mechc.MechcError, match="cannot write"):
        model.simulate_batch(0.5, start, **options(), out=tmp_path / "batch")
