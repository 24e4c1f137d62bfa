"""Ratios to the best peer, and where mechc is not the fastest."""

import pytest

from benchmarks.report import work_precision
from benchmarks.report.work_precision import ratios_table
from tests.support.benchmarks import canned_results


def test_where_a_peer_is_faster_the_report_says_so_by_name():
    problem = canned_results.problem(1.0)
    mine = problem["times"]["mechc"]
    assert "Where mechc" not in work_precision.summary({"regular": without_batches(problem)})
    problem["times"]["heyoka"]["1e-08"] = mine["1e-08"] / 2
    row = work_precision.ratios(problem)[2]
    assert (row["peer"], row["method"]) == ("heyoka", "taylor")
    assert row["ratio"] == pytest.approx(0.5)
    page = work_precision.summary({"regular": problem})
    assert "mechc&#x27;s time over that of heyoka (taylor): 2× at 1e-08" in page
    assert "fastest tool at 4;" in page
    mine["1e-10"] = None
    assert "peers reach errors that mechc does not: 1e-10 (heyoka)" in work_precision.summary(
        {"": problem}
    )


def test_a_peer_that_is_wrong_at_tighter_tolerances_is_marked():
    """Its time counts as before; a reader learns that no run of its tells which are right."""
    problem = without_batches(canned_results.problem(1.0))
    assert not any(row["doubtful"] for row in work_precision.ratios(problem))
    assert work_precision.MARK not in ratios_table(results_of(problem)).splitlines()[2]
    tightest = min(
        (row for row in problem["rows"] if row["tool"] == "heyoka"), key=lambda row: row["tol"]
    )
    tightest["label"] = "wrong"
    marked = work_precision.ratios(problem)
    assert marked[0]["doubtful"]
    assert f"{marked[0]['ratio']:.1f}{work_precision.MARK}" in ratios_table(results_of(problem))


def results_of(problem):
    return {"work_precision": {"problems": {"regular": problem}}}


def without_batches(problem):
    kept = {tool: at for tool, at in problem["times"].items() if "batch" not in tool}
    return problem | {"times": kept}


def test_batches_are_compared_with_batches_and_single_runs_with_single_runs():
    problem = canned_results.problem(1.0)
    assert {row["peer"] for row in work_precision.ratios(problem)} == {"heyoka"}
    assert {row["peer"] for row in work_precision.ratios(problem, "batch")} == {"heyoka batch"}
    assert work_precision.kinds(without_batches(problem)) == ["any", "auto"]


def test_ratios_of_auto_are_those_of_its_own_runs():
    """Not of the envelope of all methods, which is below it."""
    problem = canned_results.problem(1.0)
    for row in problem["rows"]:
        row["seconds"] *= 10 if (row["tool"], row["method"]) == ("mechc", "auto") else 1
    for any_method, auto in zip(
        work_precision.ratios(problem), work_precision.ratios(problem, "auto"), strict=True
    ):
        assert auto["ratio"] < 0.5 * any_method["ratio"]
