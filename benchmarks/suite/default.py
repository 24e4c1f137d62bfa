"""What a run costs by default, over the best method: single runs and batches, at the same error.

    mechc bench default [--scene NAME ...] [--quick]

Times along each method's lower envelope of time over error, in one process and in turns; batches
of equal members on one thread.  Exits with 1 where the default takes more than 1.15 times as long
as the best method.  Scenes of the library that are no problem of the suite start as they do by
default; these, and small open scenes, are judged by their motion at the tightest tolerance.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from time import process_time
from typing import Any

from mechc_codegen.library.catalogue import shipped_mechanism

import mechc

from ..formulations import open_scenes
from ..problems import NAMES, problem
from ..problems.problem import Array, Problem
from ..timing import results
from ..timing.cases import Effort, measure
from ..timing.envelope import TARGETS, of_methods, printed
from . import own_cases

DEFAULT, ALLOWED = "auto", 1.15
TIGHTEST, SECONDS = 1e-13, 2.0
TOLERANCES = tuple(10.0**-k for k in range(3, 14))
EFFORT = Effort(longest=0.5, cut=5.0, rounds=20, budget=0.3, total=60.0, clock=process_time)
QUICK = Effort(longest=0.2, cut=3.0, rounds=5, budget=0.1, total=8.0, clock=process_time)
OTHERS = ("car_axis", "planar_chain", "rigid_body", "spatial_chain")


def main(arguments: Sequence[str] | None = None) -> int:
    parser = results.command_parser("default", __doc__)
    scenes: dict[str, Callable[[], Problem]] = {name: partial(problem, name) for name in NAMES}
    scenes |= {name: partial(by_default, name) for name in OTHERS}
    scenes |= {name: partial(written_down, name) for name in open_scenes.STARTS}
    parser.add_argument("--scene", nargs="+", choices=scenes, default=[*scenes], metavar="NAME")
    parser.add_argument("--quick", action="store_true", help="every second tolerance, fewer runs")
    chosen = parser.parse_args(arguments)
    found: dict[str, Any] = {}
    print(f"{'default / best':36}" + "".join(f"{printed(each):>24}" for each in TARGETS))
    for name in chosen.scene:
        rows = measured(scenes[name](), quick=chosen.quick)
        found[name] = {"rows": rows, "ratios": ratios(rows)}
        for tool, at in found[name]["ratios"].items():
            cells = "".join(f"{_told(each):>24}" for each in at.values())
            print(f"{f'{name}, {tool}':36}{cells}", flush=True)
        results.write("default", found)
    every = [at for of in found.values() for at in of["ratios"].values()]
    return 1 if max(each["ratio"] for at in every for each in at.values()) > ALLOWED else 0


def by_default(name: str) -> Problem:
    """A scene of the library from its default start."""
    start = mechc.load(name).assemble()
    return _judged_by_itself(name, partial(shipped_mechanism, name), start, SECONDS, shipped=name)


def written_down(name: str) -> Problem:
    """A small open scene, by its equations of motion."""
    made, t_end = partial(open_scenes.mechanism, name), open_scenes.STARTS[name][1]
    return _judged_by_itself(name, made, open_scenes.start(name), t_end)


def _judged_by_itself(
    name: str, mechanism: Callable[[], Any], start: Array, t_end: float, shipped: str = ""
) -> Problem:
    """A problem whose end is that of its motion by collocation at the tightest tolerance."""
    found = Problem(
        name=name, title=name, mechanism=mechanism, start=start, t_end=t_end, quantities=(),
        exact=start, shipped=shipped,
    )  # fmt: skip
    model = found.model
    end = model.simulate(t_end, start, rtol=TIGHTEST, method="gauss8").y[-1]
    return replace(found, quantities=(*model.coordinates, *model.speeds), exact=end)


def measured(target: Problem, *, quick: bool) -> list[dict[str, Any]]:
    """Rows of the cases of mechc's methods."""
    cases, _ = own_cases.build(target, TOLERANCES[::2] if quick else TOLERANCES)
    return [case.record() for case in measure(cases, target.error, QUICK if quick else EFFORT)]


def ratios(rows: Sequence[Mapping[str, Any]]) -> dict[str, dict[str, dict[str, Any]]]:
    """Tool -> error -> the default's time over the best's, which that is, seconds of all."""
    found: dict[str, dict[str, dict[str, Any]]] = {}
    for tool in dict.fromkeys(row["tool"] for row in rows):
        met = {error: of_methods(rows, tool, error) for error in TARGETS}
        found[tool] = {printed(error): _over(of) for error, of in met.items() if of}
    return found


def _over(seconds: Mapping[str, float]) -> dict[str, Any]:
    """Infinite where the default does not reach an error that another method reaches."""
    best = min(seconds, key=seconds.__getitem__)
    ratio = seconds.get(DEFAULT, math.inf) / seconds[best]
    return {"ratio": ratio, "best": best, "seconds": dict(seconds)}


def _told(one: Mapping[str, Any]) -> str:
    return f"{one['ratio']:.2f} {one['best']} {1e6 * one['seconds'][one['best']]:.0f} us"


if __name__ == "__main__":
    raise SystemExit(main())
