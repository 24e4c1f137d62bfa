"""The definitions of the symbols of an optimised program.

Input: a program.  Output: the definition of a symbol, and the time derivative of an expression in
terms of the state.  Invariant: the program is not changed.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from sympy import Add, Expr, Mul, Pow, S, Symbol, cos, exp, sin, tan

from mechc_codegen.description.piecewise import without_corners
from mechc_codegen.description.terms import bottom_up
from mechc_codegen.ir.operations import count_operations
from mechc_codegen.ir.program import Assign, Program, targets_of

_MOST_OPERATIONS = 300  # of an expression that is with_definitions: longer ones take long


@dataclass(frozen=True)
class Definitions:
    """The statements of a body by their symbols; the symbols that depend on parameters alone."""

    program: Program
    values: dict[Symbol, Expr]
    fixed: frozenset[Symbol]

    @classmethod
    def of(cls, program: Program) -> Definitions:
        values = dict[Symbol, Expr]()
        for statement in program.body:
            if isinstance(statement, Assign):
                values[statement.target] = statement.value
            else:
                values[statement.sine] = sin(statement.value)
                values[statement.cosine] = cos(statement.value)
        fixed = frozenset((*program.symbols.parameters, *targets_of(program.hoisted)))
        return cls(program, values, fixed)

    def look_up(self, e: Expr) -> Expr:
        """The definition of a symbol; any other expression as it is."""
        while e in self.values:
            e = self.values[e]
        return e

    def with_definitions(self, e: Expr) -> Expr:
        """An expression with the definitions of its symbols in their place, while it is short."""
        while count_operations(e) <= _MOST_OPERATIONS:
            used = e.free_symbols.intersection(self.values)
            if not used:
                break
            e = e.xreplace({x: self.values[x] for x in used})
        return e

    def is_fixed(self, e: Expr) -> bool:
        """Whether an expression depends on parameters alone."""
        return bool(e.free_symbols <= self.fixed)

    def varying(self, functions: Iterable[Expr]) -> tuple[Expr, ...]:
        """The functions that are not fixed, each once and with one sign."""
        found = dict[Expr, None]()
        for function in functions:
            if not self.is_fixed(function) and -function not in found:
                found[function] = None
        return tuple(found)

    def exponentials(self, e: Expr) -> list[Expr]:
        """The exponential functions among the factors of an expression."""
        factors = map(self.look_up, Mul.make_args(self.look_up(e)))
        return [x for x in factors if isinstance(x, exp)]

    def divisors(self, e: Expr) -> Iterator[Expr]:
        """Expressions that vanish at the poles of an expression."""
        for term in Add.make_args(self.look_up(e)):
            for factor in map(self.look_up, Mul.make_args(self.look_up(term))):
                if isinstance(factor, tan):
                    yield cos(factor.args[0])
                elif isinstance(factor, Pow) and factor.exp.is_negative:
                    yield factor.base
                elif isinstance(factor, (Add, Mul)) and factor != e:
                    yield from self.divisors(factor)

    def rate(self, e: Expr) -> Expr | None:
        """The time derivative of a function of coordinates and the time; None where it has other
        arguments, or q' is not u."""
        symbols, e = self.program.symbols, self.with_definitions(e)
        known = {*symbols.q, symbols.time, *self.fixed}
        has_rates = any(o.name == "coordinate_rates" for o in self.program.outputs)
        if has_rates or not e.free_symbols <= known:
            return None
        pairs = zip(symbols.q, symbols.u, strict=False)
        rate = sum((e.diff(q) * u for q, u in pairs), e.diff(symbols.time) + S.Zero)
        return bottom_up(rate, without_corners, {})
