"""The table of what other tools say: bold is another motion without a word, italics a status."""

import pytest

from benchmarks.peers import elsewhere
from benchmarks.timing import results

RIGHT = {"label": "right", "tol": 1e-6, "error": 2e-7, "status": "finished"}


def test_cells_tell_errors_other_motions_and_statuses():
    assert elsewhere.cell(RIGHT) == "1e-06: 2.0e-07"
    assert elsewhere.cell(RIGHT | {"label": "wrong", "error": 3.0}) == "**1e-06: 3.0e+00**"
    flagged = {"label": "flagged", "error": None, "status": "a | b"}
    assert elsewhere.cell(RIGHT | flagged) == "*a / b*"


def test_a_method_has_the_loosest_one_between_and_the_tightest():
    every = [RIGHT | {"tool": "x", "method": "m", "tol": 10.0**-k} for k in (9, 3, 12, 6, 15)]
    assert [cells[2:] for cells in elsewhere.rows({"rows": every})] == [
        ["0.001: 2.0e-07", "1e-09: 2.0e-07", "1e-15: 2.0e-07"]
    ]


@pytest.mark.thorough
def test_the_tables_are_written_between_the_marks_of_a_page(out, tmp_path):
    page = tmp_path / "page.md"
    page.write_text(f"before\n{elsewhere.BEGIN}\nold\n{elsewhere.END}\nafter\n", "utf-8")
    asked = ["--problem", "pendulum_1", "--peer", "scipy", "pinocchio", "--page", str(page)]
    assert elsewhere.main(asked) == 0
    found = results.read(out / "elsewhere.json")["problems"]["pendulum_1"]
    assert {row["label"] for row in found["rows"]} == {"right"}
    text = page.read_text("utf-8")
    assert text.startswith("before")
    assert text.endswith("after\n")
    assert "old" not in text
    assert "| SciPy, cse | DOP853 | 1e-06: " in text
