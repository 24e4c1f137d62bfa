"""Hoist: expressions of parameters alone are computed once a run, into ``k0, k1, ...``."""

from __future__ import annotations

from dataclasses import replace

from sympy import Add, Basic, Expr, Mul, S, Symbol

from mechc_codegen.description.terms import bottom_up
from mechc_codegen.ir.passes.rewrite import rewrite_program
from mechc_codegen.ir.program import Assign, Program


def hoist(program: Program) -> Program:
    """Move parameter-only subexpressions into the hoisted part."""
    constants = _Constants(set(program.symbols.parameters))
    done: dict[Expr, Expr] = {}
    rewritten = rewrite_program(program, lambda e: bottom_up(e, constants.rewrite, done))
    finished = rewrite_program(rewritten, constants.whole)
    return replace(finished, hoisted=(*program.hoisted, *constants.statements()))


class _Constants:
    """The constants found so far, by value."""

    def __init__(self, parameters: set[Symbol]) -> None:
        self.parameters = parameters
        self.known: dict[Expr, Symbol] = {}
        self._fixed: dict[Basic, bool] = {}
        self._named: dict[Basic, bool] = {}

    def statements(self) -> list[Assign]:
        return [Assign(symbol, value) for value, symbol in self.known.items()]

    def constant(self, value: Expr) -> Expr:
        """A symbol for a parameter-only value; parameters and numbers stand for themselves."""
        if not value.args or not self.has_symbols(value):
            return value
        if -value in self.known:
            return -self.known[-value]
        return self.known.setdefault(value, Symbol(f"k{len(self.known)}", real=True))

    def has_symbols(self, expression: Basic) -> bool:
        """Whether an expression contains a symbol; results are stored."""
        known = self._named.get(expression)
        if known is None:
            known = isinstance(expression, Symbol) or any(map(self.has_symbols, expression.args))
            self._named[expression] = known
        return known

    def is_fixed(self, expression: Basic) -> bool:
        """Whether an expression has no symbols except parameters; results are stored."""
        known = self._fixed.get(expression)
        if known is None:
            if isinstance(expression, Symbol):
                known = expression in self.parameters
            else:
                known = all(map(self.is_fixed, expression.args))
            self._fixed[expression] = known
        return known

    def rewrite(self, expression: Expr) -> Expr:
        if self.is_fixed(expression) or not expression.args:
            return expression
        if not isinstance(expression, (Add, Mul)):  # constants inside powers and functions
            return expression.func(*map(self.whole, expression.args))
        fixed = [a for a in expression.args if self.is_fixed(a)]
        if not any(map(self.has_symbols, fixed)):  # numbers stand for themselves
            return expression
        state = [a for a in expression.args if not self.is_fixed(a)]
        if isinstance(expression, Add):
            return Add(self.constant(Add(*fixed)), *state)
        sign, magnitude = _split_sign(Mul(*fixed))
        return sign * self.constant(magnitude) * Mul(*state)

    def whole(self, expression: Expr) -> Expr:
        """An expression that is parameter-only as a whole becomes one constant."""
        known = self.is_fixed(expression) and self.has_symbols(expression)
        return self.constant(expression) if known else expression


def _split_sign(value: Expr) -> tuple[Expr, Expr]:
    return (S.NegativeOne, -value) if value.could_extract_minus_sign() else (S.One, value)
