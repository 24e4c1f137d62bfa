"""Bad input at the command line: one line on stderr, exit code 2, no traceback, no litter."""

import os
import signal
import subprocess
import sys
import time

import pytest

import mechc
from mechc import Model
from mechc.cli.commands import main
from tests.support.command_line import complaint, tells_only_what_takes_long, without_progress

pytestmark = pytest.mark.usefixtures("here")
RUN = ("run", "four_bar", "--json")


@pytest.mark.parametrize("typed", ["\x1b[2J", "a\nb", "\udcff"])
def test_what_was_typed_does_not_steer_the_terminal(capsys, typed):
    for arguments in (("list", "-v", typed), (typed,), ("run", typed), (*RUN, "--method", typed)):
        assert complaint(capsys, *arguments).strip("\n").isprintable()


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (("run", "fuor_bar"), "did you mean 'four_bar'"),
        (("show", "fourbar"), "did you mean 'four_bar'"),
        (("emit", "4bar"), "'four_bar'"),
        ((*RUN, "--set", "l3=3.5"), "did you mean 'l_3'"),
        ((*RUN, "--set", "theta_0=1"), "no parameter is called 'theta_0'"),
        ((*RUN, "--start", "theta0=1"), "did you mean 'theta_0'"),
        ((*RUN, "--start", "l_3=1"), "no coordinate or speed is called 'l_3'"),
        ((*RUN, "--guess", "omega_0=1"), "no coordinate is called 'omega_0'"),
        ((*RUN, "--with", "frction"), "did you mean 'friction'"),
        ((*RUN, "--method", "dop583"), "did you mean 'dop853'"),
        (("show", "four_bar", "--set", "l_9=1"), "no parameter is called 'l_9'"),
    ],
)
def test_unknown_names_are_met_with_the_nearest(capsys, here, arguments, told):
    assert told in complaint(capsys, *arguments)
    assert list(here.iterdir()) == []


@pytest.mark.parametrize("value", ["0", "-1", "nan", "inf", "-inf", "1e999"])
@pytest.mark.parametrize("name", ["l_0", "m_1", "I_2"])
def test_lengths_masses_and_inertias_are_positive_and_finite(capsys, name, value):
    said = complaint(capsys, *RUN, "--set", f"{name}={value}")
    assert f"{name} = " in said
    assert "must be finite and > 0" in said


@pytest.mark.parametrize("value", ["0", "-1", "-1e-300", "nan", "inf", "soon", "20m", "1e999"])
def test_the_end_lies_ahead(capsys, value):
    complaint(capsys, *RUN, f"--t-end={value}")


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (("--start", "theta_0=85degg"), "'degg'"),
        (("--start", "theta_0=85mm"), "'mm'"),
        (("--start", "theta_0"), "NAME=VALUE"),
        (("--start", "theta_0="), "NAME=VALUE"),
        (("--start", "theta_0=nan"), "theta_0 = nan is not a finite number"),
        (("--start", "omega_0=inf"), "omega_0 = inf is not a finite number"),
        (("--start", "theta_0=1e308rad"), "theta_0 = 1e+308: its square overflows"),
        (("--set", "l_3=3.5 furlongs"), "'furlongs'"),
        (("--set", "l_3=3,5"), "l_3"),
        (("--set", "l_3=__import__('os')"), "is not a number"),
        (("--set", "l_3=3", "--set", "l_3=4"), "l_3 is given twice"),
        (("--set", "l_3=9"), "the least gap met is 3.96834 m"),
        (("--set", "a\nb=1"), "'a\\nb'"),
        (("--rtol", "0"), "--rtol must be between 0 and 1, not 0"),
        (("--rtol", "nan"), "--rtol must be between 0 and 1, not nan"),
        (("--rtol", "tight"), "--rtol must be a number"),
        (("--with", "crank_torque=sin("), "sin("),
        (("--with", "crank_torque=__import__('os').system('x')"), "__import__"),
        (("--with", "crank_torque="), "cannot read ''"),
        (("--with", "friction=2"), "friction"),
        (("--start", "omega_0=1", "--start", "omega_1=9"), "no speeds with"),
        (("--wat",), "unrecognized arguments: --wat"),
    ],
    ids=lambda value: None if isinstance(value, str) else " ".join(value),
)
def test_nonsense_is_told_in_one_line(capsys, arguments, told):
    assert told in complaint(capsys, *RUN, *arguments)


def test_no_command_at_all_is_told_in_one_line(capsys):
    assert "COMMAND" in complaint(capsys)
    assert "'fly'" in complaint(capsys, "fly")


