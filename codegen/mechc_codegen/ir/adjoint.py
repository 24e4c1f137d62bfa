"""After stage 4: Program -> Program with the derivatives of one number by everything given.

Input: a program with sensitivities.  Output: the same with c . (R, S, q') differentiated by the
state, parameters and inputs, where c are numbers that the function is given, R and S vanish at the
motion's accelerations and multipliers, and q' stands there unless it is u.  Invariant: reverse
accumulation from statement to statement (Griewank & Walther 2008, ch. 3), so that the work is a
small multiple of what R itself takes, however many parameters there are.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from sympy import Add, Expr, Symbol

from mechc_codegen.derive.equations import Output
from mechc_codegen.description.derivatives import Derivatives
from mechc_codegen.ir.passes.rewrite import with_common_named
from mechc_codegen.ir.program import (
    Assign,
    Program,
    slice_statements,
    symbols_in,
    symbols_of,
)
from mechc_codegen.ir.sensitivity import residual, sizes_of, with_statements

NAME = "residual_adjoint"


def add_adjoint(program: Program, derivatives: Derivatives) -> Program:
    """Add ``residual_adjoint``; its numbers c are the symbols' ``covector``."""
    symbols = program.symbols
    rates = [o.elements for o in program.outputs if o.name == "coordinate_rates"]
    values = [*residual(program), *(e for r in rates if r != symbols.u for e in r)]
    covector = tuple(Symbol(f"c{k}", real=True) for k in range(len(values)))
    inputs = [value.symbol for value in program.input_values()]
    given = (*symbols.q, *symbols.u, *symbols.parameters, *inputs)
    reverse = _Reverse(program, given, derivatives)
    elements = reverse.derivatives(values, covector)
    labels = tuple(f"{NAME}[{k}]" for k in range(len(given)))
    added = Output(NAME, "derivative of c . (R, S, q')", elements, (len(given),), labels)
    statements, (named,) = with_common_named(reverse.statements, [added], "b{}x", "none")
    outputs = (*program.outputs, named)
    whole = replace(program, symbols=replace(symbols, covector=covector), outputs=outputs)
    return with_statements(whole, statements).verify()


class _Reverse:
    """Derivatives of a weighted sum by each symbol, from the last statement to the first."""

    def __init__(self, program: Program, given: Sequence[Symbol], derivatives: Derivatives) -> None:
        self.program, self.given, self._derivatives = program, given, derivatives
        self.statements: list[Assign] = []
        self._terms: dict[Symbol, list[Expr]] = {}
        self._followed: set[Symbol] = set(given)
        self._sizes = sizes_of((*program.hoisted, *program.body))

    def derivatives(self, values: Sequence[Expr], weights: Sequence[Symbol]) -> tuple[Expr, ...]:
        """Derivatives of sum_k weights[k] values[k] by all given symbols."""
        body = slice_statements(self.program.body, symbols_in(values))
        used = symbols_in(values) | symbols_of(body)
        order = [*slice_statements(self.program.hoisted, used), *body]
        for statement in order:
            if statement.symbols & self._followed:
                self._followed.update(statement.targets)
        for value, weight in zip(values, weights, strict=True):
            self._hand_on(value, weight)
        for statement in reversed(order):
            if isinstance(statement, Assign):
                change = self._sum(statement.target)
            else:
                sine, cosine = statement.targets
                change = cosine * self._sum(sine) - sine * self._sum(cosine)
            self._hand_on(statement.value, self._name(change))
        return tuple(self._sum(symbol) for symbol in self.given)

    def _hand_on(self, value: Expr, change: Expr) -> None:
        """Add derivatives by the symbols of a value, from the derivative by the value itself."""
        if change == 0:
            return
        value = value.xreplace(self._sizes)
        partials = self._derivatives.all_of(value)
        for symbol in sorted(partials.keys() & self._followed, key=str):
            self._terms.setdefault(symbol, []).append(change * partials[symbol])

    def _sum(self, symbol: Symbol) -> Expr:
        return Add(*self._terms.pop(symbol, ()))

    def _name(self, value: Expr) -> Expr:
        if value.is_Atom or (-value).is_Atom:
            return value
        named = Symbol(f"b{len(self.statements)}", real=True)
        self.statements.append(Assign(named, value))
        return named
