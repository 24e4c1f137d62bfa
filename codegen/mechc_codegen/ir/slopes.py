"""Partial derivatives of the values of statements, by all of their symbols in one pass.

SymPy's `diff` walks a value once for each symbol.  Sums, products, whole powers, sines and cosines
are differentiated here, each part once, and remembered; SymPy differentiates the rest.
"""

from __future__ import annotations

from collections.abc import Iterable

from sympy import Add, Expr, Mul, Pow, S, Symbol, cos, diff, sin

from mechc_codegen.description.piecewise import held, released, without_corners
from mechc_codegen.description.terms import bottom_up

Slopes = dict[Symbol, Expr]


class Differentiator:
    """Partial derivatives of values; it remembers those of every part."""

    def __init__(self) -> None:
        self._known: dict[Expr, Slopes] = {}
        self._plain: dict[Expr, bool] = {}

    def of(self, value: Expr) -> Slopes:
        """The partial derivatives that are not 0, by symbol."""
        if value not in self._known:
            self._known[value] = self._made(value)
        return self._known[value]

    def _made(self, value: Expr) -> Slopes:
        if isinstance(value, Symbol):
            return {value: S.One}
        if isinstance(value, Add):
            return _sums((x, slope) for term in value.args for x, slope in self.of(term).items())
        if not self._is_plain(value):
            by = {x: slope(value, x) for x in value.free_symbols}
            return {x: found for x, found in by.items() if found != 0}
        if isinstance(value, Mul):
            return self._of_product(value)
        if isinstance(value, Pow):
            base, n = value.args
            return self._chained(n * base ** (n - 1), base)
        if isinstance(value, sin):
            return self._chained(cos(value.args[0]), value.args[0])
        if isinstance(value, cos):
            return self._chained(-sin(value.args[0]), value.args[0])
        return {}

    def _of_product(self, value: Mul) -> Slopes:
        factors = value.args
        return _sums(
            (x, Mul(*factors[:k], slope, *factors[k + 1 :]))
            for k, factor in enumerate(factors)
            for x, slope in self.of(factor).items()
        )

    def _chained(self, outer: Expr, inner: Expr) -> Slopes:
        return {x: outer * slope for x, slope in self.of(inner).items()}

    def _is_plain(self, value: Expr) -> bool:
        """Whether the rules here differentiate it: nothing of it is held together as a whole."""
        if value not in self._plain:
            known = not value.args or isinstance(value, Add | Mul | sin | cos)
            whole = isinstance(value, Pow) and value.exp.is_Integer
            self._plain[value] = (known or whole) and all(map(self._is_plain, value.args))
        return self._plain[value]


def _sums(terms: Iterable[tuple[Symbol, Expr]]) -> Slopes:
    found: dict[Symbol, list[Expr]] = {}
    for x, term in terms:
        found.setdefault(x, []).append(term)
    sums = {x: Add(*each) for x, each in found.items()}
    return {x: total for x, total in sums.items() if total != 0}


def slope(value: Expr, symbol: Symbol) -> Expr:
    """The derivative, rewritten without Piecewise and similar functions."""
    found = diff(bottom_up(value, held, {}), symbol)
    return bottom_up(found, lambda e: without_corners(released(e)), {})
