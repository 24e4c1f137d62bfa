"""Stage 3: Equations -> Program.

Input: derived equations.  Output: a program whose statements are the intermediates that the
equations share, if any, and whose outputs hold the whole expressions.  Invariant: the program
computes exactly what the equations say.
"""

from __future__ import annotations

from sympy import S

from mechc_codegen.derive.equations import Equations, Output
from mechc_codegen.ir.program import Assign, Program

KEPT_APART = {"motion_constraints"}  # only its derived forms are emitted


def lower(equations: Equations) -> Program:
    """A program of the outputs that generated code computes; empty outputs are omitted."""
    kept = [
        output
        for name, output in equations.outputs.items()
        if output.elements and not _is_unused(name, equations)
    ]
    shared = tuple(Assign(symbol, value) for symbol, value in equations.intermediates)
    return Program(equations.symbols, (*kept, *_bias_of_speeds(equations)), body=shared)


def _is_unused(name: str, equations: Equations) -> bool:
    if name in ("coordinate_rates", "kinematic_matrix", "constraint_gradient"):
        return equations.identity_kinematics  # then q' is u, N the unit matrix, the gradient J
    return name in KEPT_APART


def _bias_of_speeds(equations: Equations) -> tuple[Output, ...]:
    """The bias b of the velocity constraints J u + b; absent where it vanishes."""
    if equations.tree is not None:  # its derivation has added it
        return ()
    velocity = equations.outputs["velocity_constraints"]
    at_rest = dict.fromkeys(equations.symbols.u, S.Zero)
    bias = tuple(e.xreplace(at_rest) for e in velocity.elements)
    if all(b == 0 for b in bias):
        return ()
    return (Output("velocity_bias", "b of J u + b = 0", bias, velocity.shape, velocity.labels),)
