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
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from mechc_codegen.compiler import Stopwatch, optimised_scene
from mechc_codegen.emit.c import emit
from mechc_codegen.emit.units.instruction_sets import BASELINE
from mechc_codegen.library.chains.windows import windows
from mechc_codegen.library.planar.andrews import andrews
from mechc_codegen.library.planar.four_bar import four_bar
from mechc_codegen.library.planar.slider_crank import slider_crank
from mechc_codegen.library.spatial.flyball_governor import flyball_governor

import mechc

from ..formulations.described import read
from ..timing.machine import about
from ..timing.processes import clocked, least_seconds
from ..timing.results import command_parser, write
from . import calls, first, memory
from .installed import installed
from .instructions import NotCountedError, counted

NOISE = 1.25  # times a limit of seconds: what a busy machine adds to the least of several runs
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


@dataclass(frozen=True)
class Row:
    """A figure, and its limit if there is one."""

    what: str
    value: float
    unit: str
    limit: float | None = None

    @property
    def kept(self) -> bool | None:
        return None if self.limit is None else self.value <= self.limit

    @property
    def missed(self) -> bool:
        """Whether the limit is missed by more than noise."""
        return self.limit is not None and self.value > NOISE * self.limit

    def record(self) -> dict[str, Any]:
        return {**asdict(self), "kept": self.kept}


def main(arguments: Sequence[str] | None = None) -> int:
    full = _options().parse_args(arguments).full
    result: dict[str, Any] = {"about": about(), "install": {}, "rows": [], "skipped": {}}
    rows = []
    for row in figures(full, result["install"]):
        print_row(row)
        rows.append(row)
    result["rows"] = [row.record() for row in rows]
    result["instructions"] = [*operations(), *_instructions(result["skipped"])]
    for what, reason in result["skipped"].items():
        print(f"{what}: skipped, {reason}")
    for entry in result["instructions"]:
        print(f"{entry['what']:58s}{entry['value']:14,d} {entry['unit']}")
    write("costs", result)
    missed = [row for row in rows if row.missed]
    for row in missed:
        print(f"MISSED: {row.what}: {row.value:.4g} {row.unit}, limit {row.limit:g}")
    return 1 if missed else 0


def _options() -> argparse.ArgumentParser:
    parser = command_parser("costs", __doc__)
    size = parser.add_mutually_exclusive_group()
    size.add_argument("--quick", action="store_true", help="few first values (the default)")
    size.add_argument("--full", action="store_true", help="first values of more mechanisms")
    return parser


def figures(full: bool, install: dict[str, Any]) -> Iterator[Row]:
    """All rows; those of the installation are put into ``install`` too."""
    yield from start_up()
    yield from one_call()
    yield from evaluation()
    for name, runs in (ALL_BUILT if full else BUILT).items():
        yield from first_values(name, runs)
    yield from held()
    yield from installation(install)


def start_up() -> Iterator[Row]:
    bare = least_seconds(["-c", "import numpy"], RUNS)
    whole = least_seconds(["-c", "import numpy, mechc"], RUNS)
    yield Row("python -c 'import numpy', as a process", bare, "s")
    yield Row("import mechc beyond numpy", whole - bare, "s", IMPORT)
    command = ["-m", "mechc", "run", "four_bar", "--json"]
    yield Row("mechc run four_bar --json, as a process", least_seconds(command, RUNS), "s", RUN)


def one_call() -> Iterator[Row]:
    for what, value in calls.parts().items():
        beside = what.startswith("simulate")
        told = f"{what}, beside the integration" if beside else what
        yield Row(told, value, "us", CALL if beside else None)


def evaluation() -> Iterator[Row]:
    """State rates of the four-bar: one state after the other, and many at once."""
    model = mechc.load("four_bar")
    scene, values = model.system.scene, np.array(model.system.parameter_set.defaults)
    y = model.assemble({"theta_0": 1.0}, speeds={"omega_0": 1.0})
    one = min(scene.rates_seconds(0.0, y, values, EVALUATIONS) for _ in range(RUNS))
    many = np.tile(y, (EVALUATIONS, 1))
    lanes = min(clocked(lambda: model.rhs(0.0, many)) for _ in range(RUNS))
    told = f"state rates, {scene.lanes} lanes, from Python, a state"
    yield Row("state rates, each fed by the last", 1e9 * one / EVALUATIONS, "ns")
    yield Row(told, 1e9 * lanes / EVALUATIONS, "ns")


def first_values(name: str, runs: int) -> Iterator[Row]:
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
                yield Row(f"{told}, {way}: {stage}", seconds[stage], "s")
        least = min(seconds["first value"], seconds["processor"])
        limited = limit if name == first.BY_HAND else None
        yield Row(f"{told}, {way}: first value", least, "s", limited)
    yield Row(f"{told}: peak memory of the compilation", measured["peak_bytes"], "bytes")


def held() -> Iterator[Row]:
    bare, added = memory.after_import()
    yield Row("memory after import numpy", bare, "bytes")
    yield Row("memory that import mechc adds", added, "bytes")
    yield Row("memory of a run, dense, an accepted step", memory.of_a_run(), "bytes")
    yield Row("memory of a batch, a member with two states", memory.of_a_batch(), "bytes")


def installation(found: dict[str, Any]) -> Iterator[Row]:
    """Sizes of what is installed, which are put into ``found`` too."""
    sizes = found["installed"] = installed()
    yield Row("installed", sizes["bytes"], "bytes")
    for part, size in sizes["parts"].items():
        yield Row(f"  of it: {part}", size, "bytes")
    yield Row("installed files", sizes["files"], "files")
    yield Row("installed, packed as in a wheel", sizes["packed"], "bytes")


def operations() -> Iterator[dict[str, Any]]:
    """Operations of all outputs, of one right-hand side, once a run; and the C of the program."""
    for name, mechanism in COUNTED.items():
        described, request = read(mechanism())
        made = optimised_scene(described, request, Stopwatch())
        texts = emit(made.program, made.equations, made.metadata, (BASELINE,), request)
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


def print_row(row: Row) -> None:
    limit = "" if row.limit is None else f"  limit {row.limit:g} {'kept' if row.kept else 'MISSED'}"
    value = f"{row.value:14,.0f}" if row.unit in ("bytes", "files") else f"{row.value:14.4g}"
    print(f"{row.what:58s}{value} {row.unit}{limit}", flush=True)
