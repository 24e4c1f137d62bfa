"""The command: what it prints, writes and returns."""

import io
import json
import os
import subprocess
import sys
import time
import tomllib
from importlib.machinery import EXTENSION_SUFFIXES
from importlib.metadata import PackageNotFoundError
from importlib.util import find_spec
from types import SimpleNamespace

import numpy as np
import pytest

from mechc import mechanisms
from mechc.cli import commands as cli
from mechc.cli import doctor
from mechc.cli.commands import main
from mechc.compilation import entries, toolchain
from mechc.progress import Notice
from mechc.results import figures as plot
from tests.support import ROOT
from tests.support.command_line import complaint, run_json, tells_only_what_takes_long

pytestmark = pytest.mark.usefixtures("here")
KEYS = {
    "mechanism", "t_end", "rtol", "method", "q_end", "u_end", "energy_drift", "closure_max",
    "velocity_closure_max", "steps", "rhs_evaluations", "wall_s", "change_points", "status",
}  # fmt: skip
REGULAR = ("run", "four_bar", "--set", "l_3=3.5")
DATA = {"solution.csv", "solution.nc", "animation.html"}
PICTURES = ("paths", "closure")


def test_json_is_one_object_with_the_promised_keys_and_writes_nothing(capsys, here):
    told = run_json(capsys, *REGULAR)
    assert set(told) >= KEYS
    assert told["mechanism"] == "four_bar"
    assert told["t_end"] == 20.0
    assert told["rtol"] == 1e-9
    assert told["method"] == "gauss8"
    assert told["status"] == "finished"
    assert told["change_points"] == []
    assert told["change_point_count"] == 0
    assert told["coordinates"] == ["theta_0", "theta_1", "theta_2"]
    assert told["closure_max"] < 1e-13
    np.testing.assert_allclose(told["q_end"], [1.494919254, 0.715671502, -0.878512790], atol=1e-6)
    np.testing.assert_allclose(told["u_end"], [0.319832066, -0.111142222, 0.074940564], atol=1e-6)
    assert list(here.iterdir()) == []


def test_what_is_typed_reaches_the_run(capsys):
    told = run_json(
        capsys, "run", "four_bar", "--start", "theta_0=60deg", "--start", "omega_0=30deg/s",
        "--set", "l_3=3500mm", "--set", "m_1=0.5", "--t-end", "1.5s", "--rtol", "1e-7",
        "--method", "dopri5",
    )  # fmt: skip
    assert told["t_end"] == 1.5
    assert told["rtol"] == 1e-7
    assert told["method"] == "dopri5"
    assert told["parameters"]["l_3"] == 3.5
    assert told["parameters"]["m_1"] == 0.5
    assert told["parameters"]["I_1"] == pytest.approx(0.5 * 4 / 12)


def test_a_guess_chooses_the_assembly(capsys):
    short = (*REGULAR, "--t-end", "1e-9", "--start", "theta_0=60deg")
    up = run_json(capsys, *short)["q_end"]
    down = run_json(capsys, *short, "--guess", "theta_1=-80deg")["q_end"]
    assert up[1] > up[2]
    assert down[1] < down[2]


def test_a_run_prints_a_summary_and_writes_pictures_animation_and_data(capsys, here, monkeypatch):
    few = {name: plot.PICTURES[name] for name in PICTURES}  # all of them: tests of mechc.plot
    monkeypatch.setattr(plot, "PICTURES", few)
    assert main([*REGULAR, "--t-end", "1", "--out", "deep/er"]) == 0
    said = capsys.readouterr()
    tells_only_what_takes_long(said.err)
    assert "Planar four-bar linkage, 0 to 1 s" in said.out
    assert "finished: reached t = 1 s" in said.out
    assert "l_3 = 3.5 m" in said.out
    assert "deg/s" in said.out
    folder = here / "deep" / "er"
    written = {path.name for path in folder.iterdir()}
    assert written == DATA | {f"{name}.{end}" for name in PICTURES for end in ("png", "svg")}
    assert all(path.stat().st_size > 1000 for path in folder.iterdir())
    assert str(folder) in said.out


def test_the_folder_is_named_after_the_mechanism(capsys, here, monkeypatch):
    monkeypatch.setattr("mechc.results.figures.save_all", lambda sol, folder: [])
    assert main([*REGULAR, "--t-end", "0.1"]) == 0
    assert {path.name for path in (here / "mechc_four_bar").iterdir()} == DATA


