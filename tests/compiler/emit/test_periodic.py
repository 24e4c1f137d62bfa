"""Coordinates of which a whole turn changes nothing."""

from math import tan

import pytest
from mechc_codegen.emit.periodic import _sum_of
from sympy import Integer, Rational, Symbol, sin
from sympy.physics.mechanics import dynamicsymbols

import mechc

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


def test_what_runs_evaluate_beside_the_motion_keeps_whole_turns():
    """A rate of a state, or of a coordinate, that contains an angle which is only in a sine of the
    motion (times a parameter that is zero here): q = u t and x = u t^2 / 2; q = 2 tan(u t / 2)."""
    q, u, x, k = *dynamicsymbols("q u x"), Symbol("k")
    integral = mechc.from_equations([q], [u], None, [k * sin(q)], states={x: q})
    sol = mechc.compile(integral).simulate((0, 30), {"q": 0, "u": 4}, {k: 0}, rtol=1e-10)
    assert sol["x"][-1] == pytest.approx(4 * 30**2 / 2, rel=1e-8)
    curved = mechc.from_equations([q], [u], None, [k * sin(q)], kinematics={q: u * (1 + q**2 / 4)})
    sol = mechc.compile(curved).simulate((0, 3.1), {"q": 0, "u": 1}, {k: 0}, rtol=1e-10)
    assert sol["q"][-1] == pytest.approx(2 * tan(3.1 / 2), rel=1e-6)
