"""The instruction sets that a scene is compiled for."""

from __future__ import annotations

import platform
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from mechc_codegen.derive.equations import Equations

CPU_INFO = Path("/proc/cpuinfo")
# Bound for rows solved together: beyond it, factors of all lanes would overflow a stack of 8 MB.
MOST_SQUARES = 65536  # squares of the speeds, times lanes


@dataclass(frozen=True)
class InstructionSet:
    """A compilation of the scene: its lanes and the compiler flags that allow them."""

    name: str
    lanes: int
    flags: tuple[str, ...]


BASELINE = InstructionSet("baseline", 2, ())
WIDER = (
    InstructionSet("avx2", 4, ("-mavx2", "-mfma")),
    InstructionSet(
        "avx512",
        8,
        ("-mavx512f", "-mavx512dq", "-mavx512vl", "-mavx2", "-mfma", "-mprefer-vector-width=512"),
    ),
)


def instruction_sets(machine: str | None = None) -> tuple[InstructionSet, ...]:
    """The baseline and, on x86-64, wider sets, among which a program chooses at start."""
    machine = machine or platform.machine()
    return (BASELINE, *WIDER) if machine.lower() in {"x86_64", "amd64"} else (BASELINE,)


def sets_of_this_processor() -> tuple[InstructionSet, ...]:
    """Those that run here."""
    features = set(cpu_info().get("flags", "").split())
    return tuple(
        s for s in instruction_sets() if {f[2:] for f in s.flags if "=" not in f} <= features
    )


def cpu_info() -> dict[str, str]:
    """Fields of the first processor; the others are equal."""
    found: dict[str, str] = {}
    if CPU_INFO.exists():
        with CPU_INFO.open() as lines:
            for line in iter(lines.readline, ""):
                if not line.strip():
                    break
                found[line.split(":")[0].strip()] = line
    return found


def with_fitting_lanes(chosen: InstructionSet, equations: Equations) -> InstructionSet:
    """The set with fewer lanes, at least two, if a scene with loops has very many speeds."""
    if not equations.holonomic + equations.nonholonomic:
        return chosen
    lanes = chosen.lanes
    while lanes > BASELINE.lanes and lanes * len(equations.symbols.u) ** 2 > MOST_SQUARES:
        lanes //= 2
    return replace(chosen, lanes=lanes)
