"""What does the product itself cost?

    python benchmarks/costs.py [--quick | --full]

Installation: seconds of a source distribution (and with --full of a wheel, a new environment and
``pip install .``), sizes by part.  Start: import, ``mechc run four_bar --json``, from a mechanism
to the first value of its right-hand side.  A call of ``simulate`` beside the integration.  Memory.
Instructions by callgrind, operations and bytes of C: numbers that do not depend on what else the
machine does.  Growth with the number of links is growth.py's.

Seconds are the least of several runs, and of the processor where the machine had other work.
Exits with 1 where a limit is missed by more than noise.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import _call
import _install
import _memory
import first_value
from _instructions import NotCountedError, counted
from _machine import about
from _processes import least_seconds
from _scene import write
from mechc_codegen.compiler import Stopwatch, optimised
from mechc_codegen.description.source import ConversionSettings
from mechc_codegen.emit.c import emit
from mechc_codegen.emit.instruction_sets import BASELINE
from mechc_codegen.frontend.compile_request import CompileOptions, CompileRequest
from mechc_codegen.library.chains.windows import windows
from mechc_codegen.library.planar.andrews import andrews
from mechc_codegen.library.planar.four_bar import four_bar
from mechc_codegen.library.planar.slider_crank import slider_crank
from mechc_codegen.library.spatial.flyball_governor import flyball_governor

NOISE = 1.25  # times a limit of seconds: what a busy machine adds to the least of several runs
IMPORT, RUN, CALL = 0.15, 0.5, 20.0  # s, s, us
RUNS = 7
STAGES = tuple(
    stage
    for stage in first_value.STAGES
    if stage not in ("import mechc", "first value", "processor")
)
BUILT = {"by hand": 3, "slider_crank": 1}  # from the description to the first value: runs
ALL_BUILT = BUILT | dict.fromkeys(("flyball_governor", "andrews", "bicycle"), 1)
COUNTED: dict[str, Callable[[], Any]] = {
    "four_bar": four_bar,
    "slider_crank": slider_crank,
    "flyball_governor": flyball_governor,
    "andrews": andrews,
    "windows of 5": lambda: windows(5),
}


@dataclass(frozen=True)
class Row:
    """A figure, and the limit that it must keep where there is one."""

    what: str
    value: float
    unit: str
    limit: float | None = None

    @property
    def kept(self) -> bool | None:
        return None if self.limit is None else self.value <= self.limit

    @property
    def missed(self) -> bool:
        """By more than noise."""
        return self.limit is not None and self.value > NOISE * self.limit

    def record(self) -> dict[str, Any]:
        return {**asdict(self), "kept": self.kept}


def main(arguments: Sequence[str] | None = None) -> int:
    full = _options().parse_args(arguments).full
    result: dict[str, Any] = {"about": about(), "install": {}, "rows": [], "skipped": {}}
    rows = []
    for row in figures(full, result["install"], result["skipped"]):
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
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    size = parser.add_mutually_exclusive_group()
    size.add_argument("--quick", action="store_true", help="without a build (the default)")
    size.add_argument("--full", action="store_true", help="builds and installs too")
    return parser


def figures(full: bool, install: dict[str, Any], skipped: dict[str, str]) -> Iterator[Row]:
    """All rows; those of the installation are put into ``install`` too."""
    yield from start_up()
    yield from calls()
    for name, runs in (ALL_BUILT if full else BUILT).items():
        yield from first_values(name, runs)
    yield from memory()
    yield from installation(full, install, skipped)


def start_up() -> Iterator[Row]:
    bare = least_seconds(["-c", "import numpy"], RUNS)
    whole = least_seconds(["-c", "import numpy, mechc"], RUNS)
    yield Row("python -c 'import numpy', as a process", bare, "s")
    yield Row("import mechc beyond numpy", whole - bare, "s", IMPORT)
    command = ["-m", "mechc", "run", "four_bar", "--json"]
    yield Row("mechc run four_bar --json, as a process", least_seconds(command, RUNS), "s", RUN)


def calls() -> Iterator[Row]:
    for what, value in _call.parts().items():
        beside = what.startswith("simulate")
        told = f"{what}, beside the integration" if beside else what
        yield Row(told, value, "us", CALL if beside else None)


def first_values(name: str, runs: int) -> Iterator[Row]:
    """From the description to the first value of the right-hand side, and until all is compiled.

    The limits are the four-bar's.  A ``Mechanism`` is derived in every process, since its C names
    what is kept of it; objects of SymPy's are found without.
    """
    measured = first_value.measured(name, runs)
    told = "four_bar by hand" if name == "by hand" else name
    for way, limit in first_value.LIMITS.items():
        seconds = measured[way]
        for stage in STAGES:
            if stage in seconds:
                yield Row(f"{told}, {way}: {stage}", seconds[stage], "s")
        least = min(seconds["first value"], seconds["processor"])
        limited = limit if name in first_value.FORMS else None
        yield Row(f"{told}, {way}: first value", least, "s", limited)
    yield Row(f"{told}: peak memory of the compilation", measured["peak_bytes"], "bytes")


def memory() -> Iterator[Row]:
    bare, added = _memory.after_import()
    yield Row("memory after import numpy", bare, "bytes")
    yield Row("memory that import mechc adds", added, "bytes")
    yield Row("memory of a run, dense, an accepted step", _memory.of_a_run(), "bytes")
    yield Row("memory of a batch, a member with two states", _memory.of_a_batch(), "bytes")


def installation(full: bool, found: dict[str, Any], skipped: dict[str, str]) -> Iterator[Row]:
    """Sizes of what is installed; what a clone is built to, and how long that takes."""
    installed = found["installed"] = _install.installed()
    yield Row("installed", installed["bytes"], "bytes")
    for part, size in installed["parts"].items():
        yield Row(f"  of it: {part}", size, "bytes")
    yield Row("installed files", installed["files"], "files")
    yield Row("installed, packed as in a wheel", installed["packed"], "bytes")
    try:
        found |= _built(full)
    except (_install.NoSourceTreeError, RuntimeError) as error:
        skipped["build"] = str(error)
    for what in ("sdist", "wheel", "venv", "pip install ."):
        for measure, value in found.get(what, {}).items():
            unit = {"wall": "s", "processor": "s", "files": "files"}.get(measure, "bytes")
            yield Row(f"{what}: {measure}", value, unit)


def _built(full: bool) -> dict[str, Any]:
    found = {"sdist": _install.source_distribution()}
    if full:
        found |= {"wheel": _install.wheel(), **_install.fresh_environment()}
    return found


def operations() -> Iterator[dict[str, Any]]:
    """Of all outputs, of one right-hand side, once a run; and what C is written for the program."""
    for name, mechanism in COUNTED.items():
        described, request = CompileRequest(
            mechanism(), CompileOptions(ConversionSettings(), {}, ())
        ).described()
        made = optimised(described, request, Stopwatch())
        texts = emit(made.program, made.equations, made.metadata, (BASELINE,), request)
        counts = json.loads(made.metadata)["operations"]
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


if __name__ == "__main__":
    sys.exit(main())
