"""Compiled scenes, with and without parameters fixed."""

import pytest

from benchmarks.costs import scenes


@pytest.mark.thorough
def test_a_scene_of_the_table_is_measured():
    case = next(case for case in scenes.CASES if case.name == "open chain of 3")
    row = scenes.measured(case)
    assert 0 < row["rhs ops"] <= row["all ops"]
    assert 0 < row["ns a call"] < 1e5
    assert row["binary bytes"] > row["C bytes"] > 1000
