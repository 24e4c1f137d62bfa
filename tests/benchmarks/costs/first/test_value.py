"""From a description to the first value, cold and cached."""

import pytest

from benchmarks.costs.first import value as first_value


@pytest.mark.slow
def test_the_first_value_is_measured_in_processes_of_their_own():
    """Cold there is something to derive and compile, cached nothing; the values are the same."""
    row = first_value.measured("by hand", 1)
    assert {"derive", "emit", "first unit"} <= set(row["cold"])
    assert set(row["cached"]) == {"import mechc", "read", "load", "first value", "processor"}
    assert row["cached"]["processor"] < 0.3 * row["cold"]["processor"]
    assert row["largest difference"] < 1e-12
