"""Partial derivatives in the form of :meth:`sympy.Expr.diff`, by all symbols in one pass.

SymPy walks an expression once for each symbol, and differentiates factors again for each factor
beside them.  Sums, products, whole powers, sines and cosines are differentiated here; each part
once, also where expressions share it.
"""

from __future__ import annotations

from collections.abc import Callable, Container, Iterable, Mapping

from sympy import Add, Expr, Mul, Pow, S, Symbol, cos, diff, sin
from sympy.core.function import AppliedUndef

from mechc_codegen.description.piecewise import (
    held,
    is_held_product,
    released,
    with_signed,
    without_corners,
)
from mechc_codegen.description.terms import bottom_up

Partials = Mapping[Expr, Expr]


def as_written(value: Expr, symbol: Expr) -> Expr:
    """The derivative of what is no sum, by SymPy, in the functions that the value has."""
    return bottom_up(with_signed(value).diff(symbol), released, {})


def slope(value: Expr, symbol: Expr) -> Expr:
    """The derivative, rewritten without Piecewise and similar functions."""
    found = diff(bottom_up(value, held, {}), symbol)
    return bottom_up(found, lambda e: without_corners(released(e)), {})


class Derivatives:
    """Partial derivatives by what is ``asked``, symbols or functions of time; by default by all.

    ``other`` differentiates what the rules here do not.
    """

    def __init__(
        self, asked: Container[Expr] | None = None,
        other: Callable[[Expr, Expr], Expr] = as_written,
    ) -> None:  # fmt: skip
        self._asked, self._other = asked, other
        self._known: dict[Expr, Partials] = {}

    def of(self, expression: Expr, by: Expr) -> Expr:
        """The derivative of an expression by a symbol."""
        return self.all_of(expression).get(by, S.Zero)

    def all_of(self, expression: Expr) -> Partials:
        """The derivatives of an expression that are not 0, by symbol."""
        if expression not in self._known:
            made = self._made(expression)
            self._known[expression] = {x: d for x, d in made.items() if d != 0}
        return self._known[expression]

    def _made(self, e: Expr) -> Partials:
        if isinstance(e, Symbol):
            return {e: S.One} if self._is_asked(e) else {}
        if isinstance(e, Add):
            return _sums(each for term in e.args for each in self.all_of(term).items())
        if isinstance(e, Mul) and not is_held_product(e):
            return _sums(self._terms_of_product(e.args))
        if isinstance(e, Pow) and e.exp.is_Integer:
            outer = e.base ** (e.exp - 1)
            return {x: d * e.exp * outer for x, d in self.all_of(e.base).items()}
        if isinstance(e, sin):
            return self._chained(cos(*e.args), *e.args)
        if isinstance(e, cos):
            return self._chained(-sin(*e.args), *e.args)
        symbols = filter(self._is_asked, e.atoms(Symbol, AppliedUndef))
        return {x: self._other(e, x) for x in symbols}

    def _terms_of_product(self, factors: tuple[Expr, ...]) -> Iterable[tuple[Expr, Expr]]:
        for k, factor in enumerate(factors):
            for x, d in self.all_of(factor).items():
                yield x, Mul(*factors[:k], d, *factors[k + 1 :])

    def _chained(self, outer: Expr, inner: Expr) -> Partials:
        return {x: outer * d for x, d in self.all_of(inner).items()}

    def _is_asked(self, symbol: Expr) -> bool:
        return self._asked is None or symbol in self._asked


def _sums(terms: Iterable[tuple[Expr, Expr]]) -> Partials:
    found: dict[Expr, list[Expr]] = {}
    for x, term in terms:
        found.setdefault(x, []).append(term)
    return {x: Add(*each) for x, each in found.items()}