def test_no_folder_is_written_into_twice(capsys, here, monkeypatch):
    monkeypatch.setattr("mechc.results.figures.save_all", lambda sol, folder: [])
    short = (*REGULAR, "--t-end", "0.1")
    for number in range(3):
        assert main([*short]) == 0, number
    names = {"mechc_four_bar", "mechc_four_bar_2", "mechc_four_bar_3"}
    assert {path.name for path in here.iterdir()} == names
    before = (here / "mechc_four_bar" / "solution.csv").read_bytes()
    capsys.readouterr()
    longer = ("run", "four_bar", "--set", "l_3=3.5", "--t-end", "0.2", "--out", "mechc_four_bar")
    said = complaint(capsys, *longer)
    assert said == "mechc: mechc_four_bar exists: --force replaces it, or name another\n"
    assert (here / "mechc_four_bar" / "solution.csv").read_bytes() == before
    assert main([*longer, "--force"]) == 0
    assert (here / "mechc_four_bar" / "solution.csv").read_bytes() != before


@pytest.mark.parametrize(
    "arguments",
    [
        ("run", "four_bar", "--t-end", "0.1", "--json", "--view", "kept.html"),
        ("show", "four_bar", "--out", "kept.html"),
        ("emit", "four_bar", "--out", "."),
        ("export", "four_bar", "--c", "--out", "."),
        ("export", "four_bar", "--fmu", "--out", "kept.html"),
        ("sweep", "four_bar", "--vary", "l_3=3:4:2", "--out", "."),
    ],
    ids=lambda arguments: " ".join(arguments[::2]),
)
def test_no_file_is_overwritten_without_a_word(capsys, here, arguments):
    (here / "kept.html").write_text("mine")
    assert "exists: " in complaint(capsys, *arguments)
    assert (here / "kept.html").read_text() == "mine"
    assert [path.name for path in here.iterdir()] == ["kept.html"]


def test_json_with_a_folder_prints_the_object_alone_and_writes(capsys, here, monkeypatch):
    monkeypatch.setattr("mechc.results.figures.save_all", lambda sol, folder: [])
    told = run_json(capsys, *REGULAR, "--t-end", "0.1", "--out", "out")
    assert told["status"] == "finished"
    assert {path.name for path in (here / "out").iterdir()} == DATA


def test_that_it_draws_is_told(here, capsys, monkeypatch):
    monkeypatch.setattr("mechc.progress.SILENCE", 0.0)
    monkeypatch.setattr("mechc.results.figures.save_all", lambda sol, folder: time.sleep(0.1))
    assert main([*REGULAR, "--t-end", "0.1"]) == 0
    assert "drawing ...\n" in capsys.readouterr().err


def test_the_browser_is_opened_on_a_desktop_only(monkeypatch, capsys):
    opened = []
    monkeypatch.setattr("mechc.results.figures.save_all", lambda sol, folder: [])
    monkeypatch.setattr("webbrowser.open", opened.append)
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(cli.sys, "platform", "linux")
    page = "view" if find_spec("jupyter_threejs_sage") else "animation"
    assert main([*REGULAR, "--t-end", "0.1", "--open"]) == 0
    assert opened == []
    said = capsys.readouterr().out
    assert f"/{page}.html in a browser" in said
    assert f"  {page}.html" in said
    monkeypatch.setenv("DISPLAY", ":0")
    assert main([*REGULAR, "--t-end", "0.1", "--open"]) == 0
    assert [address.startswith("file:///") for address in opened] == [True]
    assert opened[0].endswith(f"/{page}.html")


def test_the_view_is_written_where_it_is_asked_for(tmp_path, capsys):
    pytest.importorskip("jupyter_threejs_sage", reason="jupyter-threejs-sage is not installed")
    page = tmp_path / "made" / "view.html"
    run_json(capsys, *REGULAR, "--t-end", "0.1", "--view", str(page))
    assert "Content-Security-Policy" in page.read_text("utf-8")
    assert main([*REGULAR, "--t-end", "0.1", "--json", "--view", str(tmp_path / "view.txt")]) == 2
    assert ".html, .png, .gif or .mp4" in capsys.readouterr().err


def test_list_names_the_library_and_when_it_is_compiled(capsys):
    assert main(["list"]) == 0
    said = capsys.readouterr().out.splitlines()
    assert len(said) == len(mechanisms())
    for name, title, when in (
        ("four_bar", "Planar four-bar linkage", "compiled at install"),
        ("andrews", "Andrews' squeezing mechanism", "compiled at its first use"),
    ):
        line = next(line for line in said if line.startswith(name))
        assert title in line
        assert line.endswith(when)


