"""Choose: functions with corners and jumps become comparisons and selections."""

from __future__ import annotations

from sympy import Expr

from mechc_codegen.description.piecewise import without_corners
from mechc_codegen.description.terms import bottom_up
from mechc_codegen.ir.passes.rewrite import rewrite_program
from mechc_codegen.ir.program import Program


def choose(program: Program) -> Program:
    """Rewrite Piecewise, Max, Min, sign and Heaviside."""
    done: dict[Expr, Expr] = {}
    return rewrite_program(program, lambda e: bottom_up(e, without_corners, done))
