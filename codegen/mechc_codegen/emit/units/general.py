"""The unit that is compiled once for all scenes of a kind, and runs their tapes.

Input: a scene's functions.  Output: its kind, and the sources of the unit, in ``runtime/general/``
and ``runtime/tape/``.  Invariant: a scene that has no kind, since it is beyond the bounds
there, is served by a unit of its own alone.
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

# What scenes of a kind have: constraint rows, some of them on the configuration, closed forms.
KINDS = {
    "open": (),
    "rolling": ("ROWS",),
    "loops": ("ROWS", "LOOPS"),
    "one_freedom": ("ROWS", "LOOPS", "ONE_FREEDOM"),
    "one_freedom_rolling": ("ROWS", "ONE_FREEDOM"),
    "walked": ("WALKED",),
    "walked_loops": ("ROWS", "LOOPS", "WALKED"),
}
_MACROS = ("ROWS", "LOOPS", "ONE_FREEDOM", "WALKED")
_BOUNDS = ("bounds.h", "in_place_of_scene/scene_sizes.h")
_MOST_SPEEDS_OF_ONE_FREEDOM = 3  # loops/one_freedom.h


def kind_of(functions: SceneFunctions) -> str:
    """The name of a scene's kind, of :data:`KINDS`; empty: it has none."""
    equations, symbols = functions.equations, functions.program.symbols
    walked = equations.tree is not None
    if not _fits(functions, walked=walked):
        return ""
    rows, speeds = functions.rows, len(symbols.u)
    alone = not walked and rows > 0 and speeds == rows + 1 and speeds <= _MOST_SPEEDS_OF_ONE_FREEDOM
    loops = equations.holonomic > 0 or (walked and rows > 0)
    has = {"ROWS": rows > 0, "LOOPS": loops, "ONE_FREEDOM": alone}
    has["WALKED"] = walked
    found = tuple(macro for macro in _MACROS if has[macro])
    return next(name for name, macros in KINDS.items() if macros == found)


def kind_flags(kind: str) -> tuple[str, ...]:
    """The macros of a kind for the compiler."""
    return tuple(f"-DMECHC_KIND_{macro}={int(macro in KINDS[kind])}" for macro in _MACROS)


def unit_sources(kind: str, lanes: int, name: str) -> dict[str, str]:
    """The sources of the unit of a kind, for an instruction set of this name."""
    tapes = f'#define MECHC_LANES {lanes}\n#define MECHC_UNIT {name}\n#include "tape/unit.h"\n'
    found = {
        "general.c": _part(lanes, "general", "MECHC_PARTS_OF_GENERAL"),
        "derivatives.c": _part(lanes, "derivatives", "MECHC_PART_DERIVATIVES"),
        "tapes.c": tapes,
    }
    if {"ROWS", "WALKED"}.intersection(KINDS[kind]):  # without series
        return found
    for few in (0, 1):
        for momenta in (0, 1):
            sums = {"SERIES_FEW": few, "SERIES_MOMENTA": momenta}
            part = f"series_{few}{momenta}"
            found[f"{part}.c"] = _part(lanes, part, "MECHC_PART_TAYLOR", sums)
    return found


def _part(lanes: int, name: str, parts: str, series: Mapping[str, int] | None = None) -> str:
    more = "".join(f"#define MECHC_{macro} {value}\n" for macro, value in (series or {}).items())
    values = {"lanes": lanes, "unit": name, "parts": parts, "series": int(bool(series))}
    return template("general_unit.c.in").substitute(values, more=more)


def _fits(functions: SceneFunctions, *, walked: bool) -> bool:
    symbols, bounds = functions.program.symbols, _bounds(walked=walked)
    counts = {
        "NQ": len(symbols.q),
        "NU": len(symbols.u),
        "NC": functions.rows,
        "NP": len(symbols.parameters),
        "NK": len(functions.constants),
        "SAVED": functions.layout.kept + len(functions.saved),
        "TURNS": sum(isinstance(s, SineCosine) for s in functions.configuration),
        "NI": len(functions.program.input_values()),
        "SWITCHES": len(functions.outputs[SWITCHING].elements)
        if SWITCHING in functions.outputs
        else 0,
        "OWN": functions.own_rows,
        **{name.upper(): count for name, count in functions.layout.sizes.items()},
        "BLOCKS_KEPT": BlockElimination(functions.blocks).kept if functions.blocks else 0,
    }
    return all(count <= bounds.get(name, 1) for name, count in counts.items())


@lru_cache
def _bounds(*, walked: bool) -> Mapping[str, int]:
    """The bounds of the general unit, from its headers; ``walked``: for scenes that are."""
    folder = files("mechc_codegen") / "runtime" / "general"
    text = "".join((folder / name).read_text("utf-8") for name in _BOUNDS)
    found = dict[str, int]()
    for name, of_walked, value in re.findall(
        r"#define MECHC_(\w+)_MAX (?:\(MECHC_KIND_WALKED \? (\d+) : )?(\d+)\b", text
    ):
        found[name] = max(int(of_walked if of_walked and walked else value), found.get(name, 0))
    return found
