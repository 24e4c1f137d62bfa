"""The options of the commands, and a parser with one-line errors."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from typing import Any

from mechc.results.untrusted import printable

BAD_INPUT, INTERRUPTED = 2, 130  # exit codes
EPILOGUE = """\
examples:
  mechc run four_bar                          the reference scene: 85 deg, at rest, 20 s
  mechc run four_bar --set l_3=3.5 --start theta_0=60deg --start omega_0=30deg/s
  mechc run four_bar --with friction --set c_0=0.5 --json
  mechc sweep four_bar --vary l_3=3.4:4.6:61 --vary theta_0=60deg:120deg:31 --t-end 5
  mechc fit four_bar data.csv --free m_1=0.1:5   masses from a recorded motion
  mechc synthesize four_bar points.csv --with coupler_point --free l_1=0.1:5 --free x_C=-2:2
  mechc show four_bar --set l_3=3.5           Grashof class, parameters, options
  mechc show robot.urdf                       loops, ranges of joints, impossible inertias
  mechc run pendulum --with links=5 --open    compiled at the first use, then cached
  mechc run robot.py:model --t-end 5          a model that a Python file defines
  mechc run cart.py:model --input F='3*sin(4*t)'     the law of its input F
  mechc export four_bar --c --out plain       C99 for other programs
  mechc export four_bar --wasm                a page that simulates, with sliders
  mechc export four_bar --fmu                 a functional mock-up unit (FMI 3.0)
  mechc bench --quick                         run time against error, with a report
"""
# The suite parses its options: no argument begins with this prefix, so none is an option here.
SUITE: Mapping[str, Any] = {
    "help": "the benchmark suite, with a report", "add_help": False, "prefix_chars": "\0",
}  # fmt: skip


SWEEP_EPILOGUE = """\
examples:
  mechc sweep four_bar --vary l_3=3.4:4.6:61 --vary theta_0=60deg:120deg:31 --t-end 5
  mechc sweep four_bar --vary l_3=3.4:3.6 --vary m_1=1kg:3kg --sample sobol --count 4096 \\
      --reduce 'max(theta_2)' --reduce 'range(energy)' --method dop853 --out study

reductions: min, max, mean, range or final of a quantity, or first(QUANTITY > LEVEL); a quantity is
a coordinate, a speed, energy or an output: abs(omega_0), norm(multipliers), points[p_3,y].
The same command resumes a sweep that was stopped; mechc.open('study/batch') reads the data.
"""

FIT_EPILOGUE = """\
examples:
  mechc fit four_bar data.csv --free m_1=0.1:5 --free theta_0 --measure theta_0=0.5deg
  mechc fit pendulum first.csv second.csv --free l_0=0.1:3 --free theta_0 --starts 64 --json

columns have the names of coordinates, speeds, energy, or points[2,0], and may have a unit:
t [s], theta_0 [deg].  Each file is a recording with a start of its own.
"""


SYNTHESIS_EPILOGUE = """\
examples:
  mechc synthesize four_bar points.csv --with coupler_point --with placed --turns \\
      --free l_0=0.1:2 --free l_1=0.1:2 --free l_2=0.1:2 --free l_3=0.1:2 --free x_C=-2:2 \\
      --free y_C=-2:2 --free x_O=-2:2 --free y_O=-2:2 --free alpha=-180deg:180deg
  mechc synthesize four_bar log.csv --free l_0=0.1:5 --free l_1=0.1:5 --free l_2=0.1:5 \\
      --set l_3=1 --free theta_0 --free theta_2

