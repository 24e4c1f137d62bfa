"""Eliminate common subexpressions over all outputs at once, hoisted and running part apart."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from sympy import Expr, Symbol, cse

from mechc_codegen.derive.equations import Output
from mechc_codegen.ir.passes.rewrite import rewrite_statement
from mechc_codegen.ir.program import Assign, Program, Statement


def eliminate_common(program: Program) -> Program:
    """Give every repeated subexpression a name of its own: ``h_k`` hoisted, ``z_k`` running."""
    hoisted, _ = _eliminate(program.hoisted, (), "h")
    body, outputs = _eliminate(program.body, program.outputs, "z")
    return replace(program, hoisted=hoisted, body=body, outputs=outputs)


def _eliminate(
    statements: tuple[Statement, ...], outputs: tuple[Output, ...], prefix: str
) -> tuple[tuple[Statement, ...], tuple[Output, ...]]:
    values = [s.value for s in statements] + [e for o in outputs for e in o.elements]
    if not values:
        return statements, outputs
    common, reduced = cse(values, symbols=_make_symbols(prefix), list=False)
    rewritten = iter(reduced)
    kept = [rewrite_statement(s, lambda _: next(rewritten)) for s in statements]
    finished = tuple(
        replace(output, elements=tuple(next(rewritten) for _ in output.elements))
        for output in outputs
    )
    named: list[Statement] = [Assign(symbol, value) for symbol, value in common]
    return tuple(_in_order([*named, *kept])), finished


def _in_order(statements: list[Statement]) -> Iterator[Statement]:
    """The statements, each after those that it uses, otherwise in the given order."""
    by_target = {target: s for s in statements for target in s.targets}
    placed: set[int] = set()
    for statement in statements:
        stack = [statement]
        while stack:
            waiting = [by_target[x] for x in _sorted_symbols(stack[-1].value) if x in by_target]
            missing = [s for s in waiting if id(s) not in placed]
            if missing:
                stack.append(missing[0])
                continue
            ready = stack.pop()
            if id(ready) not in placed:
                placed.add(id(ready))
                yield ready


def _sorted_symbols(value: Expr) -> list[Symbol]:
    return sorted(value.free_symbols, key=str)


def _make_symbols(prefix: str) -> Iterator[Symbol]:
    k = 0
    while True:
        yield Symbol(f"{prefix}{k}", real=True)
        k += 1
