"""Sliders of a mechanism's page are those asked for, or the usual ones."""

import pytest

from mechc import UnknownNameError, ValueOutOfBoundsError
from mechc.results.web.sliders import chosen_sliders


def named(*names):
    return [{"name": name} for name in names]


ABOUT = {
    "coordinates": named("x", "y"),
    "speeds": named("v", "w"),
    "parameters": named("m", "I", *(f"l_{i}" for i in range(12))),
    "inputs": ["F"],
    "follows": [1],
}


def test_parameters_that_follow_have_none_by_default():
    ranges, held = chosen_sliders(ABOUT, {"y": 0.5}, None)
    assert [*ranges] == ["m", *(f"l_{i}" for i in range(7)), "y"]
    assert held == ["y"]


def test_ranges_are_taken_and_starts_are_held():
    ranges, held = chosen_sliders(ABOUT, {"y": 0.5, "w": 0.0}, {"F": (-1, 1), "x": (0, 2)})
    assert ranges == {"F": (-1, 1), "x": (0, 2)}
    assert held == ["x", "y", "w"]


def test_what_is_no_slider_is_refused():
    with pytest.raises(UnknownNameError, match="nothing"):
        chosen_sliders(ABOUT, {}, ["nothing"])
    for bad in ((1.0, 1.0), (2.0, 1.0), (0.0, float("nan")), (0.0, float("inf"))):
        with pytest.raises(ValueOutOfBoundsError, match="range of x"):
            chosen_sliders(ABOUT, {}, {"x": bad})
