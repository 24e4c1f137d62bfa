"""What the product costs: rows with limits that bite, operations, what was skipped."""

import json

import pytest

from benchmarks.costs import costs, instructions


def test_a_limit_is_missed_beyond_noise_alone():
    row = costs.Figure("import", 0.16, "s", limit=0.15)
    assert (row.kept, row.missed) == (False, False)
    assert costs.Figure("import", 0.2, "s", limit=0.15).missed
    assert costs.Figure("import", 9.0, "s").record()["kept"] is None


def test_without_valgrind_the_instructions_are_left_out_by_name(monkeypatch):
    monkeypatch.setattr(instructions.shutil, "which", lambda _: None)
    skipped = {}
    assert costs._instructions(skipped) == []
    assert "valgrind" in skipped["instructions"]


def test_operations_are_counted_once_for_every_mechanism(monkeypatch):
    monkeypatch.setattr(costs, "COUNTED", {"four_bar": costs.COUNTED["four_bar"]})
    told = {entry["what"]: entry["value"] for entry in costs.operations()}
    assert told["four_bar: one right-hand side"] < told["four_bar: all outputs"]
    assert told["four_bar: C of the program"] > 1000


@pytest.mark.thorough
def test_all_is_written_with_limits_and_what_was_skipped(monkeypatch, capsys, out):
    """Without what compiles or counts for long: rows, sizes, JSON, the exit code."""
    for name, value in {"BUILT": {}, "COUNTED": {}, "RUNS": 1, "_instructions": _nothing}.items():
        monkeypatch.setattr(costs, name, value)
    code = costs.main(["--quick"])
    printed = capsys.readouterr().out
    written = json.loads((out / "costs.json").read_text())
    limited = {row["what"]: row for row in written["rows"] if row["limit"]}
    assert {row["unit"] for row in written["rows"]} >= {"s", "us", "ns", "bytes", "files"}
    assert limited["import mechc beyond numpy"]["limit"] == 0.15
    assert code == int("MISSED:" in printed)
    assert written["install"]["installed"]["files"] > 100
    assert written["skipped"] == {"instructions": "nothing to count"}


def _nothing(skipped):
    skipped["instructions"] = "nothing to count"
    return []
