"""The wait before the first motion is measured in a process of its own."""

import pytest

from benchmarks.costs.first import motion as first_motion


@pytest.mark.slow
def test_the_wait_has_the_derivation_and_the_parts_of_a_run_in_it(capsys):
    """Nothing is in the cache; the part for derivatives is compiled where there are any."""
    row = first_motion.measured("pendulum")
    assert 0.0 < row["derivation"] < row["processor"]
    methods = ["gauss8", "dop853", "radau5", "taylor", "gauss8_lockstep"]
    assert [*row["parts"]] == ["first unit", "driver", *methods, "outputs"]
    run = row["parts"]["first unit"] + row["parts"]["driver"] + row["parts"]["gauss8"]
    assert row["processor"] > 0.5 * run
    assert "derivation" in first_motion.line(row)
