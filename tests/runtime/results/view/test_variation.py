"""Promises of variations: each value goes where it belongs, and what cannot be is refused."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
import sympy

import mechc
from mechc.errors import UnknownNameError, ValueOutOfBoundsError
from mechc.results.view.variation import variation

START = {"theta_0": 1.5}


@pytest.fixture(scope="module")
def model() -> mechc.Model:
    return mechc.load("four_bar")


def test_values_are_those_of_simulate(model: mechc.Model) -> None:
    sliders = {sympy.Symbol("l_3"): (3.2, 3.9), "theta_0": (1.2, 2.0), "omega_0": (-1, 1)}
    made = variation(model, 1.0, START, {"l_3": 3.5, "m_1": 5.0}, sliders, {"rtol": 1e-6})
    assert made.values == {"l_3": 3.5, "theta_0": 1.5, "omega_0": 0.0}
    sol = made.simulate({"l_3": 3.7, "omega_0": 0.5})
    same = model.simulate(1.0, {**START, "omega_0": 0.5}, {"l_3": 3.7, "m_1": 5.0}, rtol=1e-6)
    np.testing.assert_array_equal(sol.y, same.y)


def test_arrays_have_one_value_replaced_and_stay_as_they_are(model: mechc.Model) -> None:
    params = model.simulate(0.0, START).params
    before = params.copy()
    made = variation(model, 0.5, START, params, {"m_1": (1.0, 9.0)}, {})
    assert made.simulate({"m_1": 4.0}).params[model.parameters.index("m_1")] == 4.0
    np.testing.assert_array_equal(params, before)


def test_angles_are_shown_in_degrees(model: mechc.Model) -> None:
    slider, *_ = variation(model, 1.0, START, None, {"theta_0": (1.2, 2.0)}, {}).sliders()
    assert (slider["low"], slider["high"], slider["unit"]) == (1.2, 2.0, "°")
    assert slider["factor"] == pytest.approx(180 / math.pi)


@pytest.mark.parametrize(
    ("sliders", "error", "words"),
    [
        ({"l_9": (1, 2)}, UnknownNameError, "l_9"),
        ({"l_3": (2, 1)}, ValueOutOfBoundsError, "lowest, highest"),
        ({"l_3": 2}, ValueOutOfBoundsError, "lowest, highest"),
        ({"l_3": (0, math.inf)}, ValueOutOfBoundsError, "lowest, highest"),
        (["l_3"], TypeError, "by name"),
        ({"l_3": (1, 2)}, ValueOutOfBoundsError, "at first"),
    ],
)
def test_what_cannot_be_is_refused(
    model: mechc.Model, sliders: Any, error: type[Exception], words: str
) -> None:
    with pytest.raises(error, match=words):
        _ = variation(model, 0.1, START, None, sliders, {}).values
