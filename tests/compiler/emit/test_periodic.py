"""Coordinates of which a whole turn changes nothing."""

import pytest
from mechc_codegen.emit.periodic import _sum_of
from sympy import Integer, Rational, Symbol

a, b, s, p = map(Symbol, ("a", "b", "s", "p"))
SUMS = {a: {a: 1}, b: {b: 1}, s: {a: 1, b: -2}}


@pytest.mark.parametrize(
    ("value", "found"),
    [
        (a, {a: 1}),
        (a - 3 * s, {a: -2, b: 6}),
        (p + Integer(2) * b, {b: 2}),
        (p, {}),
        (a / 2, None),
        (Rational(3, 2) * s, None),
        (p * a, None),
        (a * b, None),
        (a**2, None),
    ],
)
def test_sums_of_whole_multiples_are_recognised(value, found):
    assert _sum_of(value, SUMS) == found
