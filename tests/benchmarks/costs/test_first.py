"""The wait before the first value, cold and cached, and before the first motion."""

import pytest

from benchmarks.costs import first


@pytest.mark.thorough
def test_the_first_value_is_measured_in_processes_of_their_own():
    """Cold there is something to derive and compile, cached nothing; the values are the same."""
    row = first.measured("by hand", 1)
    assert {"derive", "emit", "first unit"} <= set(row["cold"])
    assert set(row["cached"]) == {"import mechc", "read", "load", "first value", "processor"}
    assert row["cached"]["processor"] < 0.3 * row["cold"]["processor"]
    assert row["largest difference"] < 1e-12


@pytest.mark.thorough
def test_the_wait_has_the_derivation_and_the_parts_of_a_run_in_it(capsys):
    """Nothing is in the cache; the part for derivatives is compiled where there are any."""
    row = first.first_motion("pendulum")
    methods = ["collocation", "explicit", "implicit", "taylor", "taylor_lanes", "sweeps"]
    stages = row["stages"]
    assert [*stages] == ["derivation", "first unit", "driver", *methods, "outputs"]
    assert all(0.0 < processor < 3.0 * clock for clock, processor in stages.values())
    run = sum(stages[each][1] for each in ("derivation", "driver", "collocation"))
    assert 0.3 * stages["derivation"][1] < row["processor"] < 3.0 * run
    assert all(1.0 < row["by_tape"][method] < 20.0 for method in first.METHODS)
    assert row["batch"] > row["wait"]
    assert "derivation" in first.line(row)
