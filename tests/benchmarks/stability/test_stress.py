"""The stress suite: every family runs and says what it found."""

import json
from functools import partial

import pytest

from benchmarks.stability import stress


def rows_of(words):
    return [{"case": word, "word": word, "excess": 0.5} for word in words]


def summed_up(words, least=0.5):
    family = stress.Family("holds", lambda quick: iter(()), least)
    return stress.summary("made up", family, rows_of(words), 0.0)


def test_one_wrong_run_fails_a_family():
    assert summed_up(["right"] * 9)["passed"]
    found = summed_up(["right"] * 9 + ["WRONG"])
    assert not found["passed"]
    assert found["wrong"] == 1


def test_a_family_that_refuses_too_much_fails():
    assert summed_up(["right", "refused"])["passed"]
    found = summed_up(["right", "refused", "flagged"])
    assert not found["passed"]
    assert "less than 50%" in found["note"]


def test_a_family_without_runs_fails():
    assert not summed_up([], least=0.0)["passed"]


def test_a_family_that_breaks_off_is_wrong_and_keeps_its_rows(monkeypatch):
    def rows(quick):
        yield from rows_of(["right"])
        raise RuntimeError("the scene misses its dead points")

    monkeypatch.setitem(stress.FAMILIES, "units", stress.Family("", rows))
    found, _ = stress.family_rows("units", True)
    assert [row["word"] for row in found] == ["right", "WRONG"]
    assert "misses its dead points" in found[-1]["status"]


def test_the_suite_prints_a_table_and_writes_json(capsys, out):
    code = stress.main(["--quick", "--family", "bad arguments", "dead points", "--processes", "1"])
    assert code == 0
    written = json.loads((out / "stress.json").read_text())
    assert [f["family"] for f in written["families"]] == ["bad arguments", "dead points"]
    assert {row["family"] for row in written["rows"]} == {"bad arguments", "dead points"}
    assert all(f["passed"] and f["promise"] for f in written["families"])
    assert "dead points" in capsys.readouterr().out


def test_a_wrong_run_makes_the_exit_code(monkeypatch):
    wrong = stress.Family("", lambda quick: iter(rows_of(["WRONG"])))
    monkeypatch.setitem(stress.FAMILIES, "units", wrong)
    assert stress.main(["--family", "units"]) == 1


def test_cases_of_chosen_seeds_are_run(monkeypatch, capsys):
    row = lambda seed: rows_of([f"seed {seed}"])[0]  # noqa: E731
    drawn = stress.Family("", lambda quick: iter(()), drawn=partial(map, row))
    monkeypatch.setitem(stress.FAMILIES, "window near misses", drawn)
    found, _ = stress.family_rows("window near misses", range(7, 10))
    assert [row["case"] for row in found] == ["seed 7", "seed 8", "seed 9"]
    with pytest.raises(SystemExit):
        stress.main(["--family", "units", "--seeds", "0", "5"])
    assert "window near misses" in capsys.readouterr().err


def first_of(rows, count):
    return [row for row, _ in zip(rows, range(count), strict=False)]


@pytest.mark.slow(cases=99)
@pytest.mark.parametrize(
    ("family", "count"),
    [("change points", 3), ("units", 4), ("mass ratios", 2), ("length ratios", 2),
     ("tolerances", 28), ("open starts", 12), ("bad values", 10), ("a million periods", 2),
     pytest.param("redundant constraints", 2, marks=pytest.mark.thorough),
     ("near misses", 12), ("exact motion", 4), ("whole turns", 12),
     ("ends near", 24), ("starts near", 12),
     ("once silent", 9), pytest.param("window near misses", 6, marks=pytest.mark.thorough),
     pytest.param("redundant loops", 10, marks=pytest.mark.thorough)],
)  # fmt: skip
def test_the_first_runs_of_a_family_are_not_wrong(family, count):
    rows = first_of(stress.FAMILIES[family].rows(True), count)
    assert len(rows) == count
    assert "WRONG" not in [row["word"] for row in rows]
    assert stress.FAMILIES[family].least < 0.5 or "right" in [row["word"] for row in rows]
