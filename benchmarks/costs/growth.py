"""What do more links cost?

    mechc bench growth [--scenes planar spatial windows rings] [--quick | --most N]
                       [--resume]

For N = 1, 2, 5, 10, 20, 40, 80: an open planar chain of N links, an open spatial one with axes
that alternate, N four-bar windows in a row (2N + 1 links, tilted, relative angles), and the planar
chain as a ring, its end pinned to the end of its first link, each described as a ``Mechanism``.
Columns: processor seconds of derivation, of all else until the C is there, of the compiler for the
first unit and for the whole; kilobytes of C and its operations (the recursions of trees are loops
of the runtime and are not counted); microseconds for one right-hand side, called from Python
through ctypes, and for one of 512 states side by side in the lanes.  Exponents are fitted over
N >= 5.

``--resume`` keeps the rows of an earlier run.  Exits with 1 where the right-hand side of a chain of
40 links takes more than 0.5 us a link, or that of a ring of 40 more than three times the chain's.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from mechc.native._driver import Scene, capsule_of
from mechc_codegen.compiler import build_scene
from mechc_codegen.derive.derive_equations import derive_equations
from mechc_codegen.description.mechanism import Closure, Mechanism
from mechc_codegen.library.chains.rods import planar_chain, spatial_chain
from mechc_codegen.library.chains.windows import windows

from mechc.compilation import entries
from mechc.compilation.build import system_with
from mechc.compilation.toolchain.processor import native
from mechc.model import Model
from mechc.system.reference import ModelReference

from ..formulations.described import read as read_mechanism
from ..problems.windows_motion import upright_start
from ..timing.machine import about
from ..timing.processes import least_of_a_call, processor_seconds
from ..timing.results import command_parser, folder, read, write

SIZES = (1, 2, 5, 10, 20, 40, 80)
QUICK = (1, 5, 8)


def ring(count: int) -> Mechanism:
    """The planar chain, its end pinned to the end of its first link, where it has so many."""
    chain = planar_chain(count)
    if count < 5:
        return chain
    axes = (chain.frame.x, chain.frame.y)
    closure = Closure("end", chain.points[-1], chain.points[1], axes)
    return replace(chain, name="ring", start={}, closures=(closure,))


SCENES = {"planar": planar_chain, "spatial": spatial_chain, "windows": windows, "rings": ring}
COLUMNS = (
    "derive_s", "emit_s", "first_s", "whole_s", "kilobytes", "operations", "rhs_us", "lane_us",
)  # fmt: skip
TILT = {"tilt": 0.3}
LINK_US, ALLOWED = 0.25, 2.0  # articulated bodies, and how many times that
RING_ALLOWED = 3.0  # times the open chain
STATES = 512


def main(arguments: Sequence[str] | None = None) -> int:
    failures = missed(grown(_options().parse_args(arguments)))
    for failure in failures:
        print(f"MISSED: {failure}")
    return 1 if failures else 0


def grown(chosen: argparse.Namespace) -> dict[str, Any]:
    """The tables, written after each row."""
    result: dict[str, Any] = {"about": about(), "rows": {}, "exponents": {}}
    earlier = folder() / "growth.json"
    if chosen.resume and earlier.exists():
        result |= read(earlier)
    for name in chosen.scenes:
        rows = result["rows"].setdefault(name, [])
        print(f"\n{name:8s}" + "".join(f"{column:>11s}" for column in COLUMNS))
        for size in (n for n in (QUICK if chosen.quick else SIZES) if n <= chosen.most):
            if not any(row["n"] == size for row in rows):
                rows.append(measure(name, size))
                write("growth", result)
            _print_row(next(row for row in rows if row["n"] == size))
        result["exponents"][name] = {column: exponent(rows, column) for column in COLUMNS}
        _print_exponents(result["exponents"][name])
    write("growth", result)
    return result


def _options() -> argparse.ArgumentParser:
    parser = command_parser("growth", __doc__)
    parser.add_argument("--scenes", nargs="+", default=list(SCENES), choices=SCENES)
    parser.add_argument("--most", type=int, default=SIZES[-1], help="largest N")
    parser.add_argument("--quick", action="store_true", help=f"N = {QUICK}")
    parser.add_argument("--resume", action="store_true", help="keep the rows of an earlier run")
    return parser


def measure(name: str, size: int) -> dict[str, Any]:
    """One row of the table."""
    thing = SCENES[name](size)
    mechanism, request = read_mechanism(thing)
    _, derive = spent(lambda: derive_equations(mechanism, request))
    build, until_emitted = spent(lambda: build_scene(mechanism, (native(),), request))
    with tempfile.TemporaryDirectory() as folder:
        _, first = spent(lambda: entries.make_first(build, Path(folder)))
        _, whole = spent(lambda: entries.make_whole(build, Path(folder)))
        scene = Scene(capsule_of(str(Path(folder) / "scene.so")))
        model = Model(system_with(scene, ModelReference("", custom=True, defaults=_numbers(thing))))
    start = state(name, size, model)
    return {
        "n": size, "links": len(model.coordinates), "derive_s": derive,
        "emit_s": max(until_emitted - derive, 0.0), "first_s": first, "whole_s": whole,
        "kilobytes": len(build.texts["scene_program.h"]) / 1000,
        "operations": model.system.data["operations"]["after"],
        "rhs_us": 1e6 * scalar_seconds(model, start), "lane_us": 1e6 * lane_seconds(model, start),
    }  # fmt: skip


def _numbers(mechanism: Mechanism) -> dict[str, float]:
    """Its default values, which are not compiled in."""
    defaults = {str(p.symbol): p.default for p in mechanism.parameters}
    return {name: float(value) for name, value in defaults.items() if _is_number(value)}


def _is_number(value: Any) -> bool:
    return value is not None and not getattr(value, "free_symbols", ())


def spent(run: Callable[[], Any]) -> tuple[Any, float]:
    """Its result, and the processor seconds of this process and of the compiler."""
    before = processor_seconds()
    return run(), processor_seconds() - before


def state(name: str, size: int, model: Model) -> np.ndarray:
    """A state on the constraints, where no term is zero by chance."""
    if name == "windows":
        return upright_start(size, angle=1.1)
    rng = np.random.default_rng(size)
    return 0.3 * rng.normal(size=2 * len(model.coordinates))


def scalar_seconds(model: Model, y: np.ndarray) -> float:
    bound = model.c_function("rates", _values(model))
    function, out = bound.ctypes, np.empty_like(y)
    arguments = (0.0, y.ctypes.data, out.ctypes.data, bound.data)
    return least_of_a_call(lambda: function(*arguments))


def lane_seconds(model: Model, y: np.ndarray) -> float:
    states, values = np.tile(y, (STATES, 1)), _values(model)
    out = np.empty_like(states)
    return least_of_a_call(lambda: model.rhs(0.0, states, values, out=out)) / STATES


def _values(model: Model) -> dict[str, float]:
    return {name: value for name, value in TILT.items() if name in model.parameters}


def exponent(rows: Sequence[dict[str, Any]], column: str, least_size: int = 5) -> float | None:
    """Slope of a column over the number of links, both as logarithms."""
    points = [(r["links"], r[column]) for r in rows if r["n"] >= least_size and r[column] > 0]
    if len(points) < 2:
        return None
    links, values = np.log(np.array(points)).T
    return float(np.polyfit(links, values, 1)[0])


def missed(result: dict[str, Any]) -> list[str]:
    """Requirements that the tables do not meet."""
    found = []
    for name in ("planar", "spatial"):
        for row in result["rows"].get(name, ()):
            if row["n"] == 40 and row["rhs_us"] > ALLOWED * LINK_US * 40:
                found.append(f"{name} chain of 40 links: {row['rhs_us']:.1f} us")
    at_40 = {
        name: next((row["rhs_us"] for row in result["rows"].get(name, ()) if row["n"] == 40), None)
        for name in ("planar", "rings")
    }
    if at_40["planar"] and at_40["rings"] and at_40["rings"] > RING_ALLOWED * at_40["planar"]:
        found.append(f"ring of 40 links: {at_40['rings']:.1f} us, open {at_40['planar']:.1f} us")
    return found


def _print_row(row: dict[str, Any]) -> None:
    print(f"{row['n']:8d}" + "".join(f"{row[column]:11.3g}" for column in COLUMNS), flush=True)


def _print_exponents(exponents: dict[str, float | None]) -> None:
    told = ("" if value is None else f"{value:.2f}" for value in exponents.values())
    print(f"{'exponent':8s}" + "".join(f"{text:>11s}" for text in told), flush=True)
