"""The suite runs its scripts apart from each other, keeps what it has, and shows all of it."""

import json
import os
import signal
import subprocess
import sys
import time
from html.parser import HTMLParser
from pathlib import Path

import pytest

from mechc.cli import bench as cli_bench
from mechc.cli import commands as cli
from mechc.errors import MechcError
from tests.support.benchmarks import canned_results

FOLDER = Path(__file__).parents[2] / "benchmarks"
NOT_OF_THE_SUITE = {
    "suite": "it starts the others",
    "references": "makes reference data, in half an hour",
    "near_miss_reference": "makes reference data, in hours",
    "closure_curve": "the judge of failure_rate",
    "sympy_models": "compiles all models of SymPy's tests, in hours",
}
SMOKED = ("change_point", "near_misses", "failure_rate", "long_run", "essentials", "batch")
VOID = {"meta", "br", "img", "link", "input", "hr"}


class Page(HTMLParser):
    """What a browser would make of a page: elements closed in order, links, texts."""

    def __init__(self, text):
        super().__init__()
        self.open, self.counts, self.addresses, self.texts = [], {}, [], []
        self.feed(text)
        self.close()
        assert not self.open

    def handle_starttag(self, tag, attrs):
        self.counts[tag] = self.counts.get(tag, 0) + 1
        self.addresses += [value for name, value in attrs if name in ("href", "src", "data-src")]
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.texts.append(data)


def read(page):
    """The page, which fetches nothing."""
    found = Page(page)
    assert all(address.startswith("#") for address in found.addresses)
    assert "url(" not in page
    assert "@import" not in page
    return found


# -- the report -------------------------------------------------------------------------------


def test_the_report_shows_every_part_and_fetches_nothing(module):
    results = canned_results.results()
    page = module("report").page(results)
    found = read(page)
    plots = page.count('class="plot"')
    assert plots == len(results["work_precision"]["problems"]) + 2, "two more of growth"
    text = " ".join(found.texts)
    for tool in canned_results.TOOLS:
        assert tool in text
    for part in ("exudyn: not installed", "2 of 2 families", "two cores over one",
                 "four_bar, rates", "heyoka 7.13.2", "abc1234", "avx2"):  # fmt: skip
        assert part in text, part


def test_names_and_texts_are_escaped(module):
    results = canned_results.results()
    hostile = "<script>alert(1)</script>\"'&"
    problem = results["work_precision"]["problems"].pop("regular")
    problem["rows"][0] |= {"tool": hostile, "method": hostile, "error": 1e-3}
    results["work_precision"]["problems"][hostile] = problem | {"title": hostile, "note": hostile}
    results["stress"]["families"][0]["note"] = hostile
    results["about"]["system"] = hostile
    results["essentials"] = [{hostile: hostile}]
    page = module("report").page(results)
    assert "<script>alert" not in page
    assert read(page).counts["script"] == 1


def test_parts_that_were_not_run_are_named(module):
    results = {"about": canned_results.about(), "codes": {}, "seconds": {}}
    page = module("report").page(results)
    read(page)
    assert page.count("not run") >= 9


def test_a_wrong_branch_is_crossed_and_a_status_is_told(module):
    page = module("report").page(canned_results.results())
    assert page.count("another motion than the exact one") == 2, "one of each problem"
    assert "too many steps" in page


def test_where_a_peer_is_faster_the_report_says_so_by_name(module):
    work, problem = module("report_work"), canned_results.problem(1.0)
    mine = problem["times"]["mechc"]
    assert "Where mechc" not in work.summary({"regular": without_batches(problem)})
    problem["times"]["heyoka"]["1e-08"] = mine["1e-08"] / 2
    row = work.ratios(problem)[2]
    assert (row["peer"], row["method"]) == ("heyoka", "taylor")
    assert row["ratio"] == pytest.approx(0.5)
    page = work.summary({"regular": problem})
    assert "mechc&#x27;s time over that of heyoka (taylor): 2× at 1e-08" in page
    assert "fastest tool at 4;" in page
    mine["1e-10"] = None
    assert "peers reach errors that mechc does not: 1e-10 (heyoka)" in work.summary({"": problem})


def without_batches(problem):
    kept = {tool: at for tool, at in problem["times"].items() if "batch" not in tool}
    return problem | {"times": kept}


def test_batches_are_compared_with_batches_and_single_runs_with_single_runs(module):
    work, problem = module("report_work"), canned_results.problem(1.0)
    assert {row["peer"] for row in work.ratios(problem)} == {"heyoka"}
    assert {row["peer"] for row in work.ratios(problem, "batch")} == {"heyoka batch"}
    assert work.kinds(without_batches(problem)) == ["any", "auto"]


def test_ratios_of_auto_are_those_of_its_own_runs(module):
    """Not of the envelope of all methods, which is below it."""
    work, problem = module("report_work"), canned_results.problem(1.0)
    for row in problem["rows"]:
        row["seconds"] *= 10 if (row["tool"], row["method"]) == ("mechc", "auto") else 1
    for any_method, auto in zip(work.ratios(problem), work.ratios(problem, "auto"), strict=True):
        assert auto["ratio"] < 0.5 * any_method["ratio"]


