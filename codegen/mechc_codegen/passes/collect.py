"""Collect: terms of a sum that differ in their parameters only become one term.

``m1 l0 l1/2 (s s + c c) + m2 l0 l1 (s s + c c)`` becomes ``(m1 l0 l1/2 + m2 l0 l1) (s s + c c)``,
whose coefficient is then hoisted.  A rewriting is kept only where it costs less per evaluation.
"""

from __future__ import annotations

from collections.abc import Iterator

from sympy import Add, Expr, Mul, S, Symbol

from mechc_codegen.passes.rewrite import bottom_up, rewrite_program
from mechc_codegen.program import Assign, Program, count_operations


def collect(program: Program) -> Program:
    """Collect the parameter coefficients of every sum that is written out as a whole."""
    if any(isinstance(statement, Assign) for statement in program.body):
        return program
    parameters = set(program.symbols.parameters)
    done: dict[Expr, Expr] = {}

    def rewrite(expression: Expr) -> Expr:
        if not isinstance(expression, Add):
            return expression
        collected = _collect_sum(expression, parameters)
        cheaper = cost(collected, parameters) < cost(expression, parameters)
        return collected if cheaper else expression

    return rewrite_program(program, lambda e: bottom_up(e, rewrite, done))


def cost(expression: Expr, parameters: set[Symbol]) -> int:
    """Operations per evaluation once everything of parameters alone is hoisted."""
    return count_operations(_without_parameters(expression, parameters))


def _without_parameters(expression: Expr, parameters: set[Symbol]) -> Expr:
    """The expression with each maximal parameter-only part replaced by one symbol."""
    constant = Symbol("_constant")
    if not expression.free_symbols - parameters:
        return constant if expression.free_symbols else expression
    if isinstance(expression, (Add, Mul)):
        state = [a for a in expression.args if a.free_symbols - parameters]
        fixed = [a for a in expression.args if a.free_symbols and a not in state]
        kept = [_without_parameters(a, parameters) for a in state]
        head = [constant] if fixed else [a for a in expression.args if not a.free_symbols]
        return expression.func(*head, *kept, evaluate=False)
    if not expression.args:
        return expression
    args = [_without_parameters(a, parameters) for a in expression.args]
    return expression.func(*args, evaluate=False) if args else expression


def _collect_sum(expression: Add, parameters: set[Symbol]) -> Expr:
    coefficients: dict[Expr, Expr] = {}
    for coefficient, cofactor in _terms(expression, parameters):
        cofactor, sign = _signed(cofactor)
        coefficients[cofactor] = coefficients.get(cofactor, S.Zero) + sign * coefficient
    return Add(*(c * cofactor for cofactor, c in coefficients.items()))


def _terms(expression: Expr, parameters: set[Symbol]) -> Iterator[tuple[Expr, Expr]]:
    """(parameter coefficient, cofactor) of each term, through sums that a coefficient scales."""
    for term in Add.make_args(expression):
        factors = Mul.make_args(term)
        fixed = Mul(*(f for f in factors if not f.free_symbols - parameters))
        state = [f for f in factors if f.free_symbols - parameters]
        sums = [f for f in state if isinstance(f, Add) and f.free_symbols & parameters]
        if len(sums) != 1:
            yield fixed, Mul(*state)
            continue
        rest = Mul(*(f for f in state if f is not sums[0]))
        for coefficient, cofactor in _terms(sums[0], parameters):
            yield fixed * coefficient, rest * cofactor


def _signed(cofactor: Expr) -> tuple[Expr, int]:
    """Make ``b - a`` and ``a - b`` one cofactor up to sign."""
    sign, factors = 1, []
    for factor in Mul.make_args(cofactor):
        if isinstance(factor, Add) and factor.could_extract_minus_sign():
            factor, sign = -factor, -sign
        factors.append(factor)
    return Mul(*factors), sign