def test_show_tells_names_units_geometry_and_options(capsys, here):
    assert main(["show", "four_bar", "--set", "l_3=3.5"]) == 0
    assert list(here.iterdir()) == []  # nothing is written unasked
    assert main(["show", "four_bar", "--set", "l_3=3.5", "--out", "four_bar.html"]) == 0
    said = capsys.readouterr().out
    for text in (
        "length of the crank", "rad/s", "kg m^2", "Grashof class: ", "Limits of theta_0: ",
        "Change points: none", "crank_torque", "coupler_point",
    ):  # fmt: skip
        assert text in said
    page = (here / "four_bar.html").read_text("utf-8")
    assert "<math" in page
    assert "://" not in page.replace("http://www.w3.org/", "")
    assert str(here / "four_bar.html") in said


@pytest.mark.parametrize(
    "command",
    [
        ["show", "four_bar", "--out", "page.pdf"],
        ["show", "four_bar", "--latex", "--out", "page.html"],
        ["run", "windows", "--with", "count=13", "--rtol", "banana"],
        ["run", "windows", "--with", "count=13", "--rtol", "2"],
        ["run", "windows", "--with", "count=13", "--start", "nobody=1"],
        ["sweep", "windows", "--with", "count=13", "--vary", "l=1:2:3", "--set", "nobody=1"],
    ],
)
def test_what_is_refused_is_refused_before_anything_is_compiled(command, capsys, here, monkeypatch):
    monkeypatch.setattr(
        "mechc.compilation.library.library.compile_described", lambda *_: pytest.fail("compiled")
    )
    assert main(command) == 2
    assert capsys.readouterr().err.startswith("mechc: ")
    assert list(here.iterdir()) == []


def test_show_finds_the_change_points_of_the_default_lengths(capsys, here):
    assert main(["show", "four_bar", "--latex", "--out", "page.tex"]) == 0
    said = capsys.readouterr().out
    assert "change-point linkage" in said
    assert "theta_0 = 180, theta_1 = 0, theta_2 = 0 deg" in said
    assert (here / "page.tex").read_text("utf-8").startswith("\\documentclass")


def test_emit_prints_the_program_or_writes_all_of_it(capsys, here):
    assert main(["emit", "four_bar"]) == 0
    program = capsys.readouterr().out
    assert "closure" in program
    assert main(["emit", "four_bar", "--out", "c"]) == 0
    written = {path.name for path in (here / "c").iterdir()}
    assert {"scene_program.h", "scene_model.c", "scene_baseline.c"} <= written
    assert (here / "c" / "scene_program.h").read_text("utf-8") == program.removesuffix("\n")


def test_doctor_checks_compiler_cache_and_packages(capsys):
    assert main(["doctor"]) == 0
    said = capsys.readouterr().out
    for name in ("numpy", "sympy", "matplotlib", "four_bar", "units", "C compiler", "cache"):
        assert f"ok   {name}" in said
    assert "BAD" not in said


def test_doctor_lists_every_extra_and_what_it_lacks(capsys, monkeypatch):
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
    extras = extras["project"]["optional-dependencies"]
    there = doctor.version

    def without_zarr(name):
        if name == "zarr":
            raise PackageNotFoundError
        return there(name)

    monkeypatch.setattr(doctor, "version", without_zarr)
    assert main(["doctor"]) == 0
    lines = [line.split(maxsplit=3) for line in capsys.readouterr().out.splitlines()]
    told = {line[2]: line[3] for line in lines if line[1] == "extra"}
    assert set(told) == set(extras)
    for extra in ("zarr", "all"):  # one that lacks it, and one that names the first
        assert told[extra].startswith("not installed: ")
        assert "zarr" in told[extra]
        assert told[extra].endswith(f"pip install '.[{extra}]' in the clone of mechc")
    assert told["view"] == "jupyter-threejs-sage"


def test_doctor_says_what_is_wrong_and_fails(capsys, here, monkeypatch):
    (here / "cache").mkdir()
    (here / "cache").chmod(0o777)
    monkeypatch.setenv("MECHC_CACHE_DIR", str(here / "cache"))
    monkeypatch.setattr(toolchain, "find_compiler", lambda: None)
    monkeypatch.setattr(entries, "_INSTALLED", here / "no units")
    assert main(["doctor"]) == 1
    bad = [line for line in capsys.readouterr().out.splitlines() if line.startswith("BAD")]
    assert len(bad) == 2
    assert "install gcc or clang" in bad[0]
    assert "can be written by others: chmod 700" in bad[1]


