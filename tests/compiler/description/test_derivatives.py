"""Derivatives of shared subexpressions are those of SymPy, as it writes them."""

import pytest
from mechc_codegen.description.derivatives import Derivatives
from sympy import Abs, Function, Symbol, cos, exp, sin, sqrt, symbols
from sympy.physics.mechanics import dynamicsymbols

x, y, m = *dynamicsymbols("x y"), Symbol("m")
LOOP = m * (sin(x) * cos(y) - 2 * cos(x) * (sin(y) + x)) ** 2 * sqrt(1 + x * y)
EXPRESSIONS = [
    x, m, LOOP, LOOP * sin(LOOP) + 3 * LOOP, x * y * m * cos(x * y) * exp(-x), x**2 / y - y / x,
    1.5 * x * (x + 0.25) * (y - 2) * Function("f")(x),
]  # fmt: skip


@pytest.mark.parametrize("expression", EXPRESSIONS)
def test_derivatives_are_those_of_sympy(expression):
    known = Derivatives()
    assert [known.of(expression, by) for by in (x, y, x)] == [
        expression.diff(by) for by in (x, y, x)
    ]
    plain = expression.xreplace(dict(zip((x, y), symbols("q0 q1"), strict=True)))
    for by in (*symbols("q0 q1"), m):
        assert known.of(plain, by) == plain.diff(by)


def test_the_derivative_of_a_signed_power_exists_where_those_of_its_factors_do_not():
    q, p = symbols("q p", real=True)
    known = Derivatives()
    assert known.of(q * sqrt(Abs(q)), q) == 3 * sqrt(Abs(q)) / 2
    assert known.of(p * q * sqrt(Abs(p * q)), q).subs({q: 0, p: -2}) == 0
    assert known.of(m * q**2 * Abs(q) ** p - q, q).subs({q: 0, p: 0.1}) == -1
