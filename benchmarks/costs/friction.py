"""What dry friction and contact cost beside plain steps, and whether events are one thing.

    mechc bench friction [--members N] [--out FILE]

A mass on a spring, alone and with one ``DryFriction``: microseconds a step of ``simulate``, and a
batch of such masses over 30 s.  A bouncing ball whose floor is a text, an expression of SymPy and a
function of Python: its steps and events.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from sympy import Symbol
from sympy.physics.mechanics import dynamicsymbols

import mechc

from ..problems.particle import particle
from ..timing.processes import least_of_rounds
from ..timing.results import command_parser

SPAN, REPEATS = 30.0, 20
RUBS = mechc.DryFriction("u", 0.5)


def main(arguments: Sequence[str] | None = None) -> int:
    parser = command_parser("friction", __doc__)
    parser.add_argument("--members", type=int, default=1000)
    parser.add_argument("--out", type=Path, help="a JSON file for the figures")
    given = parser.parse_args(arguments)
    found = {**steps(), **batches(given.members), "ball": ball()}
    for name, value in found.items():
        print(f"{name}: {value}")
    if given.out is not None:
        given.out.write_text(json.dumps(found, indent=1), encoding="utf-8")
    return 0 if len(set(map(tuple, found["ball"].values()))) == 1 else 1


def steps() -> dict[str, float]:
    """Microseconds a step, each the least of several runs in turn."""
    mass = on_spring()
    ways: dict[str, dict[str, Any]] = {
        "plain": {}, "plain dop853": {"method": "dop853"}, "friction": {"events": RUBS},
    }  # fmt: skip
    runs = {name: partial(mass.simulate, SPAN, [0.5, 0.0], **asked) for name, asked in ways.items()}
    seconds = least_of_rounds(REPEATS, *runs.values())
    least = {
        name: 1e6 * each / run().stats["steps"]
        for (name, run), each in zip(runs.items(), seconds, strict=True)
    }
    return {f"us a step, {name}": round(us, 3) for name, us in least.items()} | {
        "friction over plain": round(least["friction"] / least["plain"], 2)
    }


def batches(members: int) -> dict[str, float]:
    """Seconds of a batch on all cores, after one that warms up."""
    mass = on_spring()
    starts = np.random.default_rng(0).uniform(-1.0, 1.0, (members, 2))
    found = {}
    for name, events in (("plain", ()), ("friction", RUBS)):
        (least,) = least_of_rounds(3, partial(mass.simulate_batch, SPAN, starts, events=events))
        found[f"s for {members} members, {name}"] = round(least, 3)
    return found


def ball() -> dict[str, list[float]]:
    """By each way to say the floor: steps, events, and the last state."""
    q = dynamicsymbols("q")
    floor: dict[str, Any] = {"text": "q < 0", "SymPy": q < 0, "Python": lambda t, y: y[0]}
    model = falling()
    found = {}
    for name, function in floor.items():
        event = mechc.Event(function, direction=-1, reset={"u": "-0.8*u"})
        sol = model.simulate(2.0, [1.0, 0.0], events=event)
        found[name] = [sol.stats["steps"], len(sol.events[0].t), *sol.y[-1].tolist()]
    return found


def on_spring() -> mechc.Model:
    """A mass on a spring."""
    defaults = {"m": 2.0, "k": 30.0}
    q, u = dynamicsymbols("q u")
    kane = particle([q], [u], [-Symbol("k") * q])
    return mechc.compile(kane, name="spring", defaults=defaults)


def falling() -> mechc.Model:
    """A mass that falls."""
    defaults = {"m": 1.0, "g": 9.81}
    q, u = dynamicsymbols("q u")
    kane = particle([q], [u], [-Symbol("m") * Symbol("g")])
    return mechc.compile(kane, name="ball", defaults=defaults)


if __name__ == "__main__":
    raise SystemExit(main())
