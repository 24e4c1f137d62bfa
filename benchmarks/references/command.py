"""Exact motions of ``data/``, computed again.

    mechc bench references [NAME ...] [--to DIR]

Each motion is computed in two ways that share nothing (motions.py), or by two methods on a closed
curve that leaves no constraint (closed_loops.py), or, of the four-bar that nearly has a change
point, on a form that is regular there (near_misses.py); this takes from minutes to hours.
``sensitivities``, derivatives of seven motions, takes minutes of processor time with gmpy2 (``pip
install gmpy2``), a quarter of an hour without; ``sensitivities.FAMILY`` compares one family, as it
is written, with its second way.  Fewer than 30 digits on which both ways agree are an error.
"""

from __future__ import annotations

import json
import os
import time
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from ..problems.data import DATA
from ..timing.results import command_parser
from .closed_loops import closed_loops
from .motions import REFERENCES, compute
from .near_misses import near_misses
from .sensitivities.sensitivities import FAMILIES, confirmed, sensitivities

NEEDED = 30  # digits
SENSITIVITIES = "sensitivities"
NEAR_MISSES = "four_bar_near_misses"


def main(arguments: Sequence[str] | None = None) -> int:
    ways: dict[str, Callable[[], dict[str, Any]]] = {
        name: partial(_of_two_ways, name) for name in REFERENCES
    }
    ways[NEAR_MISSES] = near_misses
    ways["closed_loops"] = closed_loops
    ways[SENSITIVITIES] = lambda: sensitivities(chosen.processes)
    every = list(ways)
    ways |= {f"{SENSITIVITIES}.{name}": partial(confirmed, name) for name in FAMILIES}
    parser = command_parser("references", __doc__)
    parser.add_argument("names", nargs="*", default=every, metavar="NAME",
                        help=", ".join(every))  # fmt: skip
    parser.add_argument("--to", type=Path, default=DATA, metavar="DIR", help=f"[{DATA}]")
    parser.add_argument("--processes", type=int, default=os.cpu_count() or 1, metavar="N",
                        help=f"of {SENSITIVITIES} [all cores]")  # fmt: skip
    chosen = parser.parse_args(arguments)
    if unknown := set(chosen.names) - set(ways):
        parser.error(f"there is no {', '.join(sorted(unknown))}; there are {', '.join(ways)}")
    for name in chosen.names:
        began = time.perf_counter()
        data = ways[name]()
        print(f"{name}: {time.perf_counter() - began:.0f} s", flush=True)
        file = name.partition(".")[0]
        if data.get("digits", NEEDED) < NEEDED:
            return 1
        (chosen.to / f"{file}.json").write_text(json.dumps(data, indent=1) + "\n", "utf-8")
    return 0


def _of_two_ways(name: str) -> dict[str, Any]:
    data = compute(REFERENCES[name]())
    print(f"{name}: both ways agree on {data['digits']} digits", flush=True)
    return data
