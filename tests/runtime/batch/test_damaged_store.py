"""A batch from a stranger runs nothing, and a damaged one is never read as a good one."""

import json
import pickle
import subprocess
import sys
import zipfile

import numpy as np
import pytest

import mechc
from tests.support.differences import have_the_same_arrays

zarr = pytest.importorskip("zarr")

COUNT, CHUNK = 23, 10


@pytest.fixture
def call(model):
    """The request, as a function of the folder."""
    theta = np.linspace(0.9, 1.5, COUNT)

    def made(out=None, **more):
        return model.simulate_batch(
            0.5, mechc.Assembly({"theta_0": theta}), {"l_3": 3.5}, t_eval=[0.0, 0.5],
            outputs=["points"], reduce=["max(theta_2)"], method="gauss8", chunk=CHUNK, out=out,
            **more,
        )  # fmt: skip

    return made


@pytest.fixture
def folder(call, tmp_path):
    call(tmp_path / "batch")
    return tmp_path / "batch"


def failing(error):
    """Something that raises it, whatever it is called with."""

    def fail(*_):
        raise error

    return fail


# -- a stranger's -----------------------------------------------------------------------------


class Touch:
    """Unpickled, it makes a file."""

    def __init__(self, path):
        self.path = path

    def __reduce__(self):
        return open, (str(self.path), "w")


def test_metadata_of_zarr_2_with_a_pickle_filter_run_nothing(folder, tmp_path):
    """An empty folder in place of zarr.json made Zarr fall back to .zarray and its filters."""
    trap, array = tmp_path / "trap", folder / "data.zarr" / "t"
    (array / "zarr.json").unlink()
    (array / "zarr.json").mkdir()
    told = {
        "zarr_format": 2, "shape": [COUNT], "chunks": [COUNT], "dtype": "|O", "order": "C",
        "compressor": None, "fill_value": None, "filters": [{"id": "pickle"}],
    }  # fmt: skip
    (array / ".zarray").write_text(json.dumps(told))
    (array / "0").write_bytes(pickle.dumps(Touch(trap)))
    with pytest.raises(mechc.MechcError, match=r"zarr\.json"):
        np.asarray(mechc.open(folder)["t"])
    assert not trap.exists()


def tell(array, change):
    path = array / "zarr.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | change))


@pytest.mark.parametrize(
    "change",
    [
        {"codecs": [{"name": "bytes", "configuration": {"endian": "big"}}]},
        {"codecs": [{"name": "numcodecs.pickle", "configuration": {}}]},
        {"codecs": [{"name": "vlen-bytes"}]},
        {"shape": [2**50]},
        {"shape": [float(COUNT)]},
        {"chunk_grid": {"name": "regular", "configuration": {"chunk_shape": [2**40]}}},
        {"data_type": "string"},
        {"data_type": "int64"},
        {"fill_value": 1.0},
        {"zarr_format": 2},
        {"node_type": "group"},
        {"storage_transformers": [{"name": "x"}]},
        {"chunk_key_encoding": {"name": "default", "configuration": {"separator": "../"}}},
        {"dimension_names": ["state"]},
        {"codecs": [{"name": "bytes", "configuration": {"endian": "little"}}, {"name": "zstd"}]},
        {"more": {"must_understand": False}},
    ],
    ids=str,
)
def test_metadata_that_are_not_those_of_the_request_are_refused(folder, change, monkeypatch):
    tell(folder / "data.zarr" / "t", change)
    monkeypatch.setattr(zarr.Array, "__getitem__", lambda *_: pytest.fail("data were read"))
    with pytest.raises(mechc.MechcError, match=r"zarr\.json is damaged"):
        mechc.open(folder)


def requested(folder, change, also=()):
    """Change what the request says, and what the inputs say likewise."""
    for name in ("request.json", *also):
        path = folder / "mechc" / name
        path.write_text(json.dumps(json.loads(path.read_text()) | change))


