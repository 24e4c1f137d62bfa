"""Quick numbers and those of mpmath are the same numbers."""

import mpmath
import pytest
from mpmath import mpc, mpf

from benchmarks.references import arithmetic
from benchmarks.references.arithmetic import number, of_mpmath


@pytest.mark.parametrize("x", [mpf(0), mpmath.pi, -mpmath.e / 10**30, mpf(7) * 10**40, mpc(-1, 3)])
def test_there_and_back_nothing_is_lost(x):
    x = +x  # to 50 digits
    assert of_mpmath(number(x)) == x
    assert number(number(x)) == number(x)


@pytest.mark.parametrize("name", arithmetic.FUNCTIONS)
@pytest.mark.parametrize("x", [mpf("0.3"), mpf("2.9"), mpc("0.3", "-1.1")])
def test_functions_are_those_of_mpmath(name, x):
    found = of_mpmath(arithmetic.FUNCTIONS[name](number(x)))
    wanted = getattr(mpmath, name)(x)
    assert abs(found - wanted) < abs(wanted) * mpf(10) ** (2 - arithmetic.DIGITS)
    assert arithmetic.FUNCTIONS[name](x) == wanted


def test_linear_equations_are_solved():
    rows = [[0, 2, 1], [3, 1, -1], [1, 1, 4]]
    x = [mpf(1) / 3, mpf(-2), mpmath.pi]
    sides = [sum(a * b for a, b in zip(row, x, strict=True)) for row in rows]
    given = [[*map(number, row), number(side)] for row, side in zip(rows, sides, strict=True)]
    for found, wanted in zip(arithmetic.solution(given), x, strict=True):
        assert abs(of_mpmath(found) - wanted) < mpf(10) ** -48