# -- comparison -------------------------------------------------------------------------------


def times_of(mine, theirs):
    times = {"mechc": {"1e-08": mine}, "heyoka": {"1e-08": theirs}}
    return {"about": {}, "work_precision": {"problems": {"regular": {"times": times}}}}


def test_a_slower_run_is_a_regression_and_a_slower_machine_is_not(module):
    compare = module("report_compare")

    def verdicts(now, earlier):
        return [(row["verdict"], row["ratio"]) for row in compare.compare(now, earlier)]

    assert verdicts(times_of(2.0, 4.0), times_of(1.0, 2.0)) == [("same", 1.0)]
    assert verdicts(times_of(2.0, 2.0), times_of(1.0, 2.0)) == [("worse", 2.0)]
    assert verdicts(times_of(1.0, 4.0), times_of(1.0, 2.0)) == [("better", 0.5)]
    assert verdicts(times_of(1.2, 2.0), times_of(1.0, 2.0)) == [("same", 1.2)]
    assert verdicts(times_of(None, 2.0), times_of(1.0, 2.0)) == []


def test_counts_are_compared_exactly_or_nearly_and_promises_as_they_are(module):
    compare = module("report_compare")
    now, earlier = canned_results.results(), canned_results.results()
    assert {row["verdict"] for row in compare.compare(now, earlier)} == {"same"}
    now["costs"]["instructions"][0]["value"] *= 1.05
    now["costs"]["rows"][1]["value"] *= 1.05
    now["growth"]["rows"]["planar"][0]["operations"] -= 1
    now["stress"]["families"][0]["passed"] = False
    now["codes"]["growth"] = 1
    now["work_precision"]["problems"]["regular"]["rows"][3]["label"] = "wrong"
    changed = {row["what"]: row["verdict"] for row in compare.compare(now, earlier)
               if row["verdict"] != "same"}  # fmt: skip
    assert changed == {
        "costs: four_bar, rates (instructions)": "worse",
        "costs: wheel": "worse",
        "growth: planar, 1 links, operations": "better",
        "stress: units": "worse",
        "growth runs through": "worse",
        "regular: auto at 1e-09 is not wrong": "worse",
    }
    page = module("report").page(now, earlier)
    read(page)
    assert "5 worse, 1 better" in page


# -- the suite --------------------------------------------------------------------------------


@pytest.fixture
def scripts(module, monkeypatch, tmp_path):
    """A suite of scripts written here: name -> text; runs it, and gives its code and results."""
    suite, running, results = module("suite"), module("_running"), module("_results")
    table = {}

    def run(texts, *options, limit=30.0):
        for name, text in texts.items():
            (tmp_path / f"{name}.py").write_text(text)
            table[name] = suite.Script("?", (), (), (), (limit, limit))
        out = tmp_path / "results"
        code = suite.main(["--out", str(out), *options])
        return code, json.loads((out / "results.json").read_text())

    monkeypatch.setattr(running, "FOLDER", tmp_path)
    monkeypatch.setattr(suite, "SCRIPTS", table)
    given = os.environ.get("PYTHONPATH")
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(filter(None, (str(FOLDER), given))))
    assert results.FOLDER == FOLDER
    return run


WRITES = "from _results import write; write('{}', {{'x': {}}})"


def test_a_script_that_fails_is_told_and_the_others_run(scripts, capsys):
    texts = {"good": WRITES.format("good", "1e400"), "bad": "raise SystemExit(3)",
             "last": WRITES.format("last", "2")}  # fmt: skip
    code, results = scripts(texts)
    assert code == 1
    assert results["codes"] == {"good": 0, "bad": 3, "last": 0}
    assert (results["good"], results["last"]) == ({"x": None}, {"x": 2})
    assert "FAILED: bad" in capsys.readouterr().out


def test_a_script_that_takes_too_long_is_ended_with_what_it_started(scripts, tmp_path, capsys):
    slow = (
        WRITES.format("slow", "1") + "\nimport subprocess, sys, time\n"
        "child = subprocess.Popen([sys.executable, '-c', 'import time; time.sleep(600)'])\n"
        f"open({str(tmp_path / 'pid')!r}, 'w').write(str(child.pid))\n"
        "time.sleep(600)\n"
    )
    code, results = scripts({"slow": slow, "next": "pass"}, limit=5.0)
    assert code == 1
    assert results["codes"] == {"slow": 124, "next": 0}
    assert results["slow"] == {"x": 1}, "what it had measured is kept"
    assert "TOOK TOO LONG: slow" in capsys.readouterr().out
    assert ended(int((tmp_path / "pid").read_text()))


def ended(process):
    """Whether a process is gone, or is so soon."""
    for _ in range(100):
        status = Path(f"/proc/{process}/stat")
        if not status.exists() or status.read_text().rpartition(")")[2].split()[0] == "Z":
            return True
        time.sleep(0.05)
    return False