@pytest.mark.parametrize(
    ("change", "also"),
    [
        ({"chunk": 0}, ()),
        ({"chunk": 1e99}, ()),
        ({"chunk": True}, ()),
        ({"state": [["theta_0"]]}, ()),
        ({"mechanism": "\x1b[2Jgone"}, ()),
        ({"mechanism": ["four_bar"]}, ()),
        ({"options": [1]}, ()),
        ({"count": 2**40, "members": 2**40}, ("inputs.json",)),
        ({"outputs": ["__class__"]}, ("inputs.json",)),
        ({"reductions": ["max(__import__('os'))"]}, ("inputs.json",)),
        ({"until": ["theta_0"]}, ("inputs.json",)),
        ({"until": "theta_0 > 1"}, ()),
        ({"rtol": 1e-3}, ()),
    ],
    ids=str,
)
def test_a_request_that_no_call_makes_is_refused(folder, change, also):
    requested(folder, change, also)
    with pytest.raises(mechc.MechcError) as refused:
        mechc.open(folder)
    assert str(refused.value).isprintable()


@pytest.mark.parametrize("text", ["[" * 100_000, "{", "", "1" * 5000, '{"format": NaN}', "\udcff"])
@pytest.mark.parametrize("name", ["request.json", "inputs.json"])
def test_json_of_any_kind_is_refused_by_name(folder, name, text):
    (folder / "mechc" / name).write_bytes(text.encode("utf-8", "surrogateescape"))
    with pytest.raises(mechc.MechcError, match="batch"):
        mechc.open(folder)


def array_file(path, header):
    with zipfile.ZipFile(path, "w") as file:
        content = header.encode("latin-1")
        size = len(content).to_bytes(2, "little")
        file.writestr("t_eval.npy", b"\x93NUMPY\x01\x00" + size + content)


def test_inputs_that_are_compressed_huge_or_objects_are_refused(folder):
    path = folder / "mechc" / "inputs.npz"
    np.savez_compressed(path, t_eval=np.zeros(10_000_000))
    with pytest.raises(mechc.MechcError, match="compressed"):
        mechc.open(folder)
    np.savez(path, t_eval=np.array([{}], dtype=object))
    with pytest.raises(mechc.MechcError, match="no doubles"):
        mechc.open(folder)
    for shape in ("(1000000000000,)", "(-1,)", "(-1,-1)", "()"):
        array_file(path, f"{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}\n")
        with pytest.raises(mechc.MechcError, match="damaged"):
            mechc.open(folder)


def test_links_pipes_and_devices_are_no_data(folder, tmp_path):
    import os

    chunk = folder / "data.zarr" / "t" / "c" / "0"
    chunk.unlink()
    os.mkfifo(chunk)
    with pytest.raises(mechc.MechcError, match="not a file"):
        mechc.open(folder)
    chunk.unlink()
    chunk.symlink_to("/dev/zero")
    with pytest.raises(mechc.MechcError, match="a link"):
        mechc.open(folder)
    chunk.unlink()
    for name in ("request.json", "inputs.json", "inputs.npz", "chunk-000000000000.json"):
        path = folder / "mechc" / name
        path.rename(tmp_path / "aside")
        os.mkfifo(path)
        with pytest.raises(mechc.MechcError, match="damaged"):
            mechc.open(folder)
        path.unlink()
        (tmp_path / "aside").rename(path)


@pytest.mark.slow(cases=99)
@pytest.mark.parametrize(
    "name", [".mechc-lock", "data.zarr/y", "data.zarr/t/c/1", "mechc", "mechc/.request.json.1.part"]
)
def test_nothing_is_read_or_written_through_a_link(call, folder, tmp_path, name):
    """A call that resumed emptied the file that .mechc-lock was a link to."""
    place, outside = folder / name, tmp_path / "outside"
    if place.is_dir():
        place.rename(outside)
    else:
        place.unlink(missing_ok=True)
        outside.write_text("mine")
    before = {p: p.read_bytes() for p in (outside, *outside.rglob("*")) if p.is_file()}
    place.symlink_to(outside)
    for attempt in (lambda: mechc.open(folder), lambda: call(folder)):
        with pytest.raises(mechc.MechcError, match=f"{place.name} is a link"):
            attempt()
    assert {p: p.read_bytes() for p in (outside, *outside.rglob("*")) if p.is_file()} == before
    assert verified(folder).returncode == 2


