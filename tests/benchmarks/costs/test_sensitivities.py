"""The table of run times with sensitivities."""

import pytest

from benchmarks.costs import sensitivities


def test_a_scene_has_a_row_for_every_method_and_tolerance(capsys: pytest.CaptureFixture[str]):
    assert sensitivities.main(["--rounds", "3", "--only", "pendulum"]) == 0
    head, *rows = capsys.readouterr().out.splitlines()
    assert head.split()[-1] == "ratio"
    assert len(rows) == 2 * len(sensitivities.RTOLS)
    assert all(float(row.split()[-1]) > 0.0 for row in rows)