@pytest.mark.parametrize("command", ["run", "emit"])
def test_a_folder_that_cannot_be_made_is_told_before_any_work(capsys, here, command):
    (here / "file").touch()
    for folder in ("file", "file/below"):
        assert "file" in complaint(capsys, command, "four_bar", "--out", folder)


def test_a_folder_that_cannot_be_written_is_told(capsys, here, monkeypatch):
    def refuse(*_, **__):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr("pathlib.Path.touch", refuse)
    said = complaint(capsys, *RUN, "--out", "out")
    assert said == "mechc: cannot write into out: Permission denied\n"


def test_bad_input_leaves_no_folder_behind(capsys, here):
    complaint(capsys, "run", "four_bar", "--set", "l_3=-1", "--out", "out")
    complaint(capsys, "run", "four_bar", "--rtol", "tight", "--out", "out")
    complaint(capsys, "run", "four_bar", "--method", "euler", "--out", "out/below")
    assert list(here.iterdir()) == []


def without_matplotlib(monkeypatch):
    for name in [name for name in sys.modules if name.split(".")[0] == "matplotlib"]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "matplotlib", None)


def test_without_matplotlib_what_was_computed_is_written_all_the_same(capsys, here, monkeypatch):
    without_matplotlib(monkeypatch)
    assert main(["run", "four_bar", "--set", "l_3=3.5", "--t-end", "1", "--out", "out"]) == 2
    said = capsys.readouterr()
    assert without_progress(said.err) == (
        "mechc: matplotlib is not installed: pip install matplotlib (or run with --json)\n"
    )
    written = {path.name for path in (here / "out").iterdir()}
    assert written == {"solution.csv", "solution.nc", "animation.html"}
    assert mechc.open(here / "out" / "solution.nc").status.ok


def test_without_matplotlib_json_is_as_before(capsys, monkeypatch):
    without_matplotlib(monkeypatch)
    assert main([*RUN, "--set", "l_3=3.5"]) == 0
    tells_only_what_takes_long(capsys.readouterr().err)


def test_a_run_that_ends_early_is_reported_and_fails(capsys, monkeypatch):
    """Exit code 1: the input was sound, the run did not get to its end."""
    inner = Model.simulate
    monkeypatch.setattr(Model, "simulate", lambda *a, **k: inner(*a, **k | {"max_steps": 10}))
    assert main([*RUN, "--set", "l_3=3.5"]) == 1
    assert '"status": "too many steps"' in capsys.readouterr().out


DRAWS_NOTHING = """\
import sys
from mechc.cli import commands as cli
from mechc.results import figures as plot
plot.save_all = lambda sol, folder: (folder / "drawn").touch()
sys.exit(cli.main())
"""


def process(
    *arguments, program="import sys; from mechc.cli.commands import main; sys.exit(main())"
):
    return subprocess.Popen(
        [sys.executable, "-c", program, *arguments],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip


def test_a_real_process_complains_in_one_line_too():
    with process(*RUN, "--set", "l_3=-1") as running:
        out, err = running.communicate(timeout=60)
    assert running.returncode == 2
    assert out == ""
    assert err == "mechc: l_3 = -1 m (length of the ground) must be finite and > 0\n"


@pytest.mark.slow
def test_ctrl_c_writes_what_was_computed(here):
    """A run of many minutes, interrupted once it is under way."""
    arguments = ("--set", "l_3=3.5", "--t-end", "1e6", "--rtol", "1e-6", "--out", "out")
    with process(*RUN, *arguments, program=DRAWS_NOTHING) as running:
        wait_for(here / "out")
        time.sleep(0.4)
        os.kill(running.pid, signal.SIGINT)
        out, err = running.communicate(timeout=120)
    assert running.returncode == 130
    assert all(line.endswith(" ...") for line in err.splitlines()), err  # what it waits for
    assert '"status": "interrupted"' in out
    assert (here / "out" / "solution.csv").stat().st_size > 1000
    assert (here / "out" / "drawn").exists()


def test_ctrl_c_in_a_sweep_draws_what_was_computed(here, capsys, monkeypatch):
    def interrupt(self, done):
        if done > 0:
            raise KeyboardInterrupt

    monkeypatch.setattr("mechc.batch.simulate.CountBar.update_count", interrupt)
    varied = ("--vary", "l_3=3.4:3.6:2000", "--t-end", "200", "--threads", "1", "--out", "out")
    assert main(["sweep", "four_bar", *varied]) == 130
    assert "not run" in capsys.readouterr().out
    assert (here / "out" / "map_0.png").exists()


def wait_for(path, seconds=30.0):
    deadline = time.monotonic() + seconds
    while not path.exists() and time.monotonic() < deadline:
        time.sleep(0.02)
