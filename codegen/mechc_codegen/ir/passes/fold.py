"""Fold: fixed parameters become numbers; terms that vanish are omitted."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from sympy import Expr, Symbol

from mechc_codegen.ir.passes.rewrite import rewrite_program
from mechc_codegen.ir.program import Program


def fold(program: Program, fixed: Mapping[Symbol, Expr]) -> Program:
    """Put the fixed values in; the parameters stay in the list so that arrays keep their order."""
    if not fixed:
        return program
    values = dict(fixed)
    folded = rewrite_program(program, lambda e: e.xreplace(values))
    return replace(folded, outputs=folded.outputs)
