"""Times to report at: what is plainly inside is taken as it is, the rest with care, alike."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mechc.errors import ValueOutOfBoundsError
from mechc.simulation.settings import _plainly_inside, _snapped, checked_times

SPAN = (-0.25, 3.0)
SLACK = 8 * math.ulp(3.0)
ENDS = [end + k * math.ulp(3.0) for end in SPAN for k in (-9, -8, -1, 0, 1, 8, 9)]
TIMES = st.lists(st.one_of(st.sampled_from(ENDS), st.floats(-0.3, 3.1)), max_size=5)


@given(TIMES, st.booleans())
def test_what_is_plainly_inside_the_careful_way_leaves_as_it_is(times, sort):
    array = np.array(sorted(times) if sort else times)
    if _plainly_inside(array, SPAN, SLACK):
        assert np.array_equal(_snapped(array, SPAN, SLACK), array)


@pytest.mark.parametrize("span", [SPAN, SPAN[::-1], (1.0, 1.0), (0.0, 0.0)])
def test_the_ends_are_within_the_span_in_its_direction(span):
    times = list(dict.fromkeys(span))
    assert checked_times(times, span).tolist() == times


def test_an_end_that_is_off_by_rounding_becomes_the_end():
    times = checked_times([-0.25 - 3e-17, 1.0, 3.0 + 4e-16], SPAN)
    assert times.tolist() == [-0.25, 1.0, 3.0]


@pytest.mark.parametrize("times", [[math.nan], [0.0, math.nan, 1.0], [-0.3], [3.1], [[1.0]], 1.0])
def test_times_beyond_the_span_are_refused(times):
    with pytest.raises(ValueOutOfBoundsError, match="within the span"):
        checked_times(times, SPAN)


@pytest.mark.parametrize("times", [[1.0, 1.0], [2.0, 1.0], [3.0 - SLACK / 2, 3.0]])
def test_times_that_do_not_advance_are_refused(times):
    with pytest.raises(ValueOutOfBoundsError, match="strictly"):
        checked_times(times, SPAN)
