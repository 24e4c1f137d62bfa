"""What dry friction and contact cost beside plain steps, and whether events are one thing.

    mechc bench friction [--members N] [--out FILE]

A mass on a spring, alone and with one ``DryFriction``: microseconds a step of ``simulate``, and a
batch of such masses over 30 s.  A bouncing ball whose floor is a text, an expression of SymPy and a
function of Python: its steps and events.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from sympy import Symbol
from sympy.physics.mechanics import KanesMethod, Particle, Point, ReferenceFrame, dynamicsymbols

import mechc

SPAN, REPEATS = 30.0, 20
RUBS = mechc.DryFriction("u", 0.5)


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        prog="mechc bench friction", description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
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
    least = dict.fromkeys(ways, np.inf)
    for _ in range(REPEATS):
        for name, asked in ways.items():
            seconds, sol = timed(lambda asked=asked: mass.simulate(SPAN, [0.5, 0.0], **asked))
            least[name] = min(least[name], 1e6 * seconds / sol.stats["steps"])
    return {f"us a step, {name}": round(us, 3) for name, us in least.items()} | {
        "friction over plain": round(least["friction"] / least["plain"], 2)
    }


def batches(members: int) -> dict[str, float]:
    """Seconds of a batch on all cores, after one that warms up."""
    mass = on_spring()
    starts = np.random.default_rng(0).uniform(-1.0, 1.0, (members, 2))
    found = {}
    for name, events in (("plain", ()), ("friction", RUBS)):
        run = lambda events=events: mass.simulate_batch(SPAN, starts, events=events)  # noqa: E731
        found[f"s for {members} members, {name}"] = round(min(timed(run)[0] for _ in range(3)), 3)
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


def timed(run: Callable[[], Any]) -> tuple[float, Any]:
    started = time.perf_counter()
    result = run()
    return time.perf_counter() - started, result


def particle(load: Any) -> tuple[KanesMethod, Any]:
    """A mass on a line under a load along it."""
    q, u, t = *dynamicsymbols("q u"), dynamicsymbols._t
    frame, origin = ReferenceFrame("N"), Point("O")
    origin.set_vel(frame, 0)
    point = origin.locatenew("P", q * frame.x)
    point.set_vel(frame, u * frame.x)
    kane = KanesMethod(frame, [q], [u], kd_eqs=[q.diff(t) - u])
    kane.kanes_equations([Particle("mass", point, Symbol("m"))], [(point, load(q) * frame.x)])
    return kane


def on_spring() -> mechc.Model:
    """A mass on a spring."""
    defaults = {"m": 2.0, "k": 30.0}
    return mechc.compile(particle(lambda q: -Symbol("k") * q), name="spring", defaults=defaults)


def falling() -> mechc.Model:
    """A mass that falls."""
    defaults = {"m": 1.0, "g": 9.81}
    kane = particle(lambda q: -Symbol("m") * Symbol("g"))
    return mechc.compile(kane, name="ball", defaults=defaults)


if __name__ == "__main__":
    raise SystemExit(main())