def test_a_pipe_in_place_of_the_lock_keeps_nobody_waiting(call, folder):
    import os

    (folder / ".mechc-lock").unlink()
    os.mkfifo(folder / ".mechc-lock")
    have_the_same_arrays(call(folder), call())


def test_members_that_overlap_in_the_inputs_are_refused(folder):
    """A file of 3 MB whose directory names one member a hundred times took 300 MB."""
    path = folder / "mechc" / "inputs.npz"
    np.savez(path, t_eval=np.zeros(400_000))
    content = path.read_bytes()
    entries, end = content.index(b"PK\x01\x02"), content.index(b"PK\x05\x06")
    directory, told = content[entries:end], bytearray(content[end:])
    told[8:12] = (100).to_bytes(2, "little") * 2
    told[12:16] = (100 * len(directory)).to_bytes(4, "little")
    path.write_bytes(content[:entries] + 100 * directory + told)
    assert len(zipfile.ZipFile(path).namelist()) == 100
    with pytest.raises(mechc.MechcError, match="larger than the file"):
        mechc.open(folder)


def test_a_chunk_that_is_missing_takes_no_memory(folder):
    """Its manifest vouched for blanks of any size, which were made to be compared."""
    import shutil

    array = folder / "data.zarr" / "output_0"
    told = json.loads((array / "zarr.json").read_text())
    told["shape"][2:] = [10**6, 10**6]
    told["chunk_grid"]["configuration"]["chunk_shape"][2:] = [10**6, 10**6]
    (array / "zarr.json").write_text(json.dumps(told))
    shutil.rmtree(array / "c")
    found = verified(folder)
    assert (found.returncode, found.stderr) == (1, "")
    assert "output_0/c/0/0/0/0 is damaged: it is missing" in found.stdout


def test_a_request_without_a_mechanism_is_refused_by_name(folder):
    path = folder / "mechc" / "request.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | {"mechanism": None}))
    with pytest.raises(mechc.MechcError, match=f"{folder.name} .*does not name its mechanism"):
        mechc.open(folder)


def test_names_of_files_do_not_steer_the_terminal(folder, tmp_path):
    hostile = folder.rename(tmp_path / "a\x1b[2Jb")
    assert verified(hostile).stdout.strip() == f"{tmp_path}/a\\x1b[2Jb: 3 chunks, all sound"
    (hostile / "mechc" / "inputs.npz").write_bytes(b"PK")
    with pytest.raises(mechc.MechcError, match="damaged") as refused:
        mechc.open(hostile)
    assert str(refused.value).isprintable()
    other = tmp_path / "other"
    other.mkdir()
    (other / "x\x1b]0;y").touch()
    model = mechc.load("four_bar")
    with pytest.raises(mechc.MechcError, match="other files") as refused:
        model.simulate_batch(0.1, model.assemble({"theta_0": 1.4}), out=other)
    assert str(refused.value).isprintable()


# -- damaged ----------------------------------------------------------------------------------


def chunks_of(folder):
    return sorted(path for path in (folder / "data.zarr").glob("*/c/**/*") if path.is_file())


def test_every_deleted_chunk_is_noticed_and_computed_again(call, folder):
    held, files = call(), chunks_of(folder)
    assert len(files) > 30
    for path in files:
        content = path.read_bytes()
        path.unlink()
        with pytest.raises(mechc.MechcError, match="damaged"):
            mechc.open(folder)
        path.write_bytes(content)
    for path in files[::7]:
        path.unlink()
    have_the_same_arrays(held, call(folder))
    have_the_same_arrays(held, mechc.open(folder))


