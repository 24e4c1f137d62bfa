"""What the product costs: counts that do not vary, sizes of what is installed, limits that bite."""

import json
import shutil

import pytest


def test_a_limit_is_missed_beyond_noise_alone(module):
    costs = module("costs")
    row = costs.Row("import", 0.16, "s", limit=0.15)
    assert (row.kept, row.missed) == (False, False)
    assert costs.Row("import", 0.2, "s", limit=0.15).missed
    assert costs.Row("import", 9.0, "s").record()["kept"] is None


def test_the_difference_of_two_counts_leaves_what_is_around_the_calls_out(module):
    found = module("_instructions").differences(
        {"rhs|10": 1070, "rhs|20": 1140, "x|1": 3, "x|2": 9}
    )
    assert found == {"rhs": 7, "x": 6}


def test_a_state_in_lanes_takes_fewer_instructions_than_one_alone(module):
    """Counted in a process of its own; the time that either takes does not come into it."""
    if shutil.which("valgrind") is None:
        pytest.skip("valgrind is not installed")
    run = module("_instructions")
    try:
        told = run.counted(("four_bar, baseline: rhs",))
    except run.NotCountedError as error:
        pytest.skip(str(error))
    by_name = {entry["what"]: entry["value"] for entry in told}
    one = by_name["four_bar, baseline: rhs, one state"]
    lanes = by_name["four_bar, baseline: rhs, 2 lanes, a state"]
    assert 0 < lanes < one < 5000


def test_without_valgrind_the_instructions_are_left_out_by_name(module, monkeypatch):
    run, costs = module("_instructions"), module("costs")
    monkeypatch.setattr(run.shutil, "which", lambda _: None)
    skipped = {}
    assert costs._instructions(skipped) == []
    assert "valgrind" in skipped["instructions"]


def test_what_is_installed_is_counted_whole_and_by_part(module):
    install = module("_install")
    found = install.installed()
    assert found["bytes"] == sum(found["parts"].values())
    assert {"compiler", "runtime, Python", "mechanisms, compiled"} <= set(found["parts"])
    assert 0 < found["packed"] < found["bytes"]
    assert found["files"] > 100


def test_memory_is_that_of_the_process_asked(module):
    """A hundred megabytes of this process are not counted to the one that it starts."""
    processes = module("_processes")
    held = bytearray(10**8)
    held[::4096] = b"x" * len(held[::4096])
    small = processes.said("print(json.dumps(peak()))")
    large = processes.said("x = b'x' * 50_000_000; print(json.dumps(peak()))")
    assert 4e7 < large - small < 7e7
    assert small < 5e7


def test_operations_are_counted_once_for_every_mechanism(module, monkeypatch):
    costs = module("costs")
    monkeypatch.setattr(costs, "COUNTED", {"four_bar": costs.COUNTED["four_bar"]})
    told = {entry["what"]: entry["value"] for entry in costs.operations()}
    assert told["four_bar: one right-hand side"] < told["four_bar: all outputs"]
    assert told["four_bar: C of the program"] > 1000


def test_the_parts_of_a_call_are_less_than_the_call(module, monkeypatch):
    call = module("_call")
    monkeypatch.setattr(call, "ROUNDS", 5)
    parts = call.parts()
    assert all(value > 0 for value in parts.values())
    assert set(call.parts()) == set(parts)


def test_all_is_written_with_limits_and_what_was_skipped(module, monkeypatch, capsys):
    """Without what compiles or counts for long: rows, sizes, JSON, the exit code."""
    costs = module("costs")
    for name, value in {"BUILT": {}, "COUNTED": {}, "RUNS": 1, "_instructions": _nothing}.items():
        monkeypatch.setattr(costs, name, value)
    code = costs.main(["--quick"])
    printed = capsys.readouterr().out
    written = json.loads((module("_results").OUT / "costs.json").read_text())
    limited = {row["what"]: row for row in written["rows"] if row["limit"]}
    assert limited["import mechc beyond numpy"]["limit"] == 0.15
    assert code == int("MISSED:" in printed)
    assert written["install"]["installed"]["files"] > 100
    assert written["skipped"] == {"instructions": "nothing to count"}


def _nothing(skipped):
    skipped["instructions"] = "nothing to count"
    return []
