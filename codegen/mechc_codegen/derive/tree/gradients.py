"""Derivatives of values on the tape by some of its symbols, statement by statement."""

from __future__ import annotations

from collections.abc import Sequence

from sympy import Expr, S, Symbol

from mechc_codegen.derive.tree.tape import Tape
from mechc_codegen.description.derivatives import Derivatives


def gradients(tape: Tape, values: Sequence[Expr], by: Sequence[Symbol]) -> list[list[Expr]]:
    """The derivatives of each value, a row each, as values on the tape."""
    derivatives = Derivatives()
    found: dict[Symbol, dict[int, Expr]] = {q: {k: S.One} for k, q in enumerate(by)}

    def gradient(value: Expr) -> dict[int, Expr]:
        sums: dict[int, Expr] = {}
        for symbol, partial in derivatives.all_of(value).items():
            for k, along in found.get(symbol, {}).items():
                sums[k] = sums.get(k, S.Zero) + partial * along
        return {k: tape.keep(total) for k, total in sums.items() if total != 0}

    for symbol, value in tape.needed(values):
        along = gradient(value)
        if along:
            found[symbol] = along
    rows = map(gradient, values)
    return [[row.get(k, S.Zero) for k in range(len(by))] for row in rows]
