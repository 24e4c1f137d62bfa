"""A mimic of a mimic is one mimic, by polynomials."""

import numpy as np
import pytest
from mechc_codegen.robots.robot import Mimic


def position(mimic, x):
    return np.polynomial.polynomial.polyval(x, mimic.coefficients)


@pytest.mark.parametrize(
    ("outer", "inner"),
    [
        (Mimic("b", -2, 0.5), Mimic("a", 3, 0.25)),
        (Mimic("b", 0.7, 0.1, (0.3, -0.2)), Mimic("a", -1.5, 0.2, (0.4,))),
        (Mimic("b", 0, 0.1, (0, 2)), Mimic("a", 0, 0.2)),
    ],
)
def test_a_mimic_of_a_mimic(outer, inner):
    whole = outer.of(inner)
    x = np.linspace(-1.0, 1.0, 7)
    assert whole.joint == "a"
    assert position(whole, x) == pytest.approx(position(outer, position(inner, x)), abs=1e-14)


def test_a_line_of_a_line_is_a_line():
    assert Mimic("b", -2, 0.5).of(Mimic("a", 3, 0.25)) == Mimic("a", -6, 0.0)