def test_doctor_says_what_runs_without_a_compiler(capsys, here, monkeypatch):
    (here / f"open_avx2{EXTENSION_SUFFIXES[0]}").touch()
    (here / f"loops_avx512{EXTENSION_SUFFIXES[0]}").touch()
    monkeypatch.setattr(entries, "_INSTALLED", here)
    monkeypatch.setattr(entries, "native", lambda: SimpleNamespace(lanes=4))
    monkeypatch.setattr(toolchain, "find_compiler", lambda: None)
    assert main(["doctor"]) == 0
    told = {line[5:].split("  ")[0]: line for line in capsys.readouterr().out.splitlines()}
    assert told["units"].endswith(" open_avx2")
    assert "motions run by tapes" in told["C compiler"]
    assert "pip install '.[compiler]'" in told["C compiler"]


def test_cache_tells_what_it_holds_and_clears_only_that(capsys, here, monkeypatch):
    monkeypatch.setenv("MECHC_CACHE_DIR", str(here))
    here.chmod(0o700)
    key = "0123456789abcdef" * 4
    (here / key).mkdir()
    (here / key / "scene.so").write_bytes(b"x" * 2048)
    (here / f"{key}.lock").touch()
    (here / "letters").mkdir()
    (here / "poetry.lock").touch()
    assert main(["cache"]) == 0
    assert "1 compiled scenes" in capsys.readouterr().out
    assert main(["cache", "--clear"]) == 0
    assert "removed 1 compiled scenes" in capsys.readouterr().out
    assert {path.name for path in here.iterdir()} == {"letters", "poetry.lock"}
    assert main(["cache", "--clear"]) == 0


def test_version_and_help(capsys):
    for arguments, text in ((["--version"], "mechc "), (["run", "--help"], "--t-end")):
        with pytest.raises(SystemExit) as end:
            main(arguments)
        assert end.value.code == 0
        assert text in capsys.readouterr().out


def command(*arguments, **environment):
    return subprocess.run(
        [sys.executable, "-m", "mechc", *arguments],
        capture_output=True, text=True, check=False, env={**os.environ, **environment},
    )  # fmt: skip


def test_the_module_is_the_same_program():
    done = command(*REGULAR, "--json", "--t-end", "2")
    assert done.returncode == 0
    tells_only_what_takes_long(done.stderr)
    assert json.loads(done.stdout)["status"] == "finished"


def test_a_reader_that_goes_away_is_no_traceback(here):
    done = subprocess.run(
        f"'{sys.executable}' -m mechc emit four_bar | head -c 1",
        shell=True, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert "Traceback" not in done.stderr
    assert "Exception" not in done.stderr


def test_importing_mechc_loads_neither_sympy_nor_matplotlib():
    heavy = "{'sympy', 'matplotlib', 'scipy.integrate', 'xarray', 'mechc_codegen'}"
    script = f"import sys, mechc; mechc.load('four_bar'); print(sorted({heavy} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, check=True)
    assert done.stdout.strip() == b"[]"


@pytest.mark.parametrize("typed", ["0.5", "0.5s", "500ms", "500 ms"])
def test_the_time_is_typed_with_a_unit_or_in_seconds(capsys, here, typed):
    assert main(["run", "four_bar", "--t-end", typed, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["t_end"] == 0.5


class Terminal(io.StringIO):
    def isatty(self):
        return True


def test_a_notice_is_given_on_a_terminal_after_a_while_and_taken_away(monkeypatch):
    screen = Terminal()
    monkeypatch.setattr(sys, "stderr", screen)
    with Notice("compiling"):
        pass
    assert screen.getvalue() == ""
    monkeypatch.setattr("mechc.progress.PATIENCE", 0.0)
    with Notice("compiling") as notice:
        notice._timer.join()
        assert screen.getvalue() == "compiling"
    assert screen.getvalue().endswith("\r         \r")


def test_a_notice_is_a_line_where_there_is_no_terminal(monkeypatch, capsys):
    with Notice("compiling"):
        pass
    assert capsys.readouterr().err == ""
    monkeypatch.setattr("mechc.progress.SILENCE", 0.0)
    with Notice("compiling") as notice:
        notice._timer.join()
    assert capsys.readouterr().err == "compiling\n"
