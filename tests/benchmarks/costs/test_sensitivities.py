"""The table of run times with sensitivities."""

import pytest

from benchmarks.costs import sensitivities


@pytest.mark.slow
def test_a_scene_has_a_row_for_every_method_and_tolerance(capsys: pytest.CaptureFixture[str]):
    assert sensitivities.main(["--rounds", "3", "--only", "pendulum"]) == 0
    head, *rows = capsys.readouterr().out.splitlines()
    assert head.split()[-1] == "ratio"
    assert len(rows) == 2 * len(sensitivities.RTOLS)
    assert all(float(row.split()[-1]) > 0.0 for row in rows)


@pytest.mark.thorough
def test_the_chain_has_rows_of_its_gradient(capsys: pytest.CaptureFixture[str], monkeypatch):
    monkeypatch.setattr(sensitivities, "LINKS", 2)
    assert sensitivities.main(["--rounds", "2", "--only", "chain"]) == 0
    _, *rows = capsys.readouterr().out.splitlines()
    assert [row.split()[4] for row in rows] == ["10"] * 2 * len(sensitivities.RTOLS)
    assert all(float(row.split()[-1]) > 0.0 for row in rows)
