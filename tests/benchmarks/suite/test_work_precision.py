"""Run time against error: one problem runs through, and a failure leaves the others."""

import numpy as np
import pytest

from benchmarks.suite import run, work_precision
from benchmarks.timing import results
from tests.support.benchmarks.page import read


@pytest.mark.thorough
def test_work_precision_runs_through(monkeypatch, tmp_path):
    """With SciPy alone, on the regular four-bar: rows, ratios, and the page of a named script."""
    monkeypatch.delenv(results.FOLDER_VARIABLE)
    options = ["--quick", "--budget", "0.5", "--problem", "four_bar_regular", "--only", "scipy"]
    assert run.main(["--out", str(tmp_path), "work_precision", *options]) == 0
    written = results.read(tmp_path / "work_precision.json")
    entry = written["problems"]["four_bar_regular"]
    assert entry["times"]["mechc"]["1e-08"] is not None
    assert entry["times"]["mechc batch"]["1e-08"] is not None
    assert {row["tool"] for row in entry["rows"]} >= {"mechc", "SciPy, cse"}
    assert entry["setup"]["SciPy, cse"]["derive"] > 0
    assert written["about"]["versions"]["numpy"] == np.__version__
    page = (tmp_path / "work_precision.html").read_text("utf-8")
    read(page)
    assert page.count('class="plot"') == 1


def test_where_mechc_itself_fails_the_other_problems_are_still_compared(monkeypatch, out):
    def compared(name, *arguments, **options):
        if name == "pendulum_1":
            raise RuntimeError("pendulum_1: mechc crashed (signal 11)")
        return {"title": "", "t_end": 1.0, "note": "", "rows": [], "skipped": {},
                "times": {"mechc": {}}, "auto": {}}  # fmt: skip

    monkeypatch.setattr(work_precision, "compare_apart", compared)
    assert work_precision.main(["--quick", "--problem", "pendulum_1", "pendulum_2"]) == 1
    data = results.read(out / "work_precision.json")
    assert list(data["problems"]) == ["pendulum_2"]
    assert "signal 11" in data["failed"]["pendulum_1"]
