"""Pair: sine and cosine of one argument become one statement with one range reduction."""

from __future__ import annotations

from dataclasses import replace

from sympy import Expr, Symbol, cos, sin, tan

from mechc_codegen.description.terms import bottom_up
from mechc_codegen.ir.passes.rewrite import rewrite_program
from mechc_codegen.ir.program import Program, SineCosine


def pair(program: Program) -> Program:
    """Replace sin, cos and tan by symbols ``s_k`` and ``c_k`` assigned together."""
    statements: dict[Expr, SineCosine] = {}
    done: dict[Expr, Expr] = {}

    def rewrite(expression: Expr) -> Expr:
        if not isinstance(expression, (sin, cos, tan)):
            return expression
        # One of x and -x stands for both, so that they share a statement.
        argument, sign = expression.args[0], 1
        if argument.could_extract_minus_sign():
            argument, sign = -argument, -1
        if argument not in statements:
            k = len(statements)
            names = (Symbol(f"sin{k}", real=True), Symbol(f"cos{k}", real=True))
            statements[argument] = SineCosine(*names, argument)
        both = statements[argument]
        if isinstance(expression, cos):
            return both.cosine
        return sign * (both.sine if isinstance(expression, sin) else both.sine / both.cosine)

    rewritten = rewrite_program(program, lambda e: bottom_up(e, rewrite, done))
    return replace(rewritten, body=(*statements.values(), *rewritten.body))
