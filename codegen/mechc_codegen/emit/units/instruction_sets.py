"""The instruction sets that a scene is compiled for."""

from __future__ import annotations

import platform
from dataclasses import dataclass, replace

from mechc_codegen.derive.equations import Equations

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


def instruction_sets() -> tuple[InstructionSet, ...]:
    """The baseline and, on x86-64, wider sets, among which a program chooses at start."""
    return (BASELINE, *WIDER) if platform.machine() in {"x86_64", "AMD64"} else (BASELINE,)


def with_fitting_lanes(chosen: InstructionSet, equations: Equations) -> InstructionSet:
    """The set with fewer lanes, at least two, if a scene with loops has very many speeds."""
    if not equations.holonomic + equations.nonholonomic:
        return chosen
    lanes = chosen.lanes
    while lanes > BASELINE.lanes and lanes * len(equations.symbols.u) ** 2 > MOST_SQUARES:
        lanes //= 2
    return replace(chosen, lanes=lanes)
