"""Counts of operations are SymPy's, with powers as the products they are printed as."""

from __future__ import annotations

import pytest
from mechc_codegen.ir.operations import count_operations
from sympy import Abs, Expr, Max, Rational, cos, count_ops, sin, sqrt, symbols

x, y, z = symbols("x y z", real=True)


@pytest.mark.parametrize(
    "expression",
    [
        x, -x, x - y, -x - y, -x + y, 2 * x - 3 * y + 1, x / y, -x / (2 * y), 1 / x, 3 / (x * y),
        Rational(2, 3) * x, sqrt(x), 1 / sqrt(x + y), x**7, sin(x) * cos(x), Max(x, y, z),
        Abs(x - y) * x, (x + y) * (x + y + 1) / (x - y), sin(x + y) * (x + y),
    ],
    ids=str,
)  # fmt: skip
def test_counts_are_those_of_sympy(expression: Expr) -> None:
    assert count_operations(expression) == count_ops(expression)


@pytest.mark.parametrize(
    ("expression", "count"),
    [(x**2, 1), (x**4, 3), (x**-2, 3), (x**2 + y * x**2, 4), (x**2 + y**3, 4)],
    ids=str,
)
def test_a_power_is_the_products_it_is_printed_as(expression: Expr, count: int) -> None:
    """One that occurs twice is a common subexpression."""
    assert count_operations(expression) == count
