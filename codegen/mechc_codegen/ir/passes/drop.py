"""Drop: remove statements that no output needs."""

from __future__ import annotations

from dataclasses import replace

from mechc_codegen.ir.program import Program, slice_statements, symbols_of


def drop(program: Program) -> Program:
    """Keep what the outputs depend on."""
    needed = symbols_of(program.outputs)
    body = slice_statements(program.body, needed)
    from_body = needed | symbols_of(body)
    hoisted = slice_statements(program.hoisted, from_body)
    return replace(program, hoisted=tuple(hoisted), body=tuple(body))
