"""The default's time over the best method's, at the same error."""

import pytest

from benchmarks.suite import default
from mechc.simulation.settings import METHODS_OF_USERS


def _row(method, error, seconds):
    return {"tool": "mechc", "method": method, "error": error, "seconds": seconds, "label": "right"}


def test_the_default_is_compared_at_the_same_error():
    rows = [_row("auto", 1e-5, 3.0), _row("auto", 1e-13, 6.0), _row("taylor", 1e-5, 2.0)]
    found = default.ratios(rows)["mechc"]
    assert found["1e-04"] == {
        "ratio": 1.5,
        "best": "taylor",
        "seconds": {"auto": 3.0, "taylor": 2.0},
    }
    assert found["1e-12"]["ratio"] == 1.0  # where the other method is not as right


def test_an_error_that_only_another_method_reaches_is_infinitely_far():
    found = default.ratios([_row("auto", 1e-5, 1.0), _row("taylor", 1e-13, 2.0)])["mechc"]
    assert found["1e-12"]["ratio"] == float("inf")


@pytest.mark.thorough
def test_runs_and_batches_of_a_scene_are_measured(tmp_path, capsys, monkeypatch):
    monkeypatch.setenv("MECHC_BENCH_OUT", str(tmp_path))
    assert default.main(["--quick", "--scene", "rigid_body"]) in (0, 1)
    told = capsys.readouterr().out
    assert "rigid_body, mechc batch" in told
    assert any(method in told for method in METHODS_OF_USERS)
