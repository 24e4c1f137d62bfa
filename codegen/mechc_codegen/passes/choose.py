"""Choose: functions with corners and jumps become comparisons and selections."""

from __future__ import annotations

from sympy import Expr

from mechc_codegen.choices import without_corners
from mechc_codegen.passes.rewrite import rewrite_program
from mechc_codegen.program import Program
from mechc_codegen.terms import bottom_up


def choose(program: Program) -> Program:
    """Rewrite Piecewise, Max, Min, sign and Heaviside."""
    done: dict[Expr, Expr] = {}
    return rewrite_program(program, lambda e: bottom_up(e, without_corners, done))
