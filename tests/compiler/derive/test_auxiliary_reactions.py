"""The linear equations that give the forces of auxiliary speeds."""

from __future__ import annotations

import pytest
from mechc_codegen.derive.auxiliary_reactions import solve
from sympy import Matrix, cancel, symbols

a, b, c = symbols("a b c")


@pytest.mark.parametrize(
    "matrix",
    [
        [[2, 1, 3, 1], [1, 3, 1, 2], [1, 4, 2, 7], [5, 1, 1, 3]],
        [[0, 1, 3], [2, 0, 1], [1, 1, 0]],  # whose diagonal holds no pivot
        [[a, b], [b, c]],
    ],
)
def test_the_solution_meets_the_equations(matrix):
    right = Matrix(range(1, len(matrix) + 1))
    found = solve(
        [[*row, known] for row, known in zip(Matrix(matrix).tolist(), right, strict=True)]
    )
    assert (Matrix(matrix) * Matrix(found) - right).applyfunc(cancel).is_zero_matrix


def test_equations_that_depend_on_each_other_have_none():
    assert solve(Matrix([[1, 2, 1], [2, 4, 2]]).tolist()) is None
