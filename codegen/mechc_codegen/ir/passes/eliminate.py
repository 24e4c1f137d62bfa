"""Eliminate common subexpressions over all outputs at once, hoisted and running part apart."""

from __future__ import annotations

from dataclasses import replace

from mechc_codegen.ir.passes.rewrite import with_common_named
from mechc_codegen.ir.program import Program, in_order_of_use


def eliminate_common(program: Program) -> Program:
    """Give every repeated subexpression a name of its own: ``h_k`` hoisted, ``z_k`` running."""
    hoisted, _ = with_common_named(program.hoisted, (), "h{}")
    body, outputs = with_common_named(program.body, program.outputs, "z{}")
    first, then = (tuple(in_order_of_use(statements)) for statements in (hoisted, body))
    return replace(program, hoisted=first, body=then, outputs=outputs)
