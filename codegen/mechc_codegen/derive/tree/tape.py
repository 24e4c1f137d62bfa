"""A list of statements in which every value is computed once, and vectors of such values."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

from sympy import Expr, Mul, S, Symbol

from mechc_codegen.description.placement import cross, dot

V3 = tuple[Expr, Expr, Expr]
ZERO: V3 = (S.Zero, S.Zero, S.Zero)


class Tape:
    """Values named in the order in which they are computed.

    Values of parameters alone are not named: they are hoisted later.
    """

    def __init__(self, parameters: Iterable[Symbol]) -> None:
        self.statements: list[tuple[Symbol, Expr]] = []
        self.parameters = set(parameters)
        self._known: dict[Expr, Symbol] = {}

    def keep(self, value: Expr) -> Expr:
        """A symbol that stands for the value, or the value itself where that is as short."""
        if self._short(value):
            return value
        known = self._known.get(value)
        if known is not None:
            return known
        opposite = self._known.get(-value)
        if opposite is not None:
            return -opposite
        symbol = Symbol(f"w{len(self.statements)}", real=True)
        self.statements.append((symbol, value))
        self._known[value] = symbol
        return symbol

    def needed(self, values: Iterable[Expr]) -> list[tuple[Symbol, Expr]]:
        """The statements that the values depend on, in order."""
        wanted = {symbol for value in values for symbol in value.free_symbols}
        found = []
        for symbol, value in reversed(self.statements):
            if symbol in wanted:
                found.append((symbol, value))
                wanted |= value.free_symbols
        return found[::-1]

    def _short(self, value: Expr) -> bool:
        if not value.args or value.free_symbols <= self.parameters:
            return True
        return (
            isinstance(value, Mul)
            and len(value.args) == 2
            and value.args[0] == -1
            and isinstance(value.args[1], Symbol)
        )

    def vector(self, components: Iterable[Expr]) -> V3:
        x, y, z = (self.keep(c) for c in components)
        return (x, y, z)

    def dot(self, a: Sequence[Expr], b: Sequence[Expr]) -> Expr:
        return self.keep(dot(a, b))

    def cross(self, a: V3, b: V3) -> V3:
        return self.vector(cross(a, b))

    def total(self, *vectors: V3) -> V3:
        return self.vector(sum(parts, S.Zero) for parts in zip(*vectors, strict=True))

    def difference(self, a: V3, b: V3) -> V3:
        return self.vector(x - y for x, y in zip(a, b, strict=True))

    def scale(self, factor: Expr, a: V3) -> V3:
        return self.vector(factor * x for x in a)

    def symmetric(self, entry: Callable[[int, int], Expr]) -> list[V3]:
        """A symmetric matrix, of which the lower half is stored."""
        lower = (self.keep(entry(i, j)) for i in range(3) for j in range(i + 1))
        xx, xy, yy, xz, yz, zz = lower
        return [(xx, xy, xz), (xy, yy, yz), (xz, yz, zz)]

    def transform(self, rows: Sequence[V3], a: Sequence[Expr]) -> V3:
        """Matrix times vector."""
        return self.vector(dot(row, a) for row in rows)


def vanishes(vector: Iterable[Expr]) -> bool:
    return all(x == 0 for x in vector)
