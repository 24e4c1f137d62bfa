"""Straight-line programs: elimination by symbols."""

import numpy as np
import sympy

from benchmarks.formulations import program


def test_a_straight_line_program_solves_constrained_equations():
    """The elimination by symbols against NumPy, with more rows than one."""
    rng = np.random.default_rng(1)
    B, J = rng.normal(size=(5, 5)), rng.normal(size=(3, 5))
    M, F, gamma = B @ B.T + 5 * np.eye(5), rng.normal(size=5), rng.normal(size=3)
    symbols = sympy.symbols("a0:5")
    tape = program.Tape()
    found = tape.accelerations(
        [[sympy.Float(x) for x in row] for row in M], list(symbols),
        [[sympy.Float(x) for x in row] for row in J], [sympy.Float(x) for x in gamma],
    )  # fmt: skip
    function = program.Program(symbols, *tape.finished(found)).function("math")
    A = np.block([[M, J.T], [J, np.zeros((3, 3))]])
    expected = np.linalg.solve(A, np.concatenate([F, gamma]))[:5]
    np.testing.assert_allclose(function(*F.tolist()), expected, rtol=1e-11)
