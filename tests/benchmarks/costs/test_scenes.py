"""Compiled scenes beside the same in NumPy."""

import pytest

from benchmarks.costs import scenes


@pytest.mark.slow
def test_a_scene_of_the_table_is_measured_in_c_and_in_numpy():
    case = next(case for case in scenes.CASES if case.name == "open chain of 3")
    row = scenes.measured(case)
    assert 0 < row["ns a call"] < 1e3 * row["numpy us"]
    assert row["binary bytes"] > row["C bytes"] > 1000
