"""The benchmark suite, from one command.

    mechc bench [--quick | --full | --smoke] [--only SCRIPT ...] [--out DIR] [--against JSON]
    mechc bench SCRIPT [options of the script]
    mechc bench --list

In a clone ``python -m benchmarks`` is the same.  Runs the scripts, each in a process of its own,
and writes their figures together with machine, versions and commit into results.json, and the
report into results.html beside it: in benchmarks/out of a clone, else in ./mechc_bench.
``--against`` compares with an earlier results.json.  Exits with 1 where a script fails, 130 when
interrupted; what has been measured until then is kept.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import _results
from _machine import about
from _running import TOO_LONG, run_script
from report import write_report

FAILED, BAD_INPUT, INTERRUPTED = 1, 2, 130
ENDED = {INTERRUPTED: "INTERRUPTED", TOO_LONG: "TOOK TOO LONG"}
Options = tuple[str, ...]


@dataclass(frozen=True)
class Script:
    """What a script asks, and how it is run.

    Attributes
    ----------
    quick, full, smoke
        Its options in a run of this size; None where it is left out.  A quick run that names the
        script takes the options of the full one then.
    limits
        Seconds that a quick and a full run of it may take at most.
    a_clone
        It uses parts of the repository that are not installed.
    """

    asks: str
    quick: Options | None
    full: Options | None
    smoke: Options | None
    limits: tuple[float, float] = (600.0, 1800.0)
    a_clone: bool = False


SCRIPTS = {
    "work_precision": Script(
        "run time against achieved error, all problems, all methods, all peers",
        ("--quick",), (), ("--quick", "--problem", "pendulum_1", "--only"), (900.0, 3600.0),
    ),
    "stress": Script(
        "right, refused, or ended with a status: never else", (), ("--full",),
        ("--family", "dead points", "bad arguments"),
    ),
    "change_point": Script(
        "error against the exact motion through change points", (), (), ()
    ),
    "near_misses": Script(
        "the four-bar that misses its change point by 10^-k: right, or flagged?", (), (), ()
    ),
    "failure_rate": Script(
        "random starts through change points: how often wrong without a word?",
        ("20", "4"), (), ("2", "1", "2"),
    ),
    "long_run": Script(
        "energy and closure over many periods", ("1000",), (), ("10",)
    ),
    "growth": Script(
        "what more links cost", ("--quick",), ("--follow", "40"),
        ("--most", "1", "--scenes", "planar"),
    ),
    "first_value": Script(
        "from a KanesMethod object to the first value of its right-hand side", None, (), ("1",),
        a_clone=True,
    ),
    "costs": Script(
        "installation, start, calls, memory, instructions", ("--quick",), ("--full",), None
    ),
    "essentials": Script(
        "accuracy, the cost of one evaluation", (), (), ()
    ),
    "scenes": Script(
        "compiled scenes beside the same in NumPy", None, (), None
    ),
    "batch": Script(
        "many trajectories: rates, threads, streaming, restarting",
        ("--only", "trajectories", "--members", "1000"), (), ("--only", "rhs"),
    ),
}  # fmt: skip


def main(arguments: Sequence[str] | None = None) -> int:
    given = list(sys.argv[1:] if arguments is None else arguments)
    named = next((k for k, word in enumerate(given) if word in SCRIPTS), len(given))
    if named < len(given) and "--only" not in given:  # one script, with options of its own
        before = _options().parse_args(given[:named])
        return run_script(given[named], given[named + 1 :], before.out.resolve(), None)
    chosen = _options().parse_args(given)
    if chosen.list:
        print("\n".join(f"{name:16s}{script.asks}" for name, script in SCRIPTS.items()))
        return 0
    earlier, out = _read(chosen.against), chosen.out.resolve()
    plan, skipped = planned(chosen.size, chosen.only or ())
    results: dict[str, Any] = {"about": about(), "size": chosen.size, "skipped": skipped}
    results |= {"codes": {}, "seconds": {}}
    code = measure(results, plan, out)
    slower = write_report(results, earlier, out)
    conclude(results, slower, out)
    return code


def _options() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="mechc bench", description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    size = parser.add_mutually_exclusive_group()
    for name, told in (
        ("quick", "under five minutes on two cores (the default)"),
        ("full", "everything, in about an hour"),
        ("smoke", "whether every script runs; its figures mean nothing"),
    ):
        size.add_argument(f"--{name}", dest="size", action="store_const", const=name, help=told)
    parser.set_defaults(size="quick")
    parser.add_argument("--only", nargs="+", choices=SCRIPTS, metavar="SCRIPT", help="these alone")
    parser.add_argument("--out", type=Path, metavar="DIR", default=_results.OUT,
                        help=f"where results go [{_results.OUT}]")  # fmt: skip
    parser.add_argument("--against", type=Path, metavar="JSON", help="an earlier results.json")
    parser.add_argument("--list", action="store_true", help="the scripts, and what each asks")
    return parser


def _read(path: Path | None) -> dict[str, Any] | None:
    """An earlier results.json; ends the command where there is none."""
    if path is None:
        return None
    try:
        found = json.loads(path.read_text("utf-8"))
        return {**found, "about": dict(found["about"])}
    except (OSError, ValueError, KeyError, TypeError) as error:
        print(f"mechc bench: {path} is no results.json: {error}", file=sys.stderr)
        raise SystemExit(BAD_INPUT) from None


def planned(size: str, named: Sequence[str]) -> tuple[dict[str, Options], dict[str, str]]:
    """The scripts to be run with their options, and why others are not."""
    plan, skipped = {}, {}
    for name in named or SCRIPTS:
        script, options = SCRIPTS[name], getattr(SCRIPTS[name], size)
        if options is None and named and size == "quick":
            options = script.full
        if options is None:
            skipped[name] = f"not part of a {size} run"
        elif script.a_clone and not _results.A_CLONE:
            skipped[name] = "needs a clone of the repository"
        else:
            plan[name] = options
    return plan, skipped


def measure(results: dict[str, Any], plan: Mapping[str, Options], out: Path) -> int:
    """Run the scripts one after the other; ``results`` is written before and after each."""
    _results.write("results", results, out)
    for name, options in plan.items():
        try:
            run_one(results, name, options, out)
        except KeyboardInterrupt:
            results["codes"][name] = INTERRUPTED
            return INTERRUPTED
        finally:
            _results.write("results", results, out)
    return FAILED if any(results["codes"].values()) else 0


def run_one(results: dict[str, Any], name: str, options: Options, out: Path) -> None:
    """Run a script and take its figures, those of an unfinished one too."""
    limit = SCRIPTS[name].limits[results["size"] == "full"]
    figures = out / f"{name}.json"
    figures.unlink(missing_ok=True)  # an older run's
    print(f"\n== {name} {' '.join(options)}", flush=True)
    start = time.perf_counter()
    try:
        results["codes"][name] = run_script(name, options, out, limit)
    finally:
        results["seconds"][name] = time.perf_counter() - start
        if figures.exists():
            results[name] = json.loads(figures.read_text("utf-8"))


def conclude(results: dict[str, Any], slower: Sequence[Mapping[str, Any]], out: Path) -> None:
    """What failed, what became worse, and where to look."""
    for row in slower:
        print(f"WORSE: {row['what']}: {row['told']}")
    for name, code in results["codes"].items():
        if code:
            print(f"{ENDED.get(code, 'FAILED')}: {name}")
    for name, reason in results["skipped"].items():
        print(f"not run: {name}: {reason}")
    print(f"\nin {sum(results['seconds'].values()):.0f} s: {out / 'results.json'}")
    print(f"the report: {out / 'results.html'}")
