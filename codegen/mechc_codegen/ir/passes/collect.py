"""Collect: terms of a sum that differ in their parameters only become one term.

``m1 l0 l1/2 (s s + c c) + m2 l0 l1 (s s + c c)`` becomes ``(m1 l0 l1/2 + m2 l0 l1) (s s + c c)``,
whose coefficient is then hoisted.  A rewriting is kept only where it costs less per evaluation.
"""

from __future__ import annotations

from collections.abc import Iterator

from sympy import Add, Expr, Mul, Symbol

from mechc_codegen.description.terms import bottom_up
from mechc_codegen.ir.operations import count_operations
from mechc_codegen.ir.passes.rewrite import rewrite_program
from mechc_codegen.ir.program import Assign, Program


def collect(program: Program) -> Program:
    """Collect the parameter coefficients of every sum that is written out as a whole."""
    if any(isinstance(statement, Assign) for statement in program.body):
        return program
    costs = _Costs(set(program.symbols.parameters))
    done: dict[Expr, Expr] = {}

    def rewrite(expression: Expr) -> Expr:
        if not isinstance(expression, Add):
            return expression
        collected = _collect_sum(expression, costs)
        if collected == expression:
            return expression
        return collected if costs.of(collected) < costs.of(expression) else expression

    return rewrite_program(program, lambda e: bottom_up(e, rewrite, done))


def cost(expression: Expr, parameters: set[Symbol]) -> int:
    """Operations per evaluation once everything of parameters alone is hoisted."""
    return _Costs(parameters).of(expression)


class _Costs:
    """Operations per evaluation once everything of parameters alone is hoisted.

    Sums share most of their terms, so what is known of a subexpression is kept.
    """

    constant = Symbol("_constant")

    def __init__(self, parameters: set[Symbol]) -> None:
        self.parameters = parameters
        self._symbols: dict[Expr, tuple[bool, bool]] = {}
        self._without: dict[Expr, Expr] = {}

    def of(self, expression: Expr) -> int:
        return count_operations(self.without_parameters(expression))

    def moves(self, expression: Expr) -> bool:
        """Whether an expression contains anything besides parameters and numbers."""
        return self._kinds(expression)[0]

    def parametric(self, expression: Expr) -> bool:
        """Whether an expression contains a parameter."""
        return self._kinds(expression)[1]

    def _kinds(self, expression: Expr) -> tuple[bool, bool]:
        known = self._symbols.get(expression)
        if known is None:
            if isinstance(expression, Symbol):
                fixed = expression in self.parameters
                known = (not fixed, fixed)
            else:
                within = [self._kinds(a) for a in expression.args]
                known = (any(m for m, _ in within), any(p for _, p in within))
            self._symbols[expression] = known
        return known

    def without_parameters(self, expression: Expr) -> Expr:
        """The expression with each maximal parameter-only part replaced by one symbol."""
        if not self.moves(expression):
            return self.constant if self.parametric(expression) else expression
        if not expression.args:
            return expression
        if expression not in self._without:
            self._without[expression] = self._rebuilt(expression)
        return self._without[expression]

    def _rebuilt(self, expression: Expr) -> Expr:
        if not isinstance(expression, (Add, Mul)):
            args = [self.without_parameters(a) for a in expression.args]
            return expression.func(*args, evaluate=False)
        state = [a for a in expression.args if self.moves(a)]
        still = [a for a in expression.args if not self.moves(a)]
        fixed = any(self.parametric(a) for a in still)
        head = [self.constant] if fixed else still
        return expression.func(*head, *map(self.without_parameters, state), evaluate=False)


def _collect_sum(expression: Add, costs: _Costs) -> Expr:
    coefficients: dict[Expr, list[Expr]] = {}
    for coefficient, cofactor in _terms(expression, costs):
        cofactor, sign = _split_sign(cofactor)
        coefficients.setdefault(cofactor, []).append(sign * coefficient)
    return Add(*(Add(*of) * cofactor for cofactor, of in coefficients.items()))


def _terms(expression: Expr, costs: _Costs) -> Iterator[tuple[Expr, Expr]]:
    """(parameter coefficient, cofactor) of each term, through sums that a coefficient scales."""
    for term in Add.make_args(expression):
        factors = Mul.make_args(term)
        fixed = Mul(*(f for f in factors if not costs.moves(f)))
        state = [f for f in factors if costs.moves(f)]
        sums = [f for f in state if isinstance(f, Add) and costs.parametric(f)]
        if len(sums) != 1:
            yield fixed, Mul(*state)
            continue
        rest = Mul(*(f for f in state if f is not sums[0]))
        for coefficient, cofactor in _terms(sums[0], costs):
            yield fixed * coefficient, rest * cofactor


def _split_sign(cofactor: Expr) -> tuple[Expr, int]:
    """The cofactor with a normalised sign, so that ``b - a`` and ``a - b`` become one."""
    sign, factors = 1, []
    for factor in Mul.make_args(cofactor):
        if isinstance(factor, Add) and factor.could_extract_minus_sign():
            factor, sign = -factor, -sign
        factors.append(factor)
    return Mul(*factors), sign
