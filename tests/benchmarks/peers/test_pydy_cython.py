"""PyDy as a peer: what it is given, and that its error falls."""

import pytest
from mechc_codegen.library.planar.car_axis import car_axis

from benchmarks import peers, problems
from benchmarks.formulations import textbook
from benchmarks.peers import pydy_cython
from tests.support.benchmarks.problems import described, errors, judged, shortened


def test_pydy_is_not_given_time_by_itself():
    problem = described(car_axis(), [0.0, 0.5, 1.0, 0.5, -0.5, 0.0, -0.5, 0.0])
    refused = peers.NotExpressibleError
    equations = textbook.textbook(problem, "CRAMER")
    with pytest.raises(refused, match="time by itself"):
        pydy_cython._refuse_time(equations)


def test_pydys_error_falls_with_the_tolerance():
    """By both integrators, on the smooth four-bar; what it generates is compiled."""
    pytest.importorskip("pydy")
    problem = shortened(problems.problem("four_bar_regular"), 2.0)
    built = pydy_cython.build(problem, [1e-5, 1e-9])
    cases = judged(built.cases, problem)
    for method in ("LSODA", "DOP853"):
        loose, tight = errors(cases, "PyDy", method)
        assert tight < 1e-2 * loose, method
        assert tight < 1e-5, method
    assert all(seconds > 0 for seconds in built.setup["PyDy"].values())
