"""The benchmark suite, from one command.

    python -m benchmarks [--quick | --full] [--against RESULTS.json]

Runs the scripts of this folder, each in a process of its own, and writes their JSON together with
machine, versions and commit into benchmarks/out/results.json.  ``--against`` compares the times
of the work-precision runs with an earlier such file and lists what became slower.  Exits with 1
where a script does.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from _machine import about
from _scene import OUT, write

FOLDER = Path(__file__).resolve().parent

QUICK = {
    "essentials": [],
    "first_value": [],
    "work_precision": ["--quick", "--only", "heyoka", "scipy", "casadi"],
    "change_point": [],
    "stress": [],
    "growth": ["--most", "10"],
}
FULL: dict[str, list[str]] = {
    **QUICK, "work_precision": [], "near_misses": [], "failure_rate": [], "long_run": [],
    "growth": ["--follow", "40"],
}  # fmt: skip
SLOWER = 1.25  # times an earlier figure: beyond what minima of runs in turns scatter


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    size = parser.add_mutually_exclusive_group()
    size.add_argument("--quick", action="store_true", help="a few minutes (the default)")
    size.add_argument("--full", action="store_true", help="everything; about an hour")
    parser.add_argument("--against", type=Path, metavar="JSON", help="an earlier results.json")
    chosen = parser.parse_args(arguments)
    earlier = json.loads(chosen.against.read_text()) if chosen.against else None
    results: dict[str, Any] = {"about": about(), "codes": {}, "seconds": {}}
    for script, options in (FULL if chosen.full else QUICK).items():
        print(f"\n== {script}", flush=True)
        (OUT / f"{script}.json").unlink(missing_ok=True)  # an older run's figures
        start = time.perf_counter()
        command = [sys.executable, str(FOLDER / f"{script}.py"), *options]
        results["codes"][script] = subprocess.run(command, check=False).returncode
        results["seconds"][script] = time.perf_counter() - start
        if (OUT / f"{script}.json").exists():
            results[script] = json.loads((OUT / f"{script}.json").read_text())
    write("results", results)
    print(f"\nwritten: {OUT / 'results.json'}")
    failed = [script for script, code in results["codes"].items() if code]
    for script in failed:
        print(f"FAILED: {script}")
    if earlier is not None:
        print_comparison(regressions(results, earlier), earlier)
    return 1 if failed else 0


def regressions(now: Mapping[str, Any], earlier: Mapping[str, Any]) -> dict[str, float]:
    """Scene, tool and error -> how many times slower than before, where beyond SLOWER.

    Times are taken relative to heyoka's in the same process where both have it, so that another
    load or clock is not taken for a regression.
    """
    found = {}
    for name, scene in now.get("work_precision", {}).get("scenes", {}).items():
        before = earlier.get("work_precision", {}).get("scenes", {}).get(name)
        for target in scene["times"]["mechc"] if before else ():
            a, b = _relative(scene["times"], before["times"], target)
            if a and b and a / b > SLOWER:
                found[f"{name}, error {target}"] = a / b
    return found


def _relative(
    now: Mapping[str, Any], before: Mapping[str, Any], target: str
) -> tuple[float | None, float | None]:
    """mechc's times at an error now and before, over heyoka's if both runs have them."""
    mine, was = now["mechc"][target], before["mechc"][target]
    clock, clock_was = (run.get("heyoka", {}).get(target) for run in (now, before))
    if mine and was and clock and clock_was:
        return mine / clock, was / clock_was
    return mine, was


def print_comparison(slower: Mapping[str, float], earlier: Mapping[str, Any]) -> None:
    told = earlier["about"]
    print(f"\nagainst {told['commit']} of {told['date']}: {len(slower)} slower than {SLOWER} times")
    for what, ratio in slower.items():
        print(f"  {what}: {ratio:.2f} times")


if __name__ == "__main__":
    sys.exit(main())
