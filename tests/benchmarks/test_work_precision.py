"""Run time against error: envelopes, labels, what is left out, peers that fail; one run through."""

import json
import textwrap

import numpy as np
import pytest

HANGS, CRASHES = "while True: pass", "os._exit(3)"


def case_of(timing, tol, error, *, tool="tool", method="method", run=lambda: 0.0):
    return timing.Case(tool, method, tol, run, lambda value: np.array([error]))


def test_time_at_an_error_is_read_off_the_lower_envelope(module):
    """Log-log between points that nothing beats; nothing where the error is not reached."""
    time_at = module("_envelope").time_at
    points = [(1e-4, 1.0), (1e-8, 4.0), (1e-6, 9.0), (1e-9, 5.0)]
    assert time_at(points, 1e-6) == pytest.approx(2.0)
    assert time_at(points, 1e-3) == 1.0
    assert time_at(points, 1e-10) is None


def test_wrong_motions_are_listed_and_never_part_of_an_envelope(module):
    timing, envelope = module("_timing"), module("_envelope")
    cases = [case_of(timing, 1e-3, 5.0), case_of(timing, 1e-4, 1e-5)]
    cases.append(case_of(timing, 1e-5, np.nan))
    measured = timing.measure(cases, lambda observed: float(observed[0]), timing.Effort(rounds=2))
    rows = [case.record() for case in measured]
    assert [row["label"] for row in rows] == ["wrong", "right", "flagged"]
    assert rows[0]["error"] == 5.0
    assert rows[2]["error"] is None
    assert envelope.points_of(rows) == [(1e-5, rows[1]["seconds"])]


def test_where_a_run_takes_too_long_tighter_tolerances_of_that_method_are_left_out(
    module, monkeypatch
):
    """By a clock that only runs while a case does."""
    timing, clock = module("_timing"), [0.0]
    monkeypatch.setattr(timing.time, "perf_counter", lambda: clock[0])
    cases = [
        case_of(timing, tol, tol, method=method, run=lambda s=s: clock.append(clock.pop() + s))
        for method, s in (("slow", 0.02), ("quick", 0.001))
        for tol in (1e-3, 1e-5, 1e-4)
    ]
    effort = timing.Effort(longest=0.01, rounds=1)
    measured = timing.measure(cases, lambda observed: float(observed[0]), effort)
    assert [(c.method, c.tol) for c in measured] == [
        ("slow", 1e-3), ("quick", 1e-3), ("quick", 1e-5), ("quick", 1e-4),
    ]  # fmt: skip
    assert measured[1].seconds == pytest.approx([0.001, 0.001])


def test_a_run_without_end_is_cut_off_and_says_so(module):
    timing = module("_timing")

    def run():
        while True:
            pass

    case = case_of(timing, 1e-3, 1e-3, run=run)
    timing.measure([case], lambda observed: 0.0, timing.Effort(cut=0.1, rounds=1))
    assert case.label == "flagged"
    assert "cut off after 0.1 s" in case.record()["status"]


def test_the_best_peer_is_the_fastest_at_that_error_and_no_batch(module):
    envelope = module("_envelope")

    def row(tool, method, error, seconds):
        return {"tool": tool, "method": method, "error": error, "seconds": seconds,
                "label": "right"}  # fmt: skip

    rows = [row("mechc", "auto", 1e-9, 1.0), row("A", "x", 1e-9, 3.0), row("A", "y", 1e-9, 2.0),
            row("B", "x", 1e-5, 0.5), row("A batch", "x", 1e-9, 0.1)]  # fmt: skip
    times = envelope.times_of(rows)
    best = envelope.best_peer(rows, times)
    assert best["1e-08"] == {"tool": "A", "method": "y", "ratio": 2.0}
    assert best["1e-04"] == {"tool": "B", "method": "x", "ratio": 0.5}
    assert best["1e-10"] is None
    assert envelope.ratios(times)["A batch"]["1e-08"] is None  # no batch of mechc's here


@pytest.mark.parametrize(("does", "told"), [(HANGS, "did not finish"), (CRASHES, "exit code 3")])
def test_a_peer_that_hangs_or_crashes_is_named_and_the_others_go_on(
    module, monkeypatch, tmp_path, does, told
):
    """The process is started again without it."""
    apart = module("_apart")
    script = tmp_path / "script.py"
    script.write_text(
        textwrap.dedent(f"""\
        import json, os, sys
        request = json.load(open(sys.argv[1]))
        if "bad" in request["peers"]:
            open(request["working"], "w").write("bad")
            {does}
        open(request["result"], "w").write(json.dumps({{"skipped": {{}}, "of": request["peers"]}}))
    """)
    )
    monkeypatch.setattr(apart, "SCRIPT", script)
    effort = module("_timing").Effort()
    entry = apart.compare_apart("x", ("good", "bad"), (1e-3,), effort, quick=True, patience=1.0)
    assert entry["of"] == ["good"]
    assert told in entry["skipped"]["bad"]


def test_every_problem_starts_on_its_manifold_and_knows_its_end(module):
    """Shapes and finite exact values; the start observed is not the end."""
    problems = module("problems")
    for name in problems.NAMES:
        problem = problems.problem(name)
        observed = problem.observe(problem.start)
        assert observed.shape == problem.exact.shape == (len(problem.quantities),), name
        assert np.isfinite(problem.exact).all(), name
        assert problem.error(observed) > 0.01, name


def test_work_precision_runs_through(module):
    """Without peers, on the regular four-bar: rows, ratios, plot."""
    run = module("work_precision")
    result = run.main(
        ["--quick", "--budget", "0.5", "--problem", "four_bar_regular", "--only", "scipy"]
    )
    entry = result["problems"]["four_bar_regular"]
    assert entry["times"]["mechc"]["1e-08"] is not None
    assert entry["times"]["mechc batch"]["1e-08"] is not None
    assert {row["tool"] for row in entry["rows"]} >= {"mechc", "SciPy, cse"}
    assert entry["setup"]["SciPy, cse"]["derive"] > 0
    written = json.loads((run.OUT / "work_precision.json").read_text())
    assert written["about"]["versions"]["numpy"] == np.__version__
    assert (run.OUT / "work_precision_four_bar_regular.svg").stat().st_size > 1000


def test_where_mechc_itself_fails_the_other_problems_are_still_compared(module, monkeypatch):
    run = module("work_precision")

    def compared(name, *arguments, **options):
        if name == "pendulum_1":
            raise RuntimeError("pendulum_1: mechc crashed (signal 11)")
        return {"title": "", "t_end": 1.0, "note": "", "rows": [], "skipped": {},
                "times": {"mechc": {}}, "auto": {}}  # fmt: skip

    monkeypatch.setattr(run, "compare_apart", compared)
    data = run.main(["--quick", "--problem", "pendulum_1", "pendulum_2"])
    assert list(data["problems"]) == ["pendulum_2"]
    assert "signal 11" in data["failed"]["pendulum_1"]


def test_what_work_precision_writes_is_valid_json_without_nan(module):
    """A case without a final state has no error, not one that is no number."""
    timing = module("_timing")
    case = case_of(timing, 1e-3, np.inf)
    timing.measure([case], lambda observed: float(observed[0]), timing.Effort(rounds=1))
    json.dumps(case.record(), allow_nan=False)
    assert case.record()["status"] == "not finite"
