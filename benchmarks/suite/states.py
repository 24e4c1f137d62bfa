"""Last states of the library's mechanisms after 20 s by each method, to the last bit.

    mechc bench states --out BEFORE.json [NAME ...]
    mechc bench states --against BEFORE.json [NAME ...]

Of two commits on one machine: what changes no arithmetic changes no bit.  Compared runs begin at
the starts of the earlier file; where a start itself is assembled otherwise, it is listed.  Exits
with 1 where one differs.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

import mechc

from ..timing import results
from ..timing.results import command_parser

T_END, RTOL, MAX_STEPS = 20.0, 1e-8, 20_000
SIZES: dict[str, dict[str, int]] = {"pendulum": {"links": 3}, "windows": {"count": 2}}
METHODS = ("dopri5", "dop853", "gauss8", "radau5", "auto")


def main(arguments: Sequence[str] | None = None) -> int:
    parser = command_parser("states", __doc__)
    parser.add_argument("--out", type=Path, metavar="JSON", help="write the states to this file")
    parser.add_argument("--against", type=Path, metavar="JSON", help="compare with those of a file")
    parser.add_argument("names", nargs="*", metavar="NAME", help="mechanisms [all of the library]")
    chosen = parser.parse_args(arguments)
    before = results.read_option(parser, chosen.against)  # now, not after the whole run
    states = last_states(chosen.names or mechc.mechanisms(), before or {})
    if chosen.out:
        chosen.out.write_text(json.dumps(states, indent=1) + "\n", "utf-8")
    if before is None:
        return 0
    apart = differing(states, before)
    print(f"{len(states) - len(apart)} equal, {len(apart)} differ{': ' if apart else ''}"
          + ", ".join(apart))  # fmt: skip
    return 1 if apart else 0


def last_states(names: Sequence[str], before: dict[str, list[Any]]) -> dict[str, list[Any]]:
    """By mechanism and method: how the run ended, its steps, time and state in hexadecimal.

    By mechanism: its start, from which the runs begin where there was none before.
    """
    states: dict[str, list[Any]] = {}
    for name in names:
        model = mechc.load(name, **SIZES.get(name, {}))
        assembled = states[f"{name} start"] = [x.hex() for x in model.assemble().tolist()]
        start = np.array([float.fromhex(x) for x in before.get(f"{name} start", assembled)])
        for method in METHODS:
            sol = model.simulate(T_END, start, method=method, rtol=RTOL, max_steps=MAX_STEPS)
            numbers = [float(x).hex() for x in (sol.t[-1], *sol.y[-1])]
            states[f"{name} {method}"] = [sol.status.code, sol.stats["steps"], *numbers]
            print(name, method, sol.status.code, sol.stats["steps"], flush=True)
    return states


def differing(states: dict[str, list[Any]], before: dict[str, list[Any]]) -> list[str]:
    """Mechanisms and methods whose end is another one, or was not known."""
    return [key for key, value in states.items() if value != before.get(key)]
