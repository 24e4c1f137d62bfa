"""The judge of the stress suite has teeth."""

import numpy as np
import pytest

from benchmarks.stability import judge


def test_a_wrong_end_is_called_wrong_and_a_right_one_right(regular):
    exact = regular.y[-1]
    assert judge.verdict("", regular, exact, 1e-9)["word"] == "right"
    wrong = judge.verdict("", regular, exact + 2e-9, 1e-9)
    assert wrong["word"] == "WRONG"
    assert wrong["excess"] == pytest.approx(2.0)


def test_an_end_that_is_not_a_number_is_wrong():
    assert judge.measured("", np.array([np.nan]), np.zeros(1), 1.0)["word"] == "WRONG"


def test_what_ended_early_is_flagged_and_what_was_not_begun_is_refused(regular):
    model = regular.model
    cut = judge.attempt(model, 1.0, regular.y[0], {"l_3": 3.5}, max_steps=2)
    assert judge.verdict("", cut, regular.y[-1], 1e-9)["word"] == "flagged"
    refused = judge.attempt(model, 1.0, regular.y[0], {"l_3": -1.0})
    assert judge.verdict("", refused, regular.y[-1], 1e-9)["word"] == "refused"
    with pytest.raises(TypeError):
        judge.attempt(model, 1.0, regular.y[0], tolerance=1.0)  # a defect of the suite, not a word


def test_no_limit_is_so_wide_that_any_motion_meets_it():
    assert judge.limit_of(1e-9, 10.0, 0.0) == pytest.approx(1e-6)
    assert judge.limit_of(0.1, 1e6) == judge.LARGEST < 0.5
