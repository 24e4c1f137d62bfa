"""Stage 4: Program -> Program with the same values and less work.

Input: the lowered program.  Output: the optimised one.  Invariant: each pass keeps every output's
value; ``verify`` holds between passes.
"""

from __future__ import annotations

from collections.abc import Callable

from mechc_codegen.ir.passes import choose, collect, drop, eliminate_common, hoist, pair
from mechc_codegen.ir.program import Program

PASSES: tuple[Callable[[Program], Program], ...] = (
    choose,
    pair,
    collect,
    hoist,
    eliminate_common,
    drop,
)


def optimize(program: Program) -> Program:
    """Run all passes in their order."""
    for apply in PASSES:
        program = apply(program).verify()
    return program
