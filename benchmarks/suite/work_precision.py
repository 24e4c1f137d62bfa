"""Run time against achieved error, mechc and its peers, on every problem of the suite.

    mechc bench work_precision [--quick] [--problem NAME ...] [--only PEER ...] [--budget SECONDS]

Error: the largest difference of any observed quantity from its exact value at the end, in the
problem's scale.  All runs of a problem take turns in one process; given are minimum, median,
spread and the first run, derivation and compilation apart.  A peer that is not installed or
cannot model a problem is named with the reason; one that crashes is shown as such; a wrong motion
is listed with its error and marked, and is no part of an envelope.  The table gives, along each
method's lower envelope over its tolerances, the time of a tool at an error; below it the ratios to
the best peer; batches, whose time is that of one trajectory among many, have a line of their own.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from .. import peers
from ..problems import NAMES
from ..report.work_precision import ratios_table
from ..timing.cases import Effort
from ..timing.envelope import TARGETS, printed
from ..timing.machine import about
from ..timing.results import command_parser, write
from .apart import compare_apart

WHOLE = tuple(10.0**-k for k in range(3, 14))
QUICK_PROBLEMS = (
    "pendulum_1", "pendulum_2", "four_bar_regular", "four_bar_change_point", "slider_crank",
    "heavy_top",
)  # fmt: skip
# Seconds that the repeats of a problem may take together; building and first runs come on top.
QUICK_BUDGET, FULL_BUDGET = 5.0, 40.0
QUICK_EFFORT = Effort(longest=0.4, cut=3.0, rounds=10, budget=0.1)
FULL_EFFORT = Effort(longest=2.0, cut=10.0, rounds=40, budget=0.6)
QUICK_PATIENCE, FULL_PATIENCE = 120.0, 300.0  # seconds that one peer may be at work


def main(arguments: Sequence[str] | None = None) -> int:
    return 1 if compared(_options().parse_args(arguments))["failed"] else 0


def compared(chosen: argparse.Namespace) -> dict[str, Any]:
    """The figures of all problems, written after each of them."""
    names = chosen.problem or (QUICK_PROBLEMS if chosen.quick else NAMES)
    budget = chosen.budget or (QUICK_BUDGET if chosen.quick else FULL_BUDGET)
    given = QUICK_EFFORT if chosen.quick else FULL_EFFORT
    effort = replace(given, total=budget)
    tolerances = WHOLE[::2] if chosen.quick else WHOLE
    others = tuple(peers.NAMES if chosen.only is None else chosen.only)
    patience = QUICK_PATIENCE if chosen.quick else FULL_PATIENCE
    data: dict[str, Any] = {"about": about(), "problems": {}, "failed": {}}
    for name in names:
        try:
            entry = compare_apart(
                name, others, tolerances, effort, quick=chosen.quick, patience=patience
            )
        except RuntimeError as error:  # of mechc itself
            data["failed"][name] = str(error)
            print(f"FAILED: {error}", flush=True)
            continue
        data["problems"][name] = entry
        print_points(name, entry)
        print_summary(name, entry)
        write("work_precision", data)
    write("work_precision", data)
    return data


def _options() -> argparse.ArgumentParser:
    parser = command_parser("work_precision", __doc__)
    parser.add_argument("--quick", action="store_true", help="main problems, fewer tolerances")
    parser.add_argument(
        "--problem", choices=NAMES, nargs="+", metavar="NAME", help=", ".join(NAMES)
    )
    parser.add_argument(
        "--only", choices=peers.NAMES, nargs="*", metavar="PEER", help=", ".join(peers.NAMES)
    )
    parser.add_argument("--budget", type=float, help="seconds for the repeats of a problem")
    return parser


def print_points(name: str, entry: Mapping[str, Any]) -> None:
    print(f"\n{name}: {entry['title']}, {entry['t_end']:g} s; {entry['note']}")
    print(
        f"{'tool':28s}{'method':14s}{'tol':>8s}{'error':>10s}{'ms':>11s}{'median':>11s}"
        f"{'spread':>8s}{'first':>11s}"
    )
    for row in entry["rows"]:
        error = "-" if row["error"] is None else f"{row['error']:.1e}"
        word = "" if row["label"] == "right" else f"  {row['label']}: {row['status']}"
        print(
            f"{row['tool']:28s}{row['method']:14s}{row['tol']:8.0e}{error:>10s}"
            f"{1e3 * row['seconds']:11.4f}{1e3 * row['median']:11.4f}{row['spread']:8.2f}"
            f"{1e3 * row['first']:11.4f}{word}"
        )
    for peer, reason in entry["skipped"].items():
        print(f"{peer}: skipped, {reason}")


def print_summary(name: str, entry: Mapping[str, Any]) -> None:
    """Milliseconds at an error, and the ratios to the best peer."""
    print(f"\n{'ms at an error':28s}" + "".join(f"{printed(target):>12s}" for target in TARGETS))
    for tool, at in entry["times"].items():
        cells = ("-" if seconds is None else f"{1e3 * seconds:.4f}" for seconds in at.values())
        print(f"{tool:28s}" + "".join(f"{cell:>12s}" for cell in cells))
    print(ratios_table({"work_precision": {"problems": {name: entry}}}), flush=True)
