"""Cases: labels, what is left out, what is cut off, and what is written of them."""

import json

import numpy as np
import pytest

from benchmarks.timing import cases as timing
from benchmarks.timing.envelope import points_of


def case_of(tol, error, *, tool="tool", method="method", run=lambda: 0.0):
    return timing.Case(tool, method, tol, run, lambda value: np.array([error]))


@pytest.mark.slow
def test_wrong_motions_are_listed_and_never_part_of_an_envelope():
    cases = [case_of(1e-3, 5.0), case_of(1e-4, 1e-5)]
    cases.append(case_of(1e-5, np.nan))
    measured = timing.measure(cases, lambda observed: float(observed[0]), timing.Effort(rounds=2))
    rows = [case.record() for case in measured]
    assert [row["label"] for row in rows] == ["wrong", "right", "flagged"]
    assert rows[0]["error"] == 5.0
    assert rows[2]["error"] is None
    assert points_of(rows) == [(1e-5, rows[1]["seconds"])]


def test_where_a_run_takes_too_long_tighter_tolerances_of_that_method_are_left_out(monkeypatch):
    """By a clock that only runs while a case does."""
    clock = [0.0]
    monkeypatch.setattr(timing.time, "perf_counter", lambda: clock[0])
    cases = [
        case_of(tol, tol, method=method, run=lambda s=s: clock.append(clock.pop() + s))
        for method, s in (("slow", 0.02), ("quick", 0.001))
        for tol in (1e-3, 1e-5, 1e-4)
    ]
    effort = timing.Effort(longest=0.01, rounds=1)
    measured = timing.measure(cases, lambda observed: float(observed[0]), effort)
    assert [(c.method, c.tol) for c in measured] == [
        ("slow", 1e-3), ("quick", 1e-3), ("quick", 1e-5), ("quick", 1e-4),
    ]  # fmt: skip
    assert measured[1].seconds == pytest.approx([0.001, 0.001])


def test_a_run_without_end_is_cut_off_and_says_so():
    def run():
        while True:
            pass

    case = case_of(1e-3, 1e-3, run=run)
    timing.measure([case], lambda observed: 0.0, timing.Effort(cut=0.1, rounds=1))
    assert case.label == "flagged"
    assert "cut off after 0.1 s" in case.record()["status"]


@pytest.mark.slow
def test_what_work_precision_writes_is_valid_json_without_nan():
    """A case without a final state has no error, not one that is no number."""
    case = case_of(1e-3, np.inf)
    timing.measure([case], lambda observed: float(observed[0]), timing.Effort(rounds=1))
    json.dumps(case.record(), allow_nan=False)
    assert case.record()["status"] == "not finite"
