"""Expressions of C, composed by Python's operators, and statements that hold them.

Input: names, numbers, what SymPy prints.  Output: text.  Invariant: every expression knows how
strongly its outermost operator binds, so that its parts have the parentheses that the tree needs,
and no others.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import reduce
from operator import add
from typing import Final

CHOICE, BOTH, EQUAL, ORDER, SUM, PRODUCT, SIGN, ATOM = range(8)  # ascending
_BINDS: Final = {"+": SUM, "-": SUM, "*": PRODUCT, "/": PRODUCT, "&": BOTH,
                 "==": EQUAL, "!=": EQUAL, ">": ORDER, ">=": ORDER, "<": ORDER}  # fmt: skip


@dataclass(frozen=True)
class Value:
    """An expression of C.

    ``binds``: how strongly its outermost operator does.  ``reads``: the names in it.
    ``operations``: number of operators and calls; a product and its addition are one.  ``factors``:
    those of a product, for its addition.
    """

    text: str
    binds: int = ATOM
    reads: frozenset[str] = frozenset()
    operations: int = 0
    factors: tuple[Value, Value] | None = None

    def __str__(self) -> str:
        return self.text

    def __getitem__(self, place: Value | int) -> Value:
        inside = number(place)
        return Value(f"{self.within(ATOM)}[{inside}]", ATOM, self.reads | inside.reads)

    def __add__(self, other: Value | float) -> Value:
        return _joined(self, "+", other)

    def __sub__(self, other: Value | float) -> Value:
        return _joined(self, "-", other)

    def __mul__(self, other: Value | float) -> Value:
        return _joined(self, "*", other)

    def __rmul__(self, other: float) -> Value:
        return _joined(other, "*", self)

    def __truediv__(self, other: Value | float) -> Value:
        return _joined(self, "/", other)

    def __rtruediv__(self, other: float) -> Value:
        return _joined(other, "/", self)

    def __neg__(self) -> Value:
        return self._signed("-")

    def __and__(self, other: Value) -> Value:
        return _joined(self, "&", other)

    def __invert__(self) -> Value:
        return self._signed("~")

    def compared(self, sign: str, other: Value | float) -> Value:
        """The mask of the lanes where a comparison holds."""
        condition = _joined(self, sign, other)
        return Value(f"R_MASK({condition})", ATOM, condition.reads, condition.operations)

    def choose(self, one: Value | int, other: Value | int) -> Value:
        """One where this is not zero, else the other: of scalars in C, not of lanes."""
        parts = self, number(one), number(other)
        texts = [part.within(BOTH) for part in parts]
        return Value("{} ? {} : {}".format(*texts), CHOICE, *_joint(parts))

    def address(self) -> Value:
        return Value(f"&{self.within(ATOM)}", SIGN, self.reads)

    def within(self, least: int) -> str:
        """The text as a part of an expression whose parts have to bind at least so strongly."""
        return self.text if self.binds >= least else f"({self.text})"

    def _signed(self, sign: str) -> Value:  # a sign is no operation of its own
        factors = (-self.factors[0], self.factors[1]) if self.factors and sign == "-" else None
        return Value(f"{sign}{self.within(ATOM)}", SIGN, self.reads, self.operations, factors)


def named(text: str) -> Value:
    return Value(text, ATOM, frozenset({text}))


def call(function: str, *arguments: Value) -> Value:
    """A call of a function or macro."""
    reads, operations = _joint(arguments)
    return Value(f"{function}({', '.join(map(str, arguments))})", ATOM, reads, operations + 1)


def fma(one: Value, other: Value, more: Value, by: str = "R_FMA") -> Value:
    """A product and its addition, rounded once where the processor can: no compiler chooses."""
    return call(by, *(part if part.reads else real_of(part) for part in (one, other, more)))


def select(mask: Value, one: Value, other: Value) -> Value:
    """One in the lanes of the mask, the other elsewhere."""
    return call("R_SELECT", mask, one, other)


def real(number: float) -> Value:
    """A number whose C type is ``real``."""
    return Value(f"R({number!r})")


def real_of(number: Value) -> Value:
    """The same of a number that is a text of C already."""
    return number if "R(" in number.text else Value(f"R({number})")


def stride(index: Value, width: int) -> Value:
    """So many numbers an index, in whole numbers, whose sums are not fused."""
    return replace(index * width, factors=None)


def total(terms: Iterable[Value]) -> Value:
    """The sum of at least one term."""
    return reduce(add, terms)


def number(of: Value | float) -> Value:
    """A number of C as it is in Python, or what is a value already."""
    return of if isinstance(of, Value) else Value(repr(of), SIGN if of < 0 else ATOM)


def _joint(parts: Sequence[Value]) -> tuple[frozenset[str], int]:
    reads = frozenset[str]().union(*(part.reads for part in parts))
    return reads, sum(part.operations for part in parts)


def _joined(left: Value | float, sign: str, right: Value | float) -> Value:
    """Two values around an operator, all of which associate to the left."""
    one, other, binds = number(left), number(right), _BINDS[sign]
    if binds == SUM and other.factors:
        return fma(*other.factors, one, "R_FNMA" if sign == "-" else "R_FMA")
    if binds == SUM and one.factors:
        return fma(*one.factors, other, "R_FMS" if sign == "-" else "R_FMA")
    reads, operations = _joint((one, other))
    text = f"{one.within(binds)} {sign} {other.within(binds + 1)}"
    return Value(text, binds, reads, operations + 1, (one, other) if sign == "*" else None)


@dataclass(frozen=True)
class Line:
    """A statement, in one line or several, with the names that it defines and uses."""

    text: tuple[str, ...]
    defines: tuple[str, ...] = ()
    uses: frozenset[str] = frozenset()
    operations: int = 0


def let(target: str, value: Value, kind: str = "const real", comment: str = "") -> Line:
    """The definition of a value."""
    text = f"{kind} {target} = {value};{comment}"
    return Line((text,), (target,), value.reads, value.operations)


def put(place: Value, value: Value, sign: str = "=", comment: str = "") -> Line:
    """An assignment."""
    text = f"{place} {sign} {value};{comment}"
    return Line((text,), (), place.reads | value.reads, value.operations)


def do(value: Value) -> Line:
    """A call for what it does."""
    return Line((f"{value};",), (), value.reads, value.operations)


def sine_cosine(value: Value, targets: Sequence[str], *more: Value, by: str = "sincos") -> Line:
    """The definition of a sine and a cosine."""
    places = [named(target).address() for target in targets]
    made = call(f"FN({by})", value, *more, *places)
    return Line((f"real {', '.join(targets)};", f"{made};"), tuple(targets), made.reads)


def block(head: str, lines: Iterable[Line]) -> Line:
    """Statements in braces, after the head of a loop."""
    inside = list(lines)
    text = (f"{head} {{".lstrip(), *(f"    {each}" for each in texts(inside)), "}")
    uses = frozenset[str]().union(*(line.uses for line in inside))
    return Line(text, (), uses, sum(line.operations for line in inside))


def loop(count: int, lines: Iterable[Line]) -> Line:
    """Statements for every ``i`` below a count."""
    return block(f"for (int i = 0; i < {count}; i++)", lines)


def texts(lines: Iterable[Line]) -> list[str]:
    """The lines of text."""
    return [text for line in lines for text in line.text]


def without_unused(lines: Sequence[Line]) -> list[Line]:
    """The statements without definitions that none after them uses."""
    kept, used = list[Line](), set[str]()
    for line in reversed(lines):
        if not line.defines or used.intersection(line.defines):
            kept.append(line)
            used |= line.uses
    return kept[::-1]
