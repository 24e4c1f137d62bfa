"""Helpers that the passes share."""

from __future__ import annotations

from dataclasses import replace

from mechc_codegen.description.terms import Rewrite
from mechc_codegen.ir.program import Program, Statement


def rewrite_program(program: Program, rewrite: Rewrite) -> Program:
    """Apply one rewriting to every expression of the body and of the outputs."""
    body = tuple(rewrite_statement(s, rewrite) for s in program.body)
    outputs = tuple(
        replace(output, elements=tuple(rewrite(e) for e in output.elements))
        for output in program.outputs
    )
    return replace(program, body=body, outputs=outputs)


def rewrite_statement(statement: Statement, rewrite: Rewrite) -> Statement:
    """The statement with its expression rewritten."""
    return replace(statement, value=rewrite(statement.value))
