"""Whatever is typed after ``mechc``: an exit code that is meant, words that a terminal shows."""

import contextlib
import io

import pytest

from mechc.cli.commands import main
from tests.support.trust.fuzzing import run_cases

pytestmark = pytest.mark.slow

HOSTILE = [
    "", " ", "=", "==", "a=b", "\x1b[2J", "\ud800", "名前", "-", "--", "x" * 3000, "../..", "'",
    "%s", "{0}", "$HOME", "1e999", "-1", "0", "nan", "inf", "1_000", "٣", "10" * 200, "None",
    "[]", "NAME",
]  # fmt: skip
MECHANISMS = ["four_bar"] * 8 + ["pendulum", "planar_chain", "five_bar", ""]
NUMBERS = ["1", "0.5", "85deg", "3500mm", "1e-3", "30deg/s", "2min", "-0", "1e308", "5e-324", "1°"]
NAMES = ["theta_0", "theta_2", "omega_0", "l_3", "m_1", "g", "wheel", "time", "energy"]
OPTIONS = ["friction=x=y", "wheels", "name=x", "fix=1", "outputs=energy",
           "instruction_set=avx2", "crank_torque=__import__('os')", "crank_torque=1/0", "options",
           "crank_torque=log(tanh(tan(cos(1/t))**-12))"]  # fmt: skip
REDUCTIONS = ["max(theta_2)", "mean(energy)", "first(theta_0 > 1)", "min(abs(omega_0))",
              "max(points[1,0])", "max(points[9,9])", "max()", "first(theta_0)", "norm(x)",
              "max(" * 200, "range(norm(multipliers))", "max(theta_2[0])"]  # fmt: skip


def word(draw, good):
    found = draw.choice(good) if draw.random() < 0.8 else draw.choice(HOSTILE)
    if draw.random() < 0.05 and found:
        place = draw.randrange(len(found))
        found = found[:place] + draw.choice(HOSTILE[:20]) + found[place + draw.randrange(2) :]
    return found


def assignment(draw):
    return f"{word(draw, NAMES)}={word(draw, NUMBERS)}"


def variation(draw):
    ends = [word(draw, NUMBERS) for _ in range(draw.choice([1, 2, 2, 2, 3]))]
    return f"{word(draw, NAMES)}={':'.join([*ends, *draw.choice([[], ['3'], ['-1'], ['9' * 30]])])}"


def options(draw, *kinds):
    found = []
    for flag, values in kinds:
        while draw.random() < 0.35:
            found.append(flag)
            if values is not None:
                found.append(values(draw) if callable(values) else word(draw, values))
    return found


def line(draw):
    command = word(
        draw, ["list", "show", "run", "run", "run", "sweep", "sweep", "verify", "cache", "x"]
    )
    scene = [("--set", assignment)]
    start = [*scene, ("--start", assignment), ("--guess", assignment), ("--rtol", ["1e-6", "1e-9"]),
             ("--method", ["auto", "dop853", "gauss8", "radau5", "dopri5"])]  # fmt: skip
    if command in ("list", "cache", "x"):
        return [
            command,
            *options(draw, ("--clear-all", None), ("-v", None), (word(draw, ["-"]), None)),
        ]
    if command == "verify":
        return [command, word(draw, [".", "/dev/null", "nothing", "/"])]
    found = [command, word(draw, MECHANISMS)]
    if draw.random() < 0.1:
        found += ["--with", word(draw, OPTIONS)]
    if command == "show":
        return [*found, *options(draw, *scene, ("--latex", None))]
    found += options(draw, *start)
    found += ["--t-end", word(draw, ["0.01", "10ms", "0.02s"]) if draw.random() < 0.97 else "-1"]
    if command == "sweep":
        found += ["--vary", variation(draw)]
        found += options(draw, ("--vary", variation), ("--reduce", REDUCTIONS),
                         ("--seed", ["1", "x"]),
                         ("--sample", ["grid", "sobol", "lhs", "random", "odd"]),
                         ("--threads", ["1", "2", "0", "1000000"]))  # fmt: skip
        found += ["--count", word(draw, ["2", "4", "1", "0"])]
    return [*found, "--json"]


def test_any_command_line(seed, thorough, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)

    def case(draw):
        typed = line(draw)

        def call():
            out, err = io.StringIO(), io.StringIO()
            with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
                try:
                    code = main(typed)
                except SystemExit as left:  # argparse's
                    code = left.code
            told = out.getvalue() + err.getvalue()
            shown = all(c.isprintable() or c == "\n" for c in told)
            assert shown, (typed, told)
            assert code in (0, 1, 2), (typed, code, told)
            if code == 2:
                raise ValueError(err.getvalue())

        return call

    ended = run_cases(seed, thorough, 600, 5_000, case)
    assert ended["a value"] > 40
