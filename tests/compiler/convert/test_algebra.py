"""Derivatives by a step along the imaginary axis, against SymPy's."""

import pytest
from mechc_codegen.convert.algebra import evaluator
from mechc_codegen.convert.classify_constraints import Rates, nonholonomic
from sympy import Abs, EulerGamma, Max, Piecewise, atan2, exp, gamma, sign, sin, sqrt, symbols
from sympy.physics.mechanics import dynamicsymbols

x, y = symbols("x y", real=True)


@pytest.mark.parametrize(
    "expression",
    [
        sqrt(x**2 + y**2) - 0.02,
        sin(x) / y + exp(x * y),
        atan2(y, x) + Abs(x - y) * sign(y - 2 * x),
        sin(Max(x, 2 * y) / x),
        Piecewise((x**2, x < y), (y, True)),
    ],
)
@pytest.mark.parametrize("size", [1e-3, 1.0, 1e3])
def test_slopes_are_those_of_sympy(expression, size):
    at = {x: 0.3 * size, y: 0.4 * size if size < 10 else 0.01}
    found = evaluator([x, y], [expression]).slope(list(at.values()), [1.0, 0.5])[0]
    exact = float((expression.diff(x) + expression.diff(y) / 2).subs(at))
    assert found == pytest.approx(exact, rel=1e-13)


def test_a_function_of_real_numbers_has_differences():
    found = evaluator([x, y], [gamma(x) * y]).slope([2.0, 0.5], [1.0, 0.0])[0]
    assert found == pytest.approx(float(1 - EulerGamma) / 2, rel=1e-10)


def test_given_rates_of_small_loops_are_known_as_such():
    t = dynamicsymbols._t
    q, u = dynamicsymbols("a b c"), dynamicsymbols("v w z")
    kinematics = dict(zip([c.diff(t) for c in q], u, strict=True))
    gap = sqrt(q[0] ** 2 + q[1] ** 2) - 0.003
    rates = Rates((q, u), list(u), [], {})
    assert nonholonomic([gap], [gap.diff(t).subs(kinematics)], rates, mixed=True) == ()
    other = u[2] - q[0] * u[1]
    assert nonholonomic([gap], [other], rates, mixed=True) == (other,)
