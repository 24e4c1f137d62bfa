"""The suite runs its scripts apart from each other, keeps what it has, and shows all of it."""

import json
import pkgutil
import signal
import subprocess
import sys
import time
from importlib import import_module
from pathlib import Path

import pytest

import benchmarks
from benchmarks.report import command, compare, page
from benchmarks.stability.families import FAMILIES
from benchmarks.suite import run, running
from benchmarks.suite.scripts import COMMANDS, SCRIPTS, Script
from benchmarks.timing import processes
from benchmarks.timing.results import read as read_figures
from mechc.cli import bench, commands
from mechc.errors import MechcError
from tests.support.benchmarks import canned_results
from tests.support.benchmarks.page import read

# Scripts that a test runs through by their smallest options; others have tests of their own.
SMOKED = ("batch", "growth", "stress")
WRITES = "from benchmarks.timing.results import write; write('{}', {{'x': {}}})"
RUNS_THE_NAMED = "import runpy, sys; runpy.run_path({folder!r} + '/' + sys.argv[1] + '.py')"


@pytest.fixture
def scripts(monkeypatch, tmp_path):
    """A suite of scripts written here: name -> text; runs it, and gives its code and results."""
    table, command = {}, [sys.executable, "-c", RUNS_THE_NAMED.format(folder=str(tmp_path))]

    def of_texts(texts, *options, limit=30.0):
        for name, text in texts.items():
            (tmp_path / f"{name}.py").write_text(text)
            table[name] = Script("?", name, (), (), (), (limit, limit))
        out = tmp_path / "results"
        code = run.main(["--out", str(out), *options])
        return code, read_figures(out / "results.json")

    monkeypatch.setattr(running, "module_command", lambda *_: command)
    monkeypatch.setattr(run, "SCRIPTS", table)
    return of_texts


def test_a_script_that_fails_is_told_and_the_others_run(scripts, capsys):
    texts = {"good": WRITES.format("good", "1e400"), "bad": "raise SystemExit(3)",
             "last": WRITES.format("last", "2")}  # fmt: skip
    code, results = scripts(texts)
    assert code == 1
    assert results["codes"] == {"good": 0, "bad": 3, "last": 0}
    assert (results["good"], results["last"]) == ({"x": None}, {"x": 2})
    assert "FAILED: bad" in capsys.readouterr().out


@pytest.mark.slow
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


def test_what_is_not_run_has_its_reason_in_the_results_and_in_the_report(tmp_path):
    assert run.main(["--smoke", "--only", "costs", "scenes", "--out", str(tmp_path)]) == 0
    results = read_figures(tmp_path / "results.json")
    assert results["codes"] == {}
    told = "not part of a smoke run"
    assert results["skipped"] == {"costs": told, "scenes": told}
    assert (tmp_path / "results.html").read_text().count(told) == 2


def test_a_script_that_only_a_full_run_has_is_run_when_it_is_named():
    assert "scenes" in run.planned("quick", ())[1]
    assert run.planned("quick", ("scenes",)) == ({"scenes": ()}, {})


def test_figures_of_an_older_run_are_not_taken_for_those_of_a_failed_one(scripts):
    _, results = scripts({"one": WRITES.format("one", "1")})
    assert "one" in results
    _, results = scripts({"one": "raise SystemExit(1)"})
    assert "one" not in results


@pytest.mark.thorough
def test_interrupted_it_keeps_what_it_has(tmp_path):
    command = [*processes.module_command("__main__"), "--smoke", "--only", "stress", "growth"]
    suite = subprocess.Popen(
        [*command, "--out", str(tmp_path)], env=processes.environment(), stdout=subprocess.PIPE,
        text=True,
    )  # fmt: skip
    for line in suite.stdout:
        if line.startswith("== growth"):
            break
    suite.send_signal(signal.SIGINT)
    rest = suite.communicate(timeout=60)[0]
    assert suite.returncode == 130
    assert "INTERRUPTED: growth" in rest
    results = read_figures(tmp_path / "results.json")
    assert results["codes"] == {"stress": 0, "growth": 130}
    assert results["stress"]
    read((tmp_path / "results.html").read_text())


