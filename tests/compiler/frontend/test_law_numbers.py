"""Numbers of laws are parameters, but for those that decide the form of the equations."""

from __future__ import annotations

from itertools import permutations

import pytest
from mechc_codegen.description.parsing.parser import parse_expression
from mechc_codegen.frontend.law_numbers import numbers_apart
from sympy import Symbol

NAMES = {name: Symbol(name) for name in "txvk"}


@pytest.mark.parametrize(("law", "expected", "values"), [
    ("3*sin(4*t) - 0.5*v", "F.1*sin(F.2*t) - F.3*v", {3.0, 4.0, 0.5}),
    ("-3*x + 3*v", "-F.1*x + F.1*v", {3.0}),
    ("x**2 + sqrt(v) - 1", "x**2 + sqrt(v) - 1", set()),
    ("x**-3*exp(-t/4)", "x**-3*exp(-F.1*t)", {0.25}),
    ("k*abs(5*x)", "k*F.1*abs(x)", {5.0}),
    ("max(0, t - 1.5)*sign(v - 2.5)", "max(0, t - F.1)*sign(v - F.2)", {2.5, 1.5}),
])  # fmt: skip
def test_numbers_that_are_no_form_have_symbols(law, expected, values) -> None:
    found, numbers = numbers_apart(parse_expression(law, NAMES), "F", ())
    assert {*numbers.values()} == values
    symbols = {f"F_{i}": Symbol(f"F.{i}", positive=True) for i in range(1, 5)}
    texts = expected.replace("F.", "F_")
    orders = _renamings(parse_expression(texts, {**NAMES, **symbols}), list(numbers))
    assert found in orders


def _renamings(expression, symbols):
    """The expression with its numbers counted in any order."""
    return [
        expression.xreplace(dict(zip(symbols, order, strict=True)))
        for order in permutations(symbols)
    ]


def test_what_they_stand_for_is_the_law() -> None:
    law = parse_expression("3*tanh((x - 2)/0.25) - 7*Max(0, v - 1.5) + 1e-3*t**3", NAMES)
    found, numbers = numbers_apart(law, "F", ())
    at = {NAMES["t"]: 1.5, NAMES["x"]: 2.1, NAMES["v"]: 1.75}
    assert float(found.subs(numbers).subs(at)) == pytest.approx(float(law.subs(at)), rel=1e-14)


def test_a_name_that_is_taken_is_passed_over() -> None:
    _, numbers = numbers_apart(parse_expression("3*t", NAMES), "F", {"F.1"})
    assert [s.name for s in numbers] == ["F.2"]
