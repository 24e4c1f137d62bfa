"""Factors of sums, and sums of which SymPy finds none in any time."""

from __future__ import annotations

import time

import pytest
from mechc_codegen.ir.factors import as_product
from sympy import Add, Symbol, exp, expand, sin, sqrt

X, Y = Symbol("x"), Symbol("y")
BUMP = exp(-5000 * (229 * X - 95) ** 2 / 49)


@pytest.mark.parametrize("square", [
    (X - 0.3) ** 2, (sin(X) + 2 * Y) ** 2, (1 - exp(-3 * X)) ** 2,
    (1 - BUMP) ** 2, X * (Y - exp(X**2)) ** 2,
])  # fmt: skip
def test_a_square_that_is_written_out_is_found(square) -> None:
    found = as_product(expand(square, power_exp=False))
    assert not isinstance(found, Add)
    assert expand(found - square).subs({X: 0.7, Y: 1.3}) == pytest.approx(0, abs=1e-12)


@pytest.mark.parametrize("long", [
    1 + BUMP, 1 + exp(-1e7 * X) + exp(2 * X), 1 + X**1_000_000_007 * Y, 2 + 3 ** (1_000_003 * X),
    (X + Y) ** 1000 + sin(X), 1 + sqrt(X) ** 999_983,
])  # fmt: skip
def test_high_powers_take_no_time(long) -> None:
    started = time.process_time()
    as_product(long)
    assert time.process_time() - started < 1.0
