"""Signals: samples that make one, and those that do not."""

import numpy as np
import pytest

import mechc


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (([0, 1], [1.0]), "one value for each time"),
        (([0, 0], [1.0, 1.0], "linear"), "strictly increase"),
        (([0, 1], [1.0, np.nan], "linear"), "must be finite"),
        (([0, np.inf], [1.0, 1.0], "linear"), "within 1e.300 s of 0"),
        (([-1e308, 0], [1.0, 1.0], "linear"), "within 1e.300 s of 0"),
        (([0, 1, 2], [1.0, 1.0, 0.0]), "needs 4 samples, not 3"),
        ((["a", "b"], [1.0, 1.0]), "'a' is not a number"),
        (([0, 1], [1.0, 1.0], "spline"), "no kind of signal is called 'spline'"),
    ],
)
def test_samples_that_make_no_signal_are_refused(arguments, told):
    with pytest.raises(mechc.MechcError, match=told):
        mechc.Signal(*arguments)


@pytest.mark.parametrize(
    ("times", "values", "kind"),
    [
        ([0, 1, 2, 3], [1e308, -1e308, 1e308, -1e308], "linear"),
        ([0, 1, 2, 3], [1e308, -1e308, 1e308, -1e308], "cubic"),
        ([0, 5e-324, 1e-323], [0, 1, 2], "linear"),
    ],
)
def test_samples_beyond_doubles_are_refused_in_words(times, values, kind):
    with pytest.raises(mechc.ValueOutOfBoundsError, match="within the range of doubles"):
        mechc.Signal(times, values, kind)


def test_a_signal_is_its_own_function_and_derivatives():
    times = np.linspace(0.0, 3.0, 40)
    signal = mechc.Signal(times, np.exp(times), "quintic")
    inner = np.linspace(0.5, 2.5, 77)
    for order, error in enumerate((1e-8, 1e-6, 1e-5, 1e-3)):
        np.testing.assert_allclose(signal(inner, order), np.exp(inner), rtol=error)
