"""Helpers that the passes share."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from sympy import Expr

from mechc_codegen.program import Program, Statement

Rewrite = Callable[[Expr], Expr]


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


def bottom_up(expression: Expr, rewrite: Rewrite, done: dict[Expr, Expr]) -> Expr:
    """Rewrite arguments first, each shared subexpression once; ``done`` remembers them."""
    if expression in done:
        return done[expression]
    if not expression.args:
        result = rewrite(expression)
    else:
        args = [bottom_up(a, rewrite, done) for a in expression.args]
        rebuilt = expression if tuple(args) == expression.args else expression.func(*args)
        result = rewrite(rebuilt)
    done[expression] = result
    return result
