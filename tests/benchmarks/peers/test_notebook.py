"""What a user of sympy.physics.mechanics would write, as a peer."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks import problems
from benchmarks.formulations import textbook
from benchmarks.peers import notebook
from tests.support.benchmarks.problems import errors, judged, shortened


@pytest.mark.parametrize("solver", ["LU", "CRAMER"])
def test_a_notebooks_equations_are_those_of_the_model(solver):
    """Inverted without cse and solved with cse, along the motion, in the problem's own order."""
    problem = problems.problem("four_bar_regular")
    equations = textbook.textbook(problem, solver)
    for end in (0.4, 1.3, 2.9):
        y = problem.model.simulate(end, problem.start, problem.params).y[-1]
        expected = problem.model.rhs(0.0, y, problem.params)
        for form in (notebook.inverting, notebook.solving):
            np.testing.assert_allclose(form(equations)(0.0, y), expected, rtol=1e-9, atol=1e-9)


def test_a_notebooks_error_falls_with_the_tolerance():
    """Both tools on the smooth four-bar, the first also at the notebook's own tolerance."""
    problem = shortened(problems.problem("four_bar_regular"), 2.0)
    built = notebook.build(problem, [1e-5, 1e-8, 1e-12])
    cases = judged(built.cases, problem)
    assert 1e-6 in [case.tol for case in cases if case.tool == "SymPy notebook"]
    for tool, method in (
        ("SymPy notebook", "RK45"),
        ("SymPy notebook, mended", "RK45"),
        ("SymPy notebook, mended", "DOP853"),
    ):
        loosest, *_, tightest = errors(cases, tool, method)
        assert tightest < 1e-2 * loosest, (tool, method)
        assert tightest < 1e-4, (tool, method)
    assert all(seconds > 0 for of in built.setup.values() for seconds in of.values())


def test_a_notebook_is_shown_to_leave_the_motion_at_a_change_point():
    """Its own tolerance, 2.5 s, two crossings: it finishes, and is called wrong."""
    problem = shortened(problems.problem("four_bar_change_point"), 2.5)
    built = notebook.build(problem, [1e-6])
    own, *_ = judged(built.cases, problem)
    assert (own.tool, own.tol) == ("SymPy notebook", 1e-6)
    assert (own.status, own.label) == ("finished", "wrong")


def test_a_notebook_that_does_not_suit_the_problem_says_why():
    """RK45 on a stiff problem; too many operations to write out."""
    problem = problems.problem("four_bar_regular")
    stiff = replace(problem, stiff=True, t_end=1e-3)
    refused, *mended = judged(notebook.build(stiff, [1e-3]).cases, stiff)
    assert (refused.label, refused.tool) == ("flagged", "SymPy notebook")
    assert "the problem is stiff" in refused.status
    assert {case.method for case in mended} == {"LSODA", "Radau"}
