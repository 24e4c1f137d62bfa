"""Instructions by callgrind: the same number every time."""

import shutil

import pytest

from benchmarks.costs import instructions


def test_the_difference_of_two_counts_leaves_what_is_around_the_calls_out():
    found = instructions.differences({"rhs|10": 1070, "rhs|20": 1140, "x|1": 3, "x|2": 9})
    assert found == {"rhs": 7, "x": 6}


@pytest.mark.thorough
def test_a_state_in_lanes_takes_fewer_instructions_than_one_alone():
    """Counted in a process of its own; the time that either takes does not come into it."""
    if shutil.which("valgrind") is None:
        pytest.skip("valgrind is not installed")
    try:
        told = instructions.counted(("four_bar, baseline: rhs",))
    except instructions.NotCountedError as error:
        pytest.skip(str(error))
    by_name = {entry["what"]: entry["value"] for entry in told}
    one = by_name["four_bar, baseline: rhs, one state"]
    lanes = by_name["four_bar, baseline: rhs, 2 lanes, a state"]
    assert 0 < lanes < one < 5000
