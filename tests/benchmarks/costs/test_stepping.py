"""The latency of steps is measured for every scene and method."""

import json

import pytest

from benchmarks.costs import stepping


@pytest.mark.slow
def test_every_step_is_in_the_histogram(tmp_path, capsys):
    stepping.main(["--steps", "40", "--out", str(tmp_path / "stepper.json")])
    rows = json.loads((tmp_path / "stepper.json").read_text("utf-8"))
    assert len(rows) == 12
    assert {sum(row["histogram"]) for row in rows} == {40}
    for row in rows:
        values = list(row["us"].values())
        assert 0 < values[0] <= values[-1]
        assert ("beside" in row) == (row["scene"] != "four_bar")
    assert capsys.readouterr().out.count("beside the integration") == 8