def test_every_flipped_bit_is_noticed_and_computed_again(call, folder):
    held, files = call(), chunks_of(folder)
    draw = np.random.default_rng(14)
    for path in files:
        content = path.read_bytes()
        place, bit = draw.integers(len(content) * 3 // CHUNK), draw.integers(8)  # of a member
        path.write_bytes(
            content[:place] + bytes([content[place] ^ 1 << bit]) + content[place + 1 :]
        )
        with pytest.raises(mechc.MechcError, match="damaged"):
            mechc.open(folder)
        if path is not files[-1]:
            path.write_bytes(content)
    have_the_same_arrays(held, call(folder))
    for path in files:
        path.write_bytes(path.read_bytes()[:-1])
        with pytest.raises(mechc.MechcError, match="damaged"):
            mechc.open(folder)
    have_the_same_arrays(held, call(folder))


@pytest.mark.parametrize("text", ["", "{}", "[]", '{"members": [0, 10], "sha256": {}}'])
def test_a_damaged_manifest_vouches_for_nothing(call, folder, text):
    held = call()
    (folder / "mechc" / "chunk-000000000010.json").write_text(text)
    with pytest.raises(mechc.MechcError, match="damaged"):
        mechc.open(folder)
    have_the_same_arrays(held, call(folder))
    have_the_same_arrays(held, mechc.open(folder))


def test_damaged_metadata_and_inputs_are_written_again(call, folder):
    held = call()
    (folder / "data.zarr" / "y" / "zarr.json").unlink()
    (folder / "data.zarr" / "status" / "zarr.json").write_text("{}")
    (folder / "data.zarr" / "zarr.json").unlink()
    (folder / "mechc" / "inputs.npz").write_bytes(b"PK")
    (folder / "mechc" / "inputs.json").write_text("")
    have_the_same_arrays(held, call(folder))
    have_the_same_arrays(held, mechc.open(folder))


def test_what_is_damaged_counts_as_not_run_until_it_is_computed(call, folder, monkeypatch):
    from mechc.batch import simulate

    (folder / "data.zarr" / "y" / "c" / "1" / "0").unlink()
    monkeypatch.setattr(
        simulate, "run_members", lambda *_: (_ for _ in ()).throw(KeyboardInterrupt)
    )
    with pytest.raises(mechc.RunInterrupt) as stopped:
        call(folder)
    cut = stopped.value.batch
    assert not cut.complete
    assert cut.counts == {"not run": 10, "finished": 13}


def test_data_are_on_the_disk_before_their_manifest_is_there(call, tmp_path, monkeypatch):
    import os

    from mechc.batch.stored import manifests

    synced, events, fsync = set(), [], os.fsync

    def note(descriptor):
        synced.add(os.readlink(f"/proc/self/fd/{descriptor}"))
        fsync(descriptor)

    monkeypatch.setattr(os, "fsync", note)
    write = manifests.write_text

    def check(path, text):
        events.append(path.name)
        for file in chunks_of(tmp_path / "batch"):
            above = [p for p in file.parents if tmp_path / "batch" / "data.zarr" in p.parents]
            assert {str(file), *map(str, above)} <= synced
        write(path, text)
        assert str(path.parent) in synced

    monkeypatch.setattr(manifests, "write_text", check)
    call(tmp_path / "batch", threads=CHUNK)  # whose lanes take a chunk as a whole
    assert events == [f"chunk-{first:012d}.json" for first in range(0, COUNT, CHUNK)]


def test_a_full_disk_is_told_with_the_folder_and_the_call_goes_on(call, tmp_path, monkeypatch):
    import errno

    from mechc.batch.stored import manifests

    full = OSError(errno.ENOSPC, "No space left on device")
    with monkeypatch.context() as patch:
        patch.setattr(manifests, "sync", failing(full))
        with pytest.raises(mechc.MechcError, match=r"batch: No space left.*resume"):
            call(tmp_path / "batch")
    have_the_same_arrays(call(), call(tmp_path / "batch"))


def verified(path):
    return subprocess.run(
        [sys.executable, "-m", "mechc", "verify", str(path)], capture_output=True, text=True
    )


@pytest.mark.slow
def test_mechc_verify_names_what_is_damaged(folder):
    told = verified(folder)
    assert (told.returncode, told.stdout.strip()) == (0, f"{folder}: 3 chunks, all sound")
    (folder / "mechc" / "chunk-000000000020.json").unlink()
    told = verified(folder)
    assert told.returncode == 1
    assert "1 not computed yet" in told.stdout
    (folder / "data.zarr" / "y" / "c" / "1" / "0").unlink()
    told = verified(folder)
    assert told.returncode == 1
    assert "members 10 to 19" in told.stdout
