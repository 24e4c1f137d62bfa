"""Is every hard case solved correctly, refused, or ended with a status?

    mechc bench stress [--quick | --full] [--family NAME ...] [--seeds FIRST STOP] [--processes N]

One table: a line a family with its runs, their verdicts and the worst error over its limit.  The
judges are independent of mechc: exact curves, closed forms, 40 digits, or other equations by
SciPy; each limit is rtol times the measured condition of the motion, with rounding
(judge.py).  Exits with 1 if anything is wrong without a warning, or if a family has fewer right
runs than required.  Families run in separate processes.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from typing import Any

import numpy as np

from ..timing.machine import about
from ..timing.results import command_parser, finite, write
from .families import FAMILIES, Family
from .judge import Row, row

Cases = bool | range  # few cases or all, or those of some seeds
BY_SEED = [name for name, family in FAMILIES.items() if family.drawn]
SHOWN = ("right", "refused", "flagged", "unjudged", "WRONG")


def main(arguments: Sequence[str] | None = None) -> int:
    chosen = _parse(arguments)
    names = chosen.family or list(FAMILIES)
    print(f"{'family':22s}{'runs':>6s}{'right':>7s}{'refused':>9s}{'flagged':>9s}{'unjudged':>10s}"
          f"{'WRONG':>7s}{'seconds':>9s}  worst error / limit")  # fmt: skip
    families, rows = [], []
    for name, found, seconds in _run(names, _cases(chosen), chosen.processes):
        families.append(summary(name, FAMILIES[name], found, seconds))
        rows += [{"family": name, **each} for each in found]
        _print_line(families[-1])
    for each in rows:
        if each["word"] == "WRONG":
            print("WRONG:", {key: x for key, x in finite(each).items() if key != "word"})
    for each in families:
        print(f"{'passed' if each['passed'] else 'FAILED'}  {each['family']}: {each['promise']}"
              + (f" ({each['note']})" if each["note"] else ""))  # fmt: skip
    write("stress", finite({"about": about(), "families": families, "rows": rows}))
    return 0 if all(each["passed"] for each in families) else 1


def _parse(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = command_parser("stress", __doc__)
    size = parser.add_mutually_exclusive_group()
    size.add_argument("--quick", action="store_true", help="half a minute (the default)")
    size.add_argument("--full", action="store_true", help="every case; a few minutes")
    parser.add_argument("--family", nargs="+", choices=list(FAMILIES), metavar="NAME",
                        help="only these: " + ", ".join(FAMILIES))  # fmt: skip
    parser.add_argument("--seeds", type=int, nargs=2, metavar=("FIRST", "STOP"),
                        help="the cases of these seeds: " + ", ".join(BY_SEED))  # fmt: skip
    parser.add_argument("--processes", type=int, default=os.cpu_count() or 1, metavar="N")
    chosen = parser.parse_args(arguments)
    if chosen.seeds and not set(chosen.family or FAMILIES) <= set(BY_SEED):
        parser.error(f"--seeds is for --family {', '.join(BY_SEED)}")
    return chosen


def _cases(chosen: argparse.Namespace) -> Cases:
    return range(*chosen.seeds) if chosen.seeds else not chosen.full


def _run(
    names: Sequence[str], cases: Cases, processes: int
) -> Iterator[tuple[str, list[Row], float]]:
    """Name, rows and processor seconds of every family, in the order of ``names``."""
    if min(processes, len(names)) < 2:
        yield from ((name, *family_rows(name, cases)) for name in names)
        return
    with ProcessPoolExecutor(processes, mp_context=get_context("spawn")) as pool:
        begun = [(name, pool.submit(family_rows, name, cases)) for name in names]
        yield from ((name, *future.result()) for name, future in begun)


def family_rows(
    name: str, cases: Cases, families: Mapping[str, Family] = FAMILIES
) -> tuple[list[Row], float]:
    """All rows of a family; what breaks it off is a row that is WRONG."""
    start, rows = time.process_time(), []
    try:
        # Overflow is what some families are about; they look at what came of it.
        with np.errstate(all="ignore"), warnings.catch_warnings():
            warnings.simplefilter("ignore", RuntimeWarning)
            for each in _rows(families[name], cases):
                rows.append(each)
    except Exception:
        told = traceback.format_exc()
        print(told, file=sys.stderr)
        rows.append(row("the family broke off", "WRONG", status=told.splitlines()[-1]))
    return rows, time.process_time() - start


def _rows(family: Family, cases: Cases) -> Iterator[Row]:
    if isinstance(cases, range) and family.drawn:
        return family.drawn(cases)
    return family.rows(bool(cases))


def summary(name: str, family: Family, rows: Sequence[Row], seconds: float) -> dict[str, Any]:
    """The family's line in the table."""
    counts = Counter(each["word"] for each in rows)
    judged = [each for each in rows if each.get("excess") is not None]
    worst = max(judged, key=lambda each: each["excess"] if each["excess"] >= 0 else np.inf,
                default={"excess": None, "case": ""})  # fmt: skip
    enough = counts["right"] >= family.least * (len(rows) - counts["unjudged"])
    notes = [family.note(list(rows)), "" if enough else f"less than {family.least:.0%} are right"]
    return {
        "family": name, "promise": family.promise, "runs": len(rows),
        **{word.lower(): counts[word] for word in SHOWN}, "worst": worst["excess"],
        "worst_case": worst["case"], "unit": family.unit, "seconds": seconds,
        "passed": bool(rows) and not counts["WRONG"] and enough,
        "note": "; ".join(filter(None, notes)),
    }  # fmt: skip


def _print_line(family: dict[str, Any]) -> None:
    counts = [family[word.lower()] for word in SHOWN]
    worst = "" if family["worst"] is None else f"{family['worst']:.2g}: {family['worst_case']}"
    columns = "{:22s}{:6d}{:7d}{:9d}{:9d}{:10d}{:7d}{:9.1f}  {}"
    figures = (family["runs"], *counts, family["seconds"], worst)
    print(columns.format(family["family"], *figures), flush=True)
