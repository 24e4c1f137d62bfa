"""Helpers that the passes share."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import count

from sympy import Symbol, cse

from mechc_codegen.derive.equations import Output
from mechc_codegen.description.terms import Rewrite
from mechc_codegen.ir.program import Assign, Program, Statement


def rewrite_program(program: Program, rewrite: Rewrite) -> Program:
    """Apply one rewriting to every expression of the body and of the outputs."""
    body, outputs = _rewrite_all(program.body, program.outputs, rewrite)
    return replace(program, body=tuple(body), outputs=outputs)


def with_common_named(
    statements: Sequence[Statement],
    outputs: Sequence[Output],
    name: str,
    order: str = "canonical",
) -> tuple[list[Statement], tuple[Output, ...]]:
    """Statements and outputs with common subexpressions as statements of their own, the first.

    ``name``: of those, with a place for the number; ``order``: of arguments, as in SymPy's ``cse``.
    """
    values = [s.value for s in statements] + [e for o in outputs for e in o.elements]
    names = (Symbol(name.format(k), real=True) for k in count())
    common, reduced = cse(values, symbols=names, list=False, order=order)
    left = iter(reduced)
    kept, finished = _rewrite_all(statements, outputs, lambda _: next(left))
    return [*(Assign(symbol, value) for symbol, value in common), *kept], finished


def _rewrite_all(
    statements: Sequence[Statement], outputs: Sequence[Output], rewrite: Rewrite
) -> tuple[list[Statement], tuple[Output, ...]]:
    kept = list[Statement]()
    for statement in statements:
        value = rewrite(statement.value)
        kept.append(statement if value is statement.value else replace(statement, value=value))
    return kept, tuple(replace(o, elements=tuple(map(rewrite, o.elements))) for o in outputs)
