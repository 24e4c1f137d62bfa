"""``mechc fit``: CSV files in, values and a picture out."""

import csv
import itertools
import json

import numpy as np
import pytest

import mechc
from mechc.cli import fit
from mechc.cli.commands import main
from mechc.fitting.problem import Problem
from tests.support.command_line import complaint, run_json

pytestmark = pytest.mark.usefixtures("here")
TIMES = np.linspace(0.0, 3.0, 61)


@pytest.fixture
def recording(here):
    """A pendulum of 1.3 m in ms, degrees and mm, with gaps and a column that it does not know."""
    model = mechc.load("pendulum", outputs=("energy", "points", "sensitivities"))
    start = {"theta_0": 0.8, "omega_0": 0.3}
    sol = model.simulate(3.0, start, {"l_0": 1.3}, t_eval=TIMES, rtol=1e-12)
    with (here / "swing.csv").open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["t [ms]", "theta_0 [deg]", "points[p_1,x] [mm]", "remark"])
        for k, (t, y) in enumerate(zip(TIMES, sol.y, strict=True)):
            angle = "" if k % 7 == 3 else np.degrees(y[0])
            writer.writerow([1e3 * t, angle, 1e3 * model.points(y, sol.params)[1, 0], ""])
    return "swing.csv"


FREE = ("--free", "l_0=10cm:300cm", "--free", "theta_0", "--free", "omega_0=-90deg/s:90deg/s")


def test_values_pictures_and_numbers(recording, here, capsys):
    sigmas = ("--measure", "theta_0=0.5deg", "--measure", "points[p_1,x]=5mm")
    assert main(["fit", "pendulum", recording, *FREE, *sigmas]) == 0
    said = capsys.readouterr().out
    assert "3 values from 113 samples" in said
    assert "theta_0       45.8366 °" in said
    folder = here / "mechc_fit_pendulum"
    assert {path.name for path in folder.iterdir()} == {"fit.png", "fit.svg", "fit.json"}
    assert json.loads((folder / "fit.json").read_text())["values"]["l_0"] == pytest.approx(1.3)


def test_json_and_columns_by_default(recording, here, capsys):
    start = ("--start", "theta_0=0.8", "--start", "omega_0=0.3")
    told = run_json(capsys, "fit", "pendulum", recording, "--free", "l_0=0.1:9", *start)
    assert told["values"]["l_0"] == pytest.approx(1.3, rel=1e-7)
    assert set(told["residual_rms"]) == {"theta_0", "points[p_1,x]"}
    assert [path.name for path in here.iterdir()] == [recording]


def test_ctrl_c_writes_the_best_values(recording, here, monkeypatch):
    calls, inner = itertools.count(), Problem.jacobian

    def interrupt(self, x):
        if next(calls) == 2:
            raise KeyboardInterrupt
        return inner(self, x)

    monkeypatch.setattr(Problem, "jacobian", interrupt)
    assert main(["fit", "pendulum", recording, *FREE]) == 130
    told = json.loads((here / "mechc_fit_pendulum" / "fit.json").read_text())
    assert told["message"] == "it was interrupted"


@pytest.mark.parametrize(
    ("typed", "words"),
    [
        ((), "say what is to be found"),
        (("--free", "l_0=3"), "NAME=LOW:HIGH"),
        (("--free", "l_9=1:3"), "did you mean 'l_0'"),
        (("--free", "l_0=1kg:3kg"), "'kg' in '1kg' is not one of its units"),
        (("--free", "l_0", "--measure", "omega_0"), "no column of swing.csv is called 'omega_0'"),
        (("--free", "l_0", "--measure", "theta_0=-1"), "must be a positive number"),
        (("--free", "l_0", "--starts", "3"), "give a free value both bounds"),
    ],
)
def test_what_is_wrong_is_said_in_a_line(recording, typed, words, capsys):
    assert words in complaint(capsys, "fit", "pendulum", recording, *typed)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "is empty"),
        ("theta_0\n1\n", "has no column 't'"),
        ("t,theta_0\n0,1\n1,two\n", "line 3"),
        ("t,alpha\n0,1\n1,2\n", "no column is a quantity of pendulum"),
        ("t [fortnight],theta_0\n0,1\n1,2\n", "'fortnight' is not one of its units"),
        ("t,theta_0" + "x" * 200_000 + "\n0,1\n", "is no CSV file: field larger"),
        ("t,theta_0\n0,\udcff\n", "is no CSV file: 'utf-8'"),
    ],
)
def test_files_that_are_wrong(here, text, words, capsys):
    (here / "bad.csv").write_text(text, "utf-8", "surrogateescape")
    assert words in complaint(capsys, "fit", "pendulum", "bad.csv", "--free", "l_0")


def test_files_without_bounds_are_refused(here, monkeypatch, capsys):
    """A device without an end; a header with more columns than its rows have cells."""
    monkeypatch.setattr(fit, "LARGEST", 2**20)
    (here / "wide.csv").write_text("t" + ",x" * 5000 + "\n" + "1\n" * 5000)
    monkeypatch.setattr(fit, "MOST_NUMBERS", 10_000)
    for path, words in (("/dev/zero", "is larger than 1 MiB"), ("wide.csv", "more than 10000")):
        assert words in complaint(capsys, "fit", "pendulum", path, "--free", "l_0")
        design = ("--free", "l_0=0.1:2")
        assert words in complaint(capsys, "synthesize", "four_bar", path, *design)
