"""Saved solutions from strangers and from bad disks: bounded, plain text, never half a file."""

import json
import resource
import struct
import subprocess
import sys
import time

import numpy as np
import pytest

import mechc
from mechc import files as durable
from mechc.results import files as storage
from mechc.results.untrusted import printable


def resealed(data, path, **change):
    """The file that somebody would make who knows how mechc seals its own."""
    data.attrs["mechc"] = json.dumps(json.loads(data.attrs["mechc"]) | change)
    data.attrs["sha256"] = storage.digest(data)
    data.to_netcdf(path, engine="scipy")
    return path


@pytest.fixture
def saved(sol, tmp_path):
    return sol.save(tmp_path / "run.nc")


def test_every_flipped_byte_of_the_data_is_noticed(saved):
    content = saved.read_bytes()
    begin = len(content) // 2  # the numbers, after names and attributes
    draw = np.random.default_rng(14)
    for place in draw.integers(begin, len(content), 40):
        changed = bytes([content[place] ^ 1 << draw.integers(8)])
        saved.write_bytes(content[:place] + changed + content[place + 1 :])
        with pytest.raises(mechc.MechcError, match=r"run\.nc.*damaged"):
            mechc.open(saved)
    saved.write_bytes(content)
    mechc.open(saved)


def test_a_truncated_file_is_refused_by_name_whatever_its_length(saved):
    content = saved.read_bytes()
    for length in {*range(0, 400, 7), *range(400, len(content), len(content) // 60)}:
        saved.write_bytes(content[:length])
        with pytest.raises(mechc.MechcError, match=r"run\.nc"):
            mechc.open(saved)


@pytest.mark.slow
def test_mechc_verify_tells_a_sound_file_from_a_damaged_one(saved):
    def verified():
        command = [sys.executable, "-m", "mechc", "verify", str(saved)]
        return subprocess.run(command, capture_output=True, text=True)

    assert (verified().returncode, verified().stdout.strip()) == (0, f"{saved}: undamaged")
    content = saved.read_bytes()
    saved.write_bytes(content[:-8] + bytes([content[-8] ^ 1]) + content[-7:])
    assert verified().returncode == 2
    assert "sha256" in verified().stderr
    saved.unlink()
    assert verified().returncode == 2


def test_a_span_beyond_what_was_saved_costs_neither_time_nor_memory(sol, tmp_path):
    """7 kB that asked for 10^9 s took 170 MB more every second."""
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    for steps in (3, 10**12):
        path = resealed(sol.to_xarray(), tmp_path / "long.nc", span=[0.0, 1e9], steps=steps)
        started = time.perf_counter()
        with pytest.raises(mechc.MechcError, match="steps; read the file with xarray"):
            mechc.open(path, max_bytes=2**26)
        assert time.perf_counter() - started < 20
    grown = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
    assert grown < 200 * 1024  # kB


def test_what_a_file_may_have_derived_is_bounded(sol, tmp_path):
    """Options of a file started the derivation of 200 links."""
    for options in (
        {"links": 200},
        {"links": 1e9},
        {"crank_torque": "t" * 201},
        {"crank_torque": ["t"]},
        {"fix": {"l_0": "import"}},
        {"outputs": [1]},
        {"name": {}},
    ):
        path = resealed(
            sol.to_xarray(), tmp_path / "deep.nc", mechanism="pendulum", options=options
        )
        started = time.perf_counter()
        with pytest.raises(mechc.MechcError, match=r"deep\.nc"):
            mechc.open(path)
        assert time.perf_counter() - started < 5


def overlapping(variables, length):
    """A file of NetCDF 3 whose variables of doubles are all in one place."""

    def words(*numbers):
        return struct.pack(f">{len(numbers)}i", *numbers)

    names = [f"v{k:07d}".encode() for k in range(variables)]
    head = b"CDF\x01" + words(0, 10, 1, 1) + b"t\0\0\0" + words(length, 0, 0, 11, variables)
    begin = len(head) + variables * 40
    each = (words(8) + name + words(1, 0, 0, 0, 6, 8 * length, begin) for name in names)
    return head + b"".join(each) + bytes(8 * length)


def test_parts_that_overlap_take_no_more_memory_than_the_file(tmp_path):
    """A file of 0.6 MB took 4 GB: each of its variables was all of the file."""
    path = tmp_path / "overlap.nc"
    for variables, words in ((1, "'mechc'"), (2_000, "its parts overlap")):
        path.write_bytes(overlapping(variables, 50_000))
        before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        with pytest.raises(mechc.MechcError, match=rf"overlap\.nc.*{words}"):
            mechc.open(path)
        grown = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
        assert grown < 100 * 1024  # kB


def test_a_sound_file_opens_where_address_space_is_limited(saved):
    """Room of 8 GB was asked for, whatever the size of the file."""
    program = (
        "import resource, sys, mechc; mechc.load('four_bar'); import xarray, scipy.io; "
        "used = int(open('/proc/self/statm').read().split()[0]) * resource.getpagesize(); "
        "resource.setrlimit(resource.RLIMIT_AS, (used + 2**30, -1)); "
        "print(mechc.open(sys.argv[1]).status.code)"
    )
    command = [sys.executable, "-c", program, str(saved)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.stdout.strip() == "finished", done.stderr


ESCAPES = "\x1b]0;title\x07\x1b[2J\r\u202e\u0085"


def test_a_message_does_not_repeat_a_long_text_of_a_file(sol, tmp_path):
    path = resealed(sol.to_xarray(), tmp_path / "long.nc", format="x" * 10**6)
    for read in (mechc.open, storage.verify):
        with pytest.raises(mechc.MechcError, match=r"long\.nc.*its format is x") as refused:
            read(path)
        assert len(str(refused.value)) < 2000


def test_texts_of_a_file_do_not_steer_the_terminal(sol, tmp_path):
    told = json.loads(sol.to_xarray().attrs["mechc"])["status"]
    change = {"warnings": [f"all well{ESCAPES}"], "cause": ESCAPES, "advice": ESCAPES}
    path = resealed(sol.to_xarray(), tmp_path / "run.nc", status=told | change)
    again = mechc.open(path)
    assert str(again.status).isprintable()
    assert "all well" in str(again.status)
    for change in (
        {"status": told | {"code": f"finished{ESCAPES}"}},
        {"mechanism": ESCAPES},
        {"state": [ESCAPES] * 6},
        {"format": ESCAPES},
        {"custom": True, "mechanism": ESCAPES, "compiled": ESCAPES},
        {"options": {ESCAPES: 1}},
        {"options": {"crank_torque": ESCAPES}},
    ):
        path = resealed(sol.to_xarray(), tmp_path / "run.nc", **change)
        with pytest.raises(mechc.MechcError) as refused:
            mechc.open(path)
        assert str(refused.value).isprintable(), change


def test_printable_keeps_letters_of_every_script():
    assert printable("Gelenk 1: θ̈ = 名前") == "Gelenk 1: θ̈ = 名前"
    assert printable("a\tb\n\x1b[0m\u202e") == "a\\tb\\n\\x1b[0m\\u202e"


def test_a_disk_that_fills_leaves_the_file_that_was_there(sol, saved, monkeypatch):
    held = saved.read_bytes()
    monkeypatch.setattr(
        durable, "sync", lambda _: (_ for _ in ()).throw(OSError(28, "No space left"))
    )
    for path in (saved, saved.with_suffix(".csv")):
        with pytest.raises(mechc.MechcError, match=rf"{path.name}: No space left"):
            sol.save(path)
    assert saved.read_bytes() == held
    assert [path.name for path in saved.parent.iterdir()] == ["run.nc"]


KILLED = """
import os, signal, sys
from pathlib import Path
from mechc.files import replacing
with replacing(Path(sys.argv[1])) as part:
    part.write_text("half")
    print("begun", flush=True)
    sys.stdin.read() or os.kill(os.getpid(), signal.SIGKILL)
"""


def test_what_a_killed_process_left_is_removed_by_the_next(sol, tmp_path):
    """A file that is being written by another process stays, and those of other names."""
    path, other = tmp_path / "run[1].nc", tmp_path / f".else.nc.{'0' * 16}.part"
    other.write_text("half of another")
    command = [sys.executable, "-c", KILLED, str(path)]
    subprocess.run(command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
    (left,) = tmp_path.glob(".run*.part")
    running = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    try:
        assert running.stdout.readline() == b"begun\n"
        assert not left.exists()
        (written,) = tmp_path.glob(".run*.part")
        sol.save(path)
        assert {*tmp_path.iterdir()} == {path, other, written}
    finally:
        running.communicate(b"go on")
    assert running.returncode == 0
    assert {*tmp_path.iterdir()} == {path, other}


def test_a_folder_that_is_not_there_is_named(sol, tmp_path):
    with pytest.raises(mechc.MechcError, match="nowhere"):
        sol.save(tmp_path / "nowhere" / "run.nc")


@pytest.mark.parametrize(
    "text", ["=1+1", "\n=1+1", "a\n=1+1", " =1", "＝1", "＋1", "－1", "＠x", "\ufeff=1"]
)
def test_no_cell_of_a_table_is_a_formula(text):
    cell = storage._csv_text(text)
    assert "\n" not in cell
    assert cell.startswith("'") or not storage._FORMULA.match(cell)
    assert cell.startswith("'") or text.startswith("a")
