"""Equations as a textbook has KanesMethod form them: dependent speeds, operations."""

from dataclasses import replace

import numpy as np
import pytest
import sympy
from mechc_codegen.library.planar.slider_crank import slider_crank

from benchmarks import peers
from benchmarks.formulations import textbook
from benchmarks.peers import notebook
from tests.support.benchmarks.problems import described


@pytest.mark.parametrize("solver", ["LU", "CRAMER"])
def test_the_dependent_speeds_can_be_solved_for_at_the_start(solver):
    """With the links of a slider-crank in line; the crank's acceleration is that of its inertia.

    Crank 2 kg, 0.5 m about its pivot, rod 4 kg, 1 m: in line the rod's end does not move, so it
    turns with half the crank's rate and its inertia counts a quarter.
    """
    problem = described(slider_crank(), [0.0, 0.0, 1.5, 0.0, 0.0, 0.0])
    equations = textbook.textbook(problem, solver)
    rates = notebook.inverting(equations)(0.0, problem.start)
    inertia = 2 * 0.5**2 / 3 + 4 * 1.0**2 / 3 / 4
    np.testing.assert_allclose(rates[3:], [10 / inertia, -5 / inertia, 0.0], atol=1e-12)


def test_pivots_are_the_largest_of_what_is_left():
    pivots = textbook.pivots
    assert pivots(np.array([[0.0, 0.0, -1.0], [0.5, 2.0, 0.0]])) == ([1, 0], [1, 2])
    with pytest.raises(peers.NotExpressibleError, match="repeat others"):
        pivots(np.array([[1.0, 2.0, 3.0], [2.0, 4.0, 6.0]]))


def test_repeated_constraints_are_not_given_to_kanes_method():
    once = slider_crank()
    again = [replace(c, name=f"{c.name}, again") for c in once.configuration_constraints]
    twice = replace(once, configuration_constraints=(*once.configuration_constraints, *again[:1]))
    problem = described(twice, [0.1, -0.05, 1.49, 0.0, 0.0, 0.0])
    refused = peers.NotExpressibleError
    with pytest.raises(refused, match="repeat others"):
        textbook.textbook(problem)


def test_operations_are_counted_as_they_are_written_out():
    """What is shared counts each time it is printed."""
    x, y = sympy.symbols("x y")
    shared = sympy.sin(x + y)  # two operations
    count = textbook.operations
    assert count(sympy.Matrix([shared, shared * x])) == 2 + 3
