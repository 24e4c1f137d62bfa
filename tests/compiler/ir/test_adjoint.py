"""Reverse derivatives of the residual: against differences of it taken with 40 digits."""

from __future__ import annotations

import random
from collections.abc import Callable
from typing import Any

import mpmath
import pytest
from mechc_codegen.compiler import Stopwatch, optimised_scene
from mechc_codegen.description.request import OutputRequest
from mechc_codegen.ir.adjoint import NAME
from mechc_codegen.ir.program import Program, operations, slice_statements, symbols_in
from mechc_codegen.ir.sensitivity import residual
from mechc_codegen.library.chains.rods import planar_chain
from mechc_codegen.library.chains.windows import windows

from tests.support import scenes
from tests.support.marks import slow_among

REQUEST = OutputRequest(frozenset({"sensitivities"}))
SCENES: dict[str, Callable[[], Any]] = {
    **scenes.SCENES,
    "tree": lambda: planar_chain(4),
    "tree with loops": lambda: windows(2),
}


def given_of(program: Program) -> list[Any]:
    """What the derivatives are by, in their order."""
    symbols = program.symbols
    inputs = [value.symbol for value in program.input_values()]
    return [*symbols.q, *symbols.u, *symbols.parameters, *inputs]


def weighed(program: Program, known: dict[Any, Any]) -> Any:
    """c . (R, S, q') at these values of all symbols."""
    at = scenes.run_statements(program, known)
    rates = [o.elements for o in program.outputs if o.name == "coordinate_rates"]
    elements = [*residual(program), *(rates[0] if rates else ())]
    found = [scenes.value(e, at) for e in elements]
    return mpmath.fdot(found, [known[c] for c in program.symbols.covector])


@pytest.mark.parametrize("scene", slow_among(SCENES, {"tree with loops"}))
def test_they_are_those_of_the_weighed_residual(scene: str) -> None:
    program = optimised_scene(SCENES[scene](), REQUEST, Stopwatch()).functions.program
    symbols, rng = program.symbols, random.Random(3)
    step = mpmath.mpf(10) ** -15
    with mpmath.workdps(40):
        every = [symbols.time, *given_of(program), *symbols.motion, *symbols.covector]
        known = {symbol: mpmath.mpf(rng.uniform(0.4, 1.6)) for symbol in every}
        found = scenes.run_program(program, known)[NAME]
        for symbol, derivative in zip(given_of(program), found, strict=True):
            ahead, behind = (
                weighed(program, {**known, symbol: known[symbol] + sign * step}) for sign in (1, -1)
            )
            wanted = (ahead - behind) / (2 * step)
            assert abs(derivative - wanted) < 1e-22 * (1 + abs(wanted)), symbol


@pytest.mark.slow
def test_they_cost_a_few_residuals_however_many_parameters() -> None:
    program = optimised_scene(SCENES["tree"](), REQUEST, Stopwatch()).functions.program

    def cost(elements: Any) -> int:
        return operations(slice_statements(program.body, symbols_in(elements)), elements)

    assert cost(program.output(NAME).elements) < 5 * cost(residual(program))
