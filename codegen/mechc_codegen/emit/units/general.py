"""The unit that is compiled once for all scenes of a kind, and runs their tapes.

Input: a scene's functions.  Output: the macros of its kind, and the sources of the unit, in
``runtime/general/`` and ``runtime/tape/``.  Invariant: a scene that has no kind, since it is
walked link by link or beyond the bounds there, is served by a unit of its own alone.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import lru_cache
from importlib.resources import files

from mechc_codegen.emit.functions import SceneFunctions
from mechc_codegen.emit.units.block_elimination import BlockElimination
from mechc_codegen.emit.units.scene_files import template
from mechc_codegen.ir.program import SWITCHING, SineCosine

_BOUNDS = ("bounds.h", "in_place_of_scene/scene_sizes.h")
_MOST_SPEEDS_OF_ONE_FREEDOM = 3  # loops/one_freedom.h
_MOST_FREE = 3  # dynamics/motion.h


def kind_of(functions: SceneFunctions) -> tuple[str, ...]:
    """The macros of a scene's kind for the compiler; empty: it has none."""
    equations, symbols = functions.equations, functions.program.symbols
    if equations.tree is not None or not _fits(functions):
        return ()
    rows, speeds = functions.rows, len(symbols.u)
    alone = rows > 0 and speeds == rows + 1 and speeds <= _MOST_SPEEDS_OF_ONE_FREEDOM
    kind = {
        "ROWS": int(rows > 0),
        "LOOPS": int(equations.holonomic > 0),
        "IDENTITY": int(equations.identity_kinematics),
        "ONE_FREEDOM": speeds if alone else 0,
        "REDUCED": int(rows > 0 and 0 <= speeds - rows <= _MOST_FREE),
        "BLOCKS": int(functions.blocks is not None),
    }
    return tuple(f"-DMECHC_KIND_{name}={value}" for name, value in kind.items())


def general_source(lanes: int) -> str:
    """The source of the general unit: the driver and the methods of single runs."""
    return _unit(lanes, "general", "MECHC_PARTS_OF_GENERAL")


def tapes_source(lanes: int, unit: str) -> str:
    """The source of the unit that runs tapes, for the general unit of these lanes."""
    return f'#define MECHC_LANES {lanes}\n#define MECHC_UNIT {unit}\n#include "tape/unit.h"\n'


def series_source(lanes: int) -> str:
    """The source of the Taylor series of tapes, for scenes that have one."""
    return _unit(lanes, "series", "MECHC_PART_TAYLOR", series=1)


def _unit(lanes: int, name: str, parts: str, series: int = 0) -> str:
    values = {"lanes": lanes, "unit": name, "parts": parts, "series": series}
    return template("general_unit.c.in").substitute(values)


def _fits(functions: SceneFunctions) -> bool:
    symbols, bounds = functions.program.symbols, _bounds()
    counts = {
        "NQ": len(symbols.q),
        "NU": len(symbols.u),
        "NC": functions.rows,
        "NP": len(symbols.parameters),
        "NK": len(functions.constants),
        "SAVED": len(functions.saved),
        "TURNS": sum(isinstance(s, SineCosine) for s in functions.configuration),
        "NI": len(functions.program.input_values()),
        "SWITCHES": len(functions.outputs[SWITCHING].elements)
        if SWITCHING in functions.outputs
        else 0,
        "BLOCKS_KEPT": BlockElimination(functions.blocks).kept if functions.blocks else 0,
    }
    return all(count <= bounds[name] for name, count in counts.items())


@lru_cache
def _bounds() -> Mapping[str, int]:
    """The bounds of the general unit, from its headers."""
    folder = files("mechc_codegen") / "runtime" / "general"
    text = "".join((folder / name).read_text("utf-8") for name in _BOUNDS)
    found = dict[str, int]()
    for name, value in re.findall(r"#define MECHC_(\w+)_MAX (\d+)\b", text):
        found[name] = max(int(value), found.get(name, 0))  # of all kinds
    return found
