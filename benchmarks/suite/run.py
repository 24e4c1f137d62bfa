"""The benchmarks, from one command.

    mechc bench [--quick | --full | --smoke] [--only SCRIPT ...] [--out DIR] [--against JSON]
    mechc bench NAME [options of the script or command; --help tells them]
    mechc bench --list

In a clone ``python -m benchmarks`` is the same.  Runs the scripts, each in a separate process,
and writes their figures together with machine, versions and commit into results.json, and the
report into results.html next to it: in benchmarks/out of a clone, else in ./mechc_bench.  A script
named alone writes NAME.json and NAME.html.  ``--against`` compares with an earlier results.json.
Exits with 1 where a script fails, 130 when interrupted; what has been measured until then is kept.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from ..report.page import write_report
from ..timing import results
from ..timing.machine import about
from .running import TOO_LONG, run_script
from .scripts import COMMANDS, SCRIPTS, Options, call

FAILED, BAD_INPUT, INTERRUPTED = 1, 2, 130
ENDED = {INTERRUPTED: "INTERRUPTED", TOO_LONG: "TOOK TOO LONG"}


def main(arguments: Sequence[str] | None = None) -> int:
    given = list(sys.argv[1:] if arguments is None else arguments)
    names = {*SCRIPTS, *COMMANDS}
    named = next((k for k, word in enumerate(given) if word in names), len(given))
    if named < len(given) and "--only" not in given[:named]:
        out = _options().parse_args(given[:named]).out.resolve()
        return run_alone(given[named], given[named + 1 :], out)
    chosen = _options().parse_args(given)
    if chosen.list:
        print("\n".join(f"{name:16s}{one.asks}" for name, one in (SCRIPTS | COMMANDS).items()))
        return 0
    earlier, out = _read(chosen.against), chosen.out.resolve()
    plan, skipped = planned(chosen.size, chosen.only or ())
    found: dict[str, Any] = {"about": about(), "size": chosen.size, "skipped": skipped}
    found |= {"codes": {}, "seconds": {}}
    code = measure(found, plan, out)
    conclude(found, write_report(found, earlier, out / "results.html"), out)
    return code


def _options() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="mechc bench", description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    size = parser.add_mutually_exclusive_group()
    for name, told in (
        ("quick", "under five minutes on two cores (the default)"),
        ("full", "everything, in about an hour"),
        ("smoke", "check that every script runs; its figures mean nothing"),
    ):
        size.add_argument(f"--{name}", dest="size", action="store_const", const=name, help=told)
    parser.set_defaults(size="quick")
    parser.add_argument("--only", nargs="+", choices=SCRIPTS, metavar="SCRIPT", help="these alone")
    parser.add_argument("--out", type=Path, metavar="DIR", default=results.folder(),
                        help=f"where results go [{results.folder()}]")  # fmt: skip
    parser.add_argument("--against", type=Path, metavar="JSON", help="an earlier results.json")
    parser.add_argument("--list", action="store_true", help="scripts and commands: what they ask")
    return parser


def _read(path: Path | None) -> dict[str, Any] | None:
    """An earlier results.json; ends the command where there is none."""
    if path is None:
        return None
    try:
        found = results.read(path)
        return {**found, "about": dict(found["about"])}
    except (OSError, ValueError, KeyError, TypeError) as error:
        print(f"mechc bench: {path} is no results.json: {error}", file=sys.stderr)
        raise SystemExit(BAD_INPUT) from None


def planned(size: str, named: Sequence[str]) -> tuple[dict[str, Options], dict[str, str]]:
    """The scripts to be run with their options, and why others are not."""
    plan, skipped = {}, {}
    for name in named or SCRIPTS:
        options = getattr(SCRIPTS[name], size)
        if options is None and named and size == "quick":
            options = SCRIPTS[name].full
        if options is None:
            skipped[name] = f"not part of a {size} run"
        else:
            plan[name] = options
    return plan, skipped


def run_alone(name: str, options: Sequence[str], out: Path) -> int:
    """A script or command in this process; of a script that the suite has not started, a page."""
    of_the_suite = results.FOLDER_VARIABLE in os.environ
    os.environ[results.FOLDER_VARIABLE] = str(out)
    code = call(name, options)
    figures = out / f"{name}.json"
    if name in SCRIPTS and not of_the_suite and figures.exists():
        page = figures.with_suffix(".html")
        write_report({"about": about(), name: results.read(figures)}, None, page)
        print(f"\nfigures: {figures}\nthe report: {page}")
    return code


def measure(found: dict[str, Any], plan: Mapping[str, Options], out: Path) -> int:
    """Run the scripts one after the other; ``found`` is written before and after each."""
    results.write("results", found, out)
    for name, options in plan.items():
        try:
            run_one(found, name, options, out)
        except KeyboardInterrupt:
            found["codes"][name] = INTERRUPTED
            return INTERRUPTED
        finally:
            results.write("results", found, out)
    return FAILED if any(found["codes"].values()) else 0


def run_one(found: dict[str, Any], name: str, options: Options, out: Path) -> None:
    """Run a script and take its figures, those of an unfinished one too."""
    limit = SCRIPTS[name].limits[found["size"] == "full"]
    figures = out / f"{name}.json"
    figures.unlink(missing_ok=True)  # an older run's
    print(f"\n== {name} {' '.join(options)}", flush=True)
    start = time.perf_counter()
    try:
        found["codes"][name] = run_script(name, options, out, limit)
    finally:
        found["seconds"][name] = time.perf_counter() - start
        if figures.exists():
            found[name] = results.read(figures)


def conclude(found: dict[str, Any], worse: Sequence[Mapping[str, Any]], out: Path) -> None:
    """What failed, what became worse, and where to look."""
    for row in worse:
        print(f"WORSE: {row['what']}: {row['told']}")
    for name, code in found["codes"].items():
        if code:
            print(f"{ENDED.get(code, 'FAILED')}: {name}")
    for name, reason in found["skipped"].items():
        print(f"not run: {name}: {reason}")
    print(f"\nin {sum(found['seconds'].values()):.0f} s: {out / 'results.json'}")
    print(f"the report: {out / 'results.html'}")
