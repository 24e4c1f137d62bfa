"""Only what the scene needs, in numbers: five scenes, each with and without parameters fixed.

Every scene is compiled in an empty cache.  Operations: of one right-hand side (configuration and
speeds, without the solution for the accelerations), of parameters alone once a run, and of all
outputs at once.  C: what is written for the scene and one instruction set, without the runtime.
Binary: the whole, with all methods.  Seconds: until the first value, and until all is compiled.
Times of a right-hand side are minima, each call fed by the last.
"""

from __future__ import annotations

import os
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
from mechc_codegen import shipped_mechanism
from mechc_codegen.compiler import build_scene
from mechc_codegen.emit.units.instruction_sets import BASELINE
from mechc_codegen.library.chains.rods import planar_chain
from mechc_codegen.library.spatial.heavy_top import heavy_top

import mechc

from ..formulations.described import read
from ..timing.results import command_parser, write

USUAL = ("energy", "momenta", "points", "multipliers")
ALL = (*USUAL, "accelerations", "state_jacobian", "parameter_jacobian")
HEAD = (
    "scene", "rhs ops", "once a run", "all ops", "C bytes", "binary bytes", "ns a call", "first s",
    "whole s",
)  # fmt: skip


@dataclass(frozen=True)
class Case:
    """A scene: a mechanism and the options it is compiled with."""

    name: str
    described: Callable[[], Any]
    outputs: tuple[str, ...]
    fix: Mapping[str, float] = field(default_factory=dict)


four_bar = partial(shipped_mechanism, "four_bar")
RODS = {"l_0": 1.0, "l_1": 2.0, "l_2": 3.0, "l_3": 3.5, "m_0": 1.0, "m_1": 2.0, "m_2": 3.0}
CASES = [
    Case("four-bar, usual outputs", four_bar, USUAL),
    Case("  lengths, masses fixed", four_bar, USUAL, RODS),
    Case("four-bar, no outputs", four_bar, ()),
    Case("  g = 0", four_bar, (), {"g": 0.0}),
    Case("open chain of 3", partial(planar_chain, 3), ()),
    Case("  l = m = 1, g = 0", partial(planar_chain, 3), (), {"l": 1.0, "m": 1.0, "g": 0.0}),
    Case("heavy top", heavy_top, ("energy",)),
    Case("  g = 0", heavy_top, ("energy",), {"g": 0.0}),
    Case("four-bar, all there is", four_bar, ALL),
    Case("  lengths, masses fixed", four_bar, ALL, RODS),
]


def main(arguments: Sequence[str] | None = None) -> int:
    command_parser("scenes", __doc__).parse_args(arguments)
    print("  ".join(HEAD))
    rows = []
    for case in CASES:
        rows.append(measured(case))
        shown = (rows[-1][name] for name in HEAD)
        print("  ".join(f"{x:,.4g}" if isinstance(x, float) else str(x) for x in shown), flush=True)
    write("scenes", rows)
    return 0


def measured(case: Case) -> dict[str, Any]:
    """One line of the table; the cache is empty."""
    with (
        tempfile.TemporaryDirectory() as folder,
        patch.dict(os.environ, {"MECHC_CACHE_DIR": folder}),
    ):
        start = time.perf_counter()
        model = mechc.compile(case.described(), fix=case.fix, outputs=case.outputs)
        y = np.full((1, len(model.coordinates) + len(model.speeds)), 0.3)
        model.rhs(0.0, y)
        first = time.perf_counter() - start
        _ = model.capsule  # waits for all of it
        whole = time.perf_counter() - start
        size = max(path.stat().st_size for path in Path(folder).rglob("*.so"))
    counts = model.system.data["operations"]
    return {
        "scene": case.name, "rhs ops": sum(counts["stages"].values()),
        "once a run": counts["once_per_run"], "all ops": counts["after"], "C bytes": _c_bytes(case),
        "binary bytes": size, "ns a call": _nanoseconds(model, y[0]), "first s": first,
        "whole s": whole, "fix": dict(case.fix), "outputs": list(case.outputs),
        "stages s": dict(model.build["seconds"]), "outputs ops": counts["outputs"],
    }  # fmt: skip


def _c_bytes(case: Case) -> int:
    """Of all texts that are written for one instruction set."""
    mechanism, request = read(case.described(), fix=case.fix, outputs=case.outputs)
    built = build_scene(mechanism, (BASELINE,), request)
    return sum(len(text.encode()) for name, text in built.texts.items() if name != "scene.pyx")


def _nanoseconds(model: mechc.Model, y: Any) -> float:
    values = np.array(model.system.parameter_set.resolve(None))
    calls = 20_000
    return (
        min(model.system.scene.rates_seconds(0.0, y, values, calls) for _ in range(15))
        / calls
        * 1e9
    )