def test_every_script_and_command_is_there_and_is_run_by_a_test():
    """A new one must be put into a test."""
    folder = Path(__file__).parents[1]
    tests = "".join(path.read_text("utf-8") for path in folder.rglob("test_*.py"))
    for name, script in (SCRIPTS | COMMANDS).items():
        assert callable(import_module(f"benchmarks.{script.module}").main), name
        word = script.module.rpartition(".")[2]
        called = f"{word}.main(" in tests or f"{word}.measured(" in tests
        assert name in SMOKED or called, f"no test runs {name}"


def test_every_module_of_the_benchmarks_can_be_imported():
    """What a worker imports is seen by no other test."""
    for module in pkgutil.walk_packages(benchmarks.__path__, "benchmarks."):
        try:
            import_module(module.name)
        except ModuleNotFoundError as error:  # a peer that is not installed
            if str(error.name).startswith(("benchmarks", "mechc")):
                raise


def test_every_script_has_its_place_in_the_report():
    assert {*page.STABILITY, *page.GROWTH, *page.COSTS, "work_precision"} >= set(SCRIPTS)
    assert {*page.STABILITY} - {"stress"} <= set(FAMILIES)


@pytest.mark.parametrize("name", SMOKED)
@pytest.mark.thorough
def test_the_script_runs(tmp_path, name):
    run.main(["--smoke", "--only", name, "--out", str(tmp_path)])
    results = read_figures(tmp_path / "results.json")
    assert results[name], "written at the end, whether or not its figures are within limits"
    read((tmp_path / "results.html").read_text())


@pytest.mark.thorough
def test_a_live_run_has_its_plot_and_its_ratios_in_the_report(tmp_path):
    """The same shape of figures as the canned ones: whatever the report reads is there."""
    assert run.main(["--smoke", "--only", "work_precision", "--out", str(tmp_path)]) == 0
    results = read_figures(tmp_path / "results.json")
    (problem,) = results["work_precision"]["problems"].values()
    known = canned_results.problem(1.0)
    assert set(known) <= set(problem)
    assert set(known["rows"][0]) <= set(problem["rows"][0])
    assert set(canned_results.TARGETS) <= set(problem["times"]["mechc"])
    shown = (tmp_path / "results.html").read_text()
    read(shown)
    assert shown.count('class="plot"') == 1
    assert "mechc" in shown.partition('class="plot"')[2]
    again = compare.compare(results, results)
    assert again
    assert {row["verdict"] for row in again} == {"same"}


def test_what_is_no_results_file_is_refused_in_a_line(tmp_path, capsys):
    (tmp_path / "a.json").write_text("{}")
    for name in ("a.json", "missing.json"):
        with pytest.raises(SystemExit) as raised:
            run.main(["--against", str(tmp_path / name)])
        assert raised.value.code == 2
        assert "is no results.json" in capsys.readouterr().err


def test_mechc_bench_is_the_suite(capfd):
    assert commands.main(["bench", "--list"]) == 0
    assert "run time against achieved error" in capfd.readouterr().out
    assert commands.main(["bench", "--only", "nonsense"]) == 2
    assert "nonsense" in capfd.readouterr().err


def test_without_the_benchmarks_the_error_says_what_to_do(tmp_path):
    with pytest.raises(MechcError, match="install mechc again"):
        bench.bench([], home=tmp_path / "mechc")


def test_the_page_is_made_again_of_figures_measured_before(tmp_path, capsys):
    (tmp_path / "a.json").write_text(json.dumps(canned_results.results()))
    assert command.main([str(tmp_path / "a.json"), "--against", str(tmp_path / "a.json")]) == 0
    assert str(tmp_path / "a.html") in capsys.readouterr().out
    assert "0 worse, 0 better" in " ".join(read((tmp_path / "a.html").read_text()).texts)