a row for each position, its columns: points 'C.x [mm]', 'C.y [mm]', coordinates 'theta_2 [deg]' and
outputs; the driven coordinate where its values are given.  Empty cells are not asked for.
"""


class Parser(argparse.ArgumentParser):
    """An argparse parser whose errors are one line."""

    def error(self, message: str) -> Any:
        words = " ".join(["mechc", *self.prog.split()[1:], "--help"])
        self.exit(BAD_INPUT, f"mechc: {printable(message)} (see {words})\n")


def variant_options(parser: argparse.ArgumentParser) -> None:
    """Add arguments for a mechanism and its options."""
    parser.add_argument(
        "name", metavar="NAME",
        help="a mechanism of `mechc list`, FILE.py:MODEL, a user-defined one in a Python file, a "
        "robot in FILE.urdf or FILE.sdf, or a model of MuJoCo in FILE.xml",
    )  # fmt: skip
    several(
        parser, "--with", "OPTION[=VALUE]", "options",
        "an option of the mechanism, e.g. friction, crank_torque='2*sin(t)', links=5",
    )  # fmt: skip


def suite_options(parser: argparse.ArgumentParser) -> argparse.ArgumentParser:
    """Add the options of the suite to a parser."""
    parser.add_argument("options", nargs="*")
    return parser


def scene_options(parser: argparse.ArgumentParser) -> None:
    """Add arguments for a mechanism and its parameters."""
    variant_options(parser)
    several(
        parser, "--set", "NAME=VALUE", "parameters",
        "a parameter, in SI units or with its unit: l_3=3.5, l_3=3500mm",
    )  # fmt: skip


def run_options(parser: argparse.ArgumentParser) -> None:
    """Add arguments for one run: a scene, its start, and its output."""
    _start_options(parser)
    parser.add_argument("--open", action="store_true", help="open the motion in space in a browser")
    parser.add_argument(
        "--check", action="store_true",
        help="compute it again by another method, judge its equations, and print what is found",
    )  # fmt: skip
    parser.add_argument(
        "--view", metavar="FILE", help="the motion in space as FILE.html, .png, .gif or .mp4"
    )
    force_option(parser)


def sweep_options(parser: argparse.ArgumentParser) -> None:
    """Add arguments for many runs: what varies, and the reductions."""
    parser.epilog = SWEEP_EPILOGUE
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    _start_options(parser)
    several(
        parser, "--vary", "NAME=LOW:HIGH[:COUNT]", "vary",
        "vary from LOW to HIGH; in a grid with COUNT values",
    )  # fmt: skip
    parser.add_argument("--sample", default="grid", help="grid, random, sobol or lhs [grid]")
    parser.add_argument("--count", metavar="N", help="number of members that are drawn [1024]")
    parser.add_argument("--seed", default="0", metavar="N", help="seed of the random numbers [0]")
    several(
        parser, "--reduce", "REDUCTION", "reduce",
        "a map of it, e.g. 'max(theta_2)' or 'first(theta_0 > 180deg)'; may be repeated",
    )  # fmt: skip
    parser.add_argument("--threads", metavar="N", help="[all cores]")


def force_option(parser: argparse.ArgumentParser) -> None:
    """Add the option to replace files that are there."""
    parser.add_argument("--force", action="store_true", help="replace files that are there")


def _start_options(parser: argparse.ArgumentParser) -> None:
    _state_options(parser)
    _run_options(parser)


def _run_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--rtol", default="1e-9", metavar="TOL", help="relative tolerance [1e-9]")
    parser.add_argument(
        "--method",
        default="auto",
        help="auto, dopri5, dop853, radau5, gauss8 or taylor [auto]",
    )
    several(
        parser, "--input", "NAME=VALUE", "inputs",
        "an input of a user-defined model: a number, F=2, or an expression of time, coordinates, "
        "speeds and parameters, 'F=3*sin(4*t) - c*v'",
    )  # fmt: skip
    _output_options(parser)


def _output_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--out",
        metavar="DIR",
        help="folder for pictures and data [mechc_NAME, or the next free number]",
    )
    parser.add_argument(
        "--json", action="store_true", help="print one JSON object; write only with --out"
    )


def export_options(parser: argparse.ArgumentParser) -> None:
    """Add arguments for an export, and for the run of its example."""
    _state_options(parser)
    parser.add_argument(
        "--c", action="store_true", help="C99 files: header, source, example, CMake"
    )
    parser.add_argument("--float", action="store_true", help="with --c: single precision")
    parser.add_argument(
        "--fmu", action="store_true",
        help="a functional mock-up unit: model exchange and co-simulation, compiled, with its C",
    )  # fmt: skip
    parser.add_argument(
        "--wasm", action="store_true",
        help="WebAssembly with a module of JavaScript, and a page with sliders that simulates live",
    )  # fmt: skip
    parser.add_argument("--fmi", metavar="VERSION", help="with --fmu: 3.0 or 2.0 [3.0]")
    parser.add_argument(
        "--no-derivatives", action="store_true",
        help="with --fmu: no directional and adjoint derivatives; faster for a large mechanism",
    )  # fmt: skip
    parser.add_argument("--prefix", metavar="WORD", help="prefix of C names [the mechanism's]")
    parser.add_argument(
        "--out",
        metavar="PATH",
        help="folder of --c and --wasm [mechc_export_NAME], file of --fmu [NAME.fmu]",
    )
    force_option(parser)


def fit_options(parser: argparse.ArgumentParser) -> None:
    """Add arguments for a fit: a scene, recordings, unknowns and measured quantities."""
    parser.epilog = FIT_EPILOGUE
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    _given_start(parser)
    parser.add_argument(
        "data", metavar="FILE.csv", nargs="+",
        help="recordings: a header with a column 't', one row a time, empty cells where missing",
    )  # fmt: skip
    several(
        parser, "--free", "NAME[=LOW:HIGH]", "free",
        "a parameter, or a coordinate or speed of the start, to be found",
    )  # fmt: skip
    several(
        parser, "--measure", "NAME[=SIGMA]", "measure",
        "a column, and the standard deviation of its noise [all columns, noise not known]",
    )  # fmt: skip
    parser.add_argument("--starts", default="1", metavar="N", help="begin at N points [1]")
    parser.add_argument("--seed", default="0", metavar="N", help="seed of these points [0]")
    parser.add_argument(
        "--loss", default="linear", help="linear, soft_l1, huber, cauchy or arctan [linear]"
    )
    parser.add_argument("--f-scale", default="1", metavar="X", help="scale of the loss, sigmas [1]")
    _run_options(parser)
    force_option(parser)


def synthesis_options(parser: argparse.ArgumentParser) -> None:
    """Add arguments for a synthesis: a scene, targets, unknowns and conditions."""
    parser.epilog = SYNTHESIS_EPILOGUE
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    scene_options(parser)
    parser.add_argument("data", metavar="FILE.csv", help="the targets, a row for each position")
    several(
        parser, "--free", "NAME[=LOW:HIGH]", "free",
        "a parameter to be found, or a coordinate whose zero is",
    )  # fmt: skip
    parser.add_argument("--driven", metavar="NAME", help="the driven coordinate [the first]")
    parser.add_argument("--turns", action="store_true", help="it has to turn fully")
    parser.add_argument("--any-order", action="store_true", help="positions in any order")
    several(
        parser, "--transmission", "BEFORE,JOINT,BEHIND,LEAST", "transmission",
        "points and the least transmission angle at the joint: p_1,p_2,p_3,40deg",
    )  # fmt: skip
    parser.add_argument("--samples", default="2048", metavar="N", help="linkages drawn [2048]")
    parser.add_argument("--refined", default="24", metavar="N", help="of them refined [24]")
    parser.add_argument("--seed", default="0", metavar="N", help="seed of the drawing [0]")
    _output_options(parser)
    force_option(parser)


def _state_options(parser: argparse.ArgumentParser) -> None:
    """Add arguments for a scene, its start, and the time at the end."""
    _given_start(parser)
    parser.add_argument(
        "--t-end", metavar="TIME", help="20, 20s, 500ms, 2min [by mechanism; four_bar: 20 s]"
    )


def _given_start(parser: argparse.ArgumentParser) -> None:
    """Add arguments for a scene and its start."""
    scene_options(parser)
    several(
        parser, "--start", "NAME=VALUE", "start",
        "a coordinate or speed at the start: theta_0=85deg, omega_0=30deg/s",
    )  # fmt: skip
    several(
        parser, "--guess", "NAME=VALUE", "guess",
        "assemble near this coordinate, where several configurations exist",
    )  # fmt: skip


def several(
    parser: argparse.ArgumentParser, flag: str, metavar: str, name: str, about: str
) -> None:
    """An option that may be given any number of times."""
    parser.add_argument(flag, dest=name, metavar=metavar, action="append", default=[], help=about)