def test_what_is_not_run_has_its_reason_in_the_results_and_in_the_report(
    module, monkeypatch, tmp_path
):
    suite = module("suite")
    monkeypatch.setattr(module("_results"), "A_CLONE", False)
    options = ["--smoke", "--only", "first_value", "scenes", "--out", str(tmp_path)]
    assert suite.main(options) == 0
    results = json.loads((tmp_path / "results.json").read_text())
    assert results["codes"] == {}
    assert results["skipped"] == {
        "first_value": "needs a clone of the repository", "scenes": "not part of a smoke run",
    }  # fmt: skip
    assert "needs a clone of the repository" in (tmp_path / "results.html").read_text()


def test_a_script_that_only_a_full_run_has_is_run_when_it_is_named(module):
    suite = module("suite")
    assert "scenes" in suite.planned("quick", ())[1]
    assert suite.planned("quick", ("scenes",)) == ({"scenes": ()}, {})


def test_figures_of_an_older_run_are_not_taken_for_those_of_a_failed_one(scripts):
    _, results = scripts({"one": WRITES.format("one", "1")})
    assert "one" in results
    _, results = scripts({"one": "raise SystemExit(1)"})
    assert "one" not in results


def test_interrupted_it_keeps_what_it_has(tmp_path):
    command = [sys.executable, str(FOLDER), "--smoke", "--only", "long_run", "first_value"]
    suite = subprocess.Popen([*command, "--out", str(tmp_path)], stdout=subprocess.PIPE, text=True)
    for line in suite.stdout:
        if line.startswith("== first_value"):
            break
    suite.send_signal(signal.SIGINT)
    rest = suite.communicate(timeout=60)[0]
    assert suite.returncode == 130
    assert "INTERRUPTED: first_value" in rest
    results = json.loads((tmp_path / "results.json").read_text())
    assert results["codes"] == {"long_run": 0, "first_value": 130}
    assert results["long_run"]
    read((tmp_path / "results.html").read_text())


def test_every_script_belongs_to_the_suite_and_is_run_by_a_test(module):
    """A new one must be put into the table, and into a test."""
    suite = module("suite")
    here = Path(__file__).parent
    found = {
        path.stem for path in FOLDER.glob("*.py")
        if not path.stem.startswith(("_", "report"))
    } - set(NOT_OF_THE_SUITE)  # fmt: skip
    assert found == set(suite.SCRIPTS)
    tests = "".join(path.read_text() for path in here.glob("test_*.py"))
    for name in found - set(SMOKED):
        assert f'module("{name}")' in tests, f"no test in {here} runs {name}"


@pytest.mark.parametrize("name", SMOKED)
def test_the_script_runs(module, tmp_path, name):
    suite = module("suite")
    suite.main(["--smoke", "--only", name, "--out", str(tmp_path)])
    results = json.loads((tmp_path / "results.json").read_text())
    assert results[name], "written at the end, whether or not its figures are within limits"
    read((tmp_path / "results.html").read_text())


def test_a_live_run_has_its_plot_and_its_ratios_in_the_report(module, tmp_path):
    """The same shape of figures as the canned ones: whatever the report reads is there."""
    assert (
        module("suite").main(["--smoke", "--only", "work_precision", "--out", str(tmp_path)]) == 0
    )
    results = json.loads((tmp_path / "results.json").read_text())
    (problem,) = results["work_precision"]["problems"].values()
    known = canned_results.problem(1.0)
    assert set(known) <= set(problem)
    assert set(known["rows"][0]) <= set(problem["rows"][0])
    assert set(canned_results.TARGETS) <= set(problem["times"]["mechc"])
    page = (tmp_path / "results.html").read_text()
    read(page)
    assert page.count('class="plot"') == 1
    assert "mechc" in page.partition('class="plot"')[2]
    again = module("report_compare").compare(results, results)
    assert again
    assert {row["verdict"] for row in again} == {"same"}


def test_a_scene_of_the_table_is_measured_in_c_and_in_numpy(module):
    scenes = module("scenes")
    case = next(case for case in scenes.CASES if case.name == "open chain of 3")
    row = scenes.measured(case)
    assert 0 < row["ns a call"] < 1e3 * row["numpy us"]
    assert row["binary bytes"] > row["C bytes"] > 1000


def test_what_is_no_results_file_is_refused_in_a_line(module, tmp_path, capsys):
    (tmp_path / "a.json").write_text("{}")
    for name in ("a.json", "missing.json"):
        with pytest.raises(SystemExit) as raised:
            module("suite").main(["--against", str(tmp_path / name)])
        assert raised.value.code == 2
        assert "is no results.json" in capsys.readouterr().err


# -- the command ------------------------------------------------------------------------------


def test_mechc_bench_is_the_suite(capfd):
    assert cli.main(["bench", "--list"]) == 0
    assert "run time against achieved error" in capfd.readouterr().out
    assert cli.main(["bench", "--only", "nonsense"]) == 2
    assert "nonsense" in capfd.readouterr().err


def test_without_the_benchmarks_the_error_says_what_to_do(tmp_path):
    with pytest.raises(MechcError, match="install mechc again"):
        cli_bench.bench([], home=tmp_path / "mechc")
