"""The extrapolated midpoint rule gives thirty digits."""

import mpmath
from mpmath import mpf

from benchmarks.references import extrapolation


def test_the_extrapolated_midpoint_rule_gives_thirty_digits():
    """x'' = -6 x^2 + 4 x, solved by x = sech(t)^2."""
    rates = lambda y: [y[1], 4 * y[0] - 6 * y[0] ** 2]  # noqa: E731
    rows = extrapolation.by_extrapolation(rates, [mpf(1), mpf(0)], (0.5, 1.0), "0.3")
    for t, (x, v) in zip((0.5, 1.0), rows, strict=True):
        assert abs(x - mpmath.sech(t) ** 2) < mpf(10) ** -32
        assert abs(v + 2 * mpmath.sech(t) ** 2 * mpmath.tanh(t)) < mpf(10) ** -32


def test_a_step_that_is_too_long_is_taken_in_halves():
    y = extrapolation.extrapolated(lambda y: [40 * y[0]], [mpf(1)], mpf(1), most=12)
    assert abs(y[0] / mpmath.exp(40) - 1) < mpf(10) ** -30
