"""What does mechc itself cost?

    mechc bench costs [--quick | --full]

Installation: sizes by part.  Start: import, ``mechc run four_bar --json``, from a mechanism to the
first value of its right-hand side (with --full of more mechanisms).  One evaluation, and a call of
``simulate`` besides the integration.  Memory.  Instructions by callgrind, operations, bytes of C:
numbers that do not depend on other work of the machine.

Seconds are the least of several runs, and of the processor where the machine had other work.
Exits with 1 where a limit is missed by more than noise.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np
from mechc_codegen.compiler import Stopwatch, optimised_scene
from mechc_codegen.emit.c import CWriter, emit
from mechc_codegen.emit.units.instruction_sets import BASELINE
from mechc_codegen.library.chains.windows import windows
from mechc_codegen.library.planar.andrews import andrews
from mechc_codegen.library.planar.four_bar import four_bar
from mechc_codegen.library.planar.slider_crank import slider_crank
from mechc_codegen.library.spatial.flyball_governor import flyball_governor

import mechc

from ..formulations.described import read
from ..timing.figures import Figure
from ..timing.machine import about
from ..timing.processes import clocked, least_seconds
from ..timing.results import command_parser, write
from . import calls, first, footprint
from .instructions import NotCountedError, counted

IMPORT, RUN, CALL = 0.15, 0.5, 20.0  # s, s, us
RUNS, EVALUATIONS = 7, 100_000
STAGES = tuple(
    stage for stage in first.STAGES if stage not in ("import mechc", "first value", "processor")
)
BUILT = {"by hand": 3, "slider_crank": 1}  # from the description to the first value: runs
ALL_BUILT = BUILT | dict.fromkeys(("flyball_governor", "andrews", "bicycle"), 1)
COUNTED: dict[str, Callable[[], Any]] = {
    "four_bar": four_bar, "slider_crank": slider_crank, "flyball_governor": flyball_governor,
    "andrews": andrews, "windows of 5": lambda: windows(5),
}  # fmt: skip


def main(arguments: Sequence[str] | None = None) -> int:
    full = _options().parse_args(arguments).full
    result: dict[str, Any] = {"about": about(), "install": {}, "rows": [], "skipped": {}}
    rows = []
    for row in figures(full, result["install"]):
        print(row.line(), flush=True)
        rows.append(row)
    result["rows"] = [row.record() for row in rows]
    result["instructions"] = [*operations(), *_instructions(result["skipped"])]
    for what, reason in result["skipped"].items():
        print(f"{what}: skipped, {reason}")
    for entry in result["instructions"]:
        print(Figure(**entry).line())
    write("costs", result)
    missed = [row for row in rows if row.missed]
    for row in missed:
        print(f"MISSED: {row.line()}")
    return 1 if missed else 0


def _options() -> argparse.ArgumentParser:
    parser = command_parser("costs", __doc__)
    size = parser.add_mutually_exclusive_group()
    size.add_argument("--quick", action="store_true", help="few first values (the default)")
    size.add_argument("--full", action="store_true", help="first values of more mechanisms")
    return parser


def figures(full: bool, install: dict[str, Any]) -> Iterator[Figure]:
    """All rows; those of the installation are put into ``install`` too."""
    yield from start_up()
    yield from one_call()
    yield from evaluation()
    for name, runs in (ALL_BUILT if full else BUILT).items():
        yield from first_values(name, runs)
    yield from held()
    yield from installation(install)


def start_up() -> Iterator[Figure]:
    bare = least_seconds(["-c", "import numpy"], RUNS)
    whole = least_seconds(["-c", "import numpy, mechc"], RUNS)
    yield Figure("python -c 'import numpy', as a process", bare, "s")
    yield Figure("import mechc beyond numpy", whole - bare, "s", IMPORT)
    command = ["-m", "mechc", "run", "four_bar", "--json"]
    yield Figure("mechc run four_bar --json, as a process", least_seconds(command, RUNS), "s", RUN)


def one_call() -> Iterator[Figure]:
    for what, value in calls.parts().items():
        beside = what.startswith("simulate")
        told = f"{what}, beside the integration" if beside else what
        yield Figure(told, value, "us", CALL if beside else None)


def evaluation() -> Iterator[Figure]:
    """State rates of the four-bar: one state after the other, and many at once."""
    model = mechc.load("four_bar")
    scene, values = model.system.scene, np.array(model.system.parameter_set.defaults)
    y = model.assemble({"theta_0": 1.0}, speeds={"omega_0": 1.0})
    one = min(scene.rates_seconds(0.0, y, values, EVALUATIONS) for _ in range(RUNS))
    many = np.tile(y, (EVALUATIONS, 1))
    lanes = min(clocked(lambda: model.rhs(0.0, many)) for _ in range(RUNS))
    told = f"state rates, {scene.lanes} lanes, from Python, a state"
    yield Figure("state rates, each fed by the last", 1e9 * one / EVALUATIONS, "ns")
    yield Figure(told, 1e9 * lanes / EVALUATIONS, "ns")


def first_values(name: str, runs: int) -> Iterator[Figure]:
    """From the description to the first value of the right-hand side, and until all is compiled.

    The limits are the four-bar's.  A ``Mechanism`` is derived in every process, since its cache key
    is from its C; SymPy objects are found without derivation.
    """
    measured = first.measured(name, runs)
    told = "four_bar by hand" if name == "by hand" else name
    for way, limit in first.LIMITS.items():
        seconds = measured[way]
        for stage in STAGES:
            if stage in seconds:
                yield Figure(f"{told}, {way}: {stage}", seconds[stage], "s")
        least = min(seconds["first value"], seconds["processor"])
        limited = limit if name == first.BY_HAND else None
        yield Figure(f"{told}, {way}: first value", least, "s", limited)
    yield Figure(f"{told}: peak memory of the compilation", measured["peak_bytes"], "bytes")


def held() -> Iterator[Figure]:
    bare, added = footprint.after_import()
    yield Figure("memory after import numpy", bare, "bytes")
    yield Figure("memory that import mechc adds", added, "bytes")
    yield Figure("memory of a run, dense, an accepted step", footprint.of_a_run(), "bytes")
    yield Figure("memory of a batch, a member with two states", footprint.of_a_batch(), "bytes")


def installation(found: dict[str, Any]) -> Iterator[Figure]:
    """Sizes of what is installed, which are put into ``found`` too."""
    sizes = found["installed"] = footprint.installed()
    yield Figure("installed", sizes["bytes"], "bytes")
    for part, size in sizes["parts"].items():
        yield Figure(f"  of it: {part}", size, "bytes")
    yield Figure("installed files", sizes["files"], "files")
    yield Figure("installed, packed as in a wheel", sizes["packed"], "bytes")


def operations() -> Iterator[dict[str, Any]]:
    """Operations of all outputs, of one right-hand side, once a run; and the C of the program."""
    for name, mechanism in COUNTED.items():
        described, request = read(mechanism())
        made = optimised_scene(described, request, Stopwatch())
        texts = emit(CWriter(made.functions, made.metadata), made.metadata, (BASELINE,))
        counts = made.metadata["operations"]
        for what, value, unit in (
            ("all outputs", counts["after"], "operations"),
            ("one right-hand side", sum(counts["stages"].values()), "operations"),
            ("once a run", counts["once_per_run"], "operations"),
            ("C of the program", len(texts["scene_program.h"].encode()), "bytes"),
        ):
            yield {"what": f"{name}: {what}", "value": value, "unit": unit}


def _instructions(skipped: dict[str, str]) -> list[dict[str, Any]]:
    try:
        return counted()
    except NotCountedError as error:
        skipped["instructions"] = str(error)
        return []
