"""The wait before the first motion, and the seconds of the compiler by the part of a unit.

    mechc bench wait [--out JSON] [NAME ...]

In a process of its own with an empty cache, of each mechanism of the library as a description of
one's own: from `compile` to the end of the first `simulate`, by the clock and in processor time
with the compiler's.  Import of mechc and making the description are not counted.  Then each part of
its unit is compiled by itself, in processor seconds.
"""

from __future__ import annotations

import json
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ...timing.processes import processor_seconds
from ...timing.results import command_parser
from .value import process

USUAL = ("pendulum", "four_bar", "andrews", "bicycle")
DERIVATION = ("describe", "derive", "differentiate", "optimize", "sensitivity", "emit")
FIRST = "first unit"


def main(arguments: Sequence[str] | None = None) -> int:
    parser = command_parser("wait", __doc__)
    parser.add_argument("--out", type=Path, metavar="JSON", help="a file for the figures")
    parser.add_argument("names", nargs="*", metavar="NAME", default=USUAL, help="mechanisms")
    chosen = parser.parse_args(arguments)
    rows = [measured(name) for name in chosen.names or USUAL]
    print("\n".join(line(row) for row in rows))
    if chosen.out:
        chosen.out.write_text(json.dumps(rows, indent=1) + "\n", "utf-8")
    return 0


def line(row: dict[str, Any]) -> str:
    """A row of figures as text."""
    parts = ", ".join(f"{name} {seconds:.2f}" for name, seconds in row["parts"].items())
    return (
        f"{row['name']}: {row['wait']:.2f} s, processor {row['processor']:.2f} s; "
        f"derivation {row['derivation']:.2f} s; compiler by part: {parts}"
    )


def measured(name: str) -> dict[str, Any]:
    """The figures of one mechanism, in seconds."""
    with tempfile.TemporaryDirectory() as folder:
        seconds = process(name, Path(folder), "motion")["seconds"]
    return {
        "name": name, "wait": seconds["first value"], "processor": seconds["processor"],
        "derivation": sum(seconds.get(stage, 0.0) for stage in DERIVATION),
        "parts": compiled_parts(name),
    }  # fmt: skip


def compiled_parts(name: str) -> dict[str, float]:
    """Processor seconds of compiling the first unit and each part, one after the other."""
    from mechc.native._driver import PARTS
    from mechc_codegen import build_scene, shipped_mechanism

    from mechc.compilation import entries
    from mechc.compilation.toolchain.processor import native

    build = build_scene(shipped_mechanism(name), (native(),))
    makers = {FIRST: lambda folder: entries.make_outputs_only(build, folder)}
    for part in PARTS if "MECHC_VARIATIONAL" in build.texts["scene_sizes.h"] else list(PARTS)[:-1]:
        makers[part] = lambda folder, part=part: entries.make_part(build, part, folder)
    found = {}
    for part, make in makers.items():
        with tempfile.TemporaryDirectory() as folder:
            before = processor_seconds()
            make(Path(folder))
            found[part] = processor_seconds() - before
    return found
