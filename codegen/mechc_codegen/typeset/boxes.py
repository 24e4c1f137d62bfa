"""Boxes: mathematics as nested rows, fractions, scripts and tables, before any markup.

Input: SymPy expressions, matrices, vectors, and names as a user typed them.  Output: boxes that
:mod:`mechc_codegen.typeset.markup` prints as MathML and as LaTeX.  Invariant: text from a user
is only ever the ``text`` of a :class:`Word`; the printers escape it there and nowhere else.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache, singledispatch
from itertools import pairwise
from typing import Any
from unicodedata import name as unicode_name

from sympy import (
    Add,
    Derivative,
    Expr,
    Float,
    Function,
    ImmutableDenseMatrix,
    MatrixBase,
    Mul,
    Pow,
    Rational,
    S,
    Symbol,
)
from sympy.core.function import AppliedUndef
from sympy.physics.mechanics import dynamicsymbols
from sympy.physics.vector import Vector

SMALL, CAPITAL = "αβγδεζηθικλμνξπρστυφχψω", "ΓΔΘΛΞΠΣΥΦΨΩ"
GREEK = (
    {unicode_name(c).split()[-1].lower(): c for c in SMALL}
    | {unicode_name(c).split()[-1].capitalize(): c for c in CAPITAL}
    | {"lambda": "λ", "Lambda": "Λ"}  # Unicode says lamda
)
_NAME = re.compile(r"([^\W\d_]+)(\d*)((?:_[^\W_]+)*)")
_WIDE, _LONG = 24.0, 60.0
MOST_KEPT = 50_000  # terms


@dataclass(frozen=True)
class Word:
    """One piece of text; ``kind`` is symbol, bold, number, operator, function or text."""

    text: str
    kind: str = "symbol"


@dataclass(frozen=True)
class Row:
    """Boxes side by side."""

    items: tuple[Box, ...]


@dataclass(frozen=True)
class Fraction:
    top: Box
    bottom: Box


@dataclass(frozen=True)
class Scripts:
    """A base with a subscript, a superscript or both."""

    base: Box
    sub: Box | None = None
    sup: Box | None = None


@dataclass(frozen=True)
class Accent:
    """A base under a ``hat``, a ``dot`` or a ``ddot``."""

    base: Box
    mark: str


@dataclass(frozen=True)
class Root:
    body: Box


@dataclass(frozen=True)
class Fence:
    """A box between growing brackets: ``()``, ``[]`` or ``||``."""

    body: Box
    brackets: str = "()"


@dataclass(frozen=True)
class Table:
    """Rows of cells, without brackets."""

    rows: tuple[tuple[Box, ...], ...]


Box = Word | Row | Fraction | Scripts | Accent | Root | Fence | Table
Term = tuple[str, Box]

PLUS, MINUS, SPACE = Word("+", "operator"), Word("\N{MINUS SIGN}", "operator"), Word("", "space")


def name(
    text: str,
    *,
    bold: bool = False,
    accent: str | None = None,
    index: Box | None = None,
    sup: Box | None = None,
) -> Box:
    """A name: ``theta_0`` is a theta with subscript 0, any other text is unchanged."""
    match = _NAME.fullmatch(text)
    if match is None:
        base, parts = Word(text, "text"), []
    else:
        word = GREEK.get(match[1], match[1])
        base = Word(word, "bold" if bold else "symbol")
        parts = [match[2], *match[3].split("_")]
    subs = [Word(GREEK.get(p, p), "number" if p.isdigit() else "symbol") for p in parts if p]
    below = _joined([*subs, *([index] if index else [])], Word(",", "operator"))
    marked = Accent(base, accent) if accent else base
    return Scripts(marked, below, sup) if below or sup else marked


def _joined(boxes: list[Box], between: Box) -> Box | None:
    if not boxes:
        return None
    items = [boxes[0]]
    for box in boxes[1:]:
        items += [between, box]
    return items[0] if len(items) == 1 else Row(tuple(items))


def width(box: Box | None) -> float:
    """A rough width in characters, to decide where lines are broken."""
    match box:
        case Word(text, _):
            return max(len(text), 0.3)
        case Row(items):
            return sum(map(width, items))
        case Fraction(top, bottom):
            return max(width(top), width(bottom))
        case Scripts(base, sub, sup):
            return width(base) + 0.7 * max(width(sub), width(sup))
        case Accent(body, _):
            return width(body)
        case Root(body) | Fence(body):
            return 1.5 + width(body)
        case Table(rows):
            return sum(1.5 + max(map(width, column)) for column in zip(*rows, strict=True))
    return 0.0


@singledispatch
def layout(thing: Any) -> Box:
    """The box of a SymPy expression, matrix or vector, or of a box itself."""
    return Fence(Word(str(thing), "text"))


@layout.register(Word)
@layout.register(Row)
@layout.register(Fraction)
@layout.register(Scripts)
@layout.register(Accent)
@layout.register(Root)
@layout.register(Fence)
@layout.register(Table)
def _(thing: Box) -> Box:
    return thing


@layout.register
def _(thing: str) -> Box:
    return Word(thing, "text")


@layout.register
def _(thing: int | float) -> Box:
    return layout(S(thing))


@layout.register(ImmutableDenseMatrix)
@layout.register(MatrixBase)
def _(matrix: Any) -> Box:
    rows = tuple(
        tuple(layout(matrix[r, c]) for c in range(matrix.cols)) for r in range(matrix.rows)
    )
    return Fence(Table(rows), "[]")


@layout.register(Vector)
def _(vector: Any) -> Box:
    return signed_row(terms(vector))


@layout.register(Expr)
def _(expression: Any) -> Box:
    return signed_row(terms(expression))


def terms(thing: Any) -> list[Term]:
    """The signed terms of a sum or a vector; one term for anything else."""
    if isinstance(thing, Vector):
        return _vector_terms(thing)
    if isinstance(thing, Expr) and not isinstance(thing, MatrixBase):
        parts = thing.as_ordered_terms() if isinstance(thing, Add) else [thing]
        return [_term(part) for part in parts]
    return [("+", layout(thing))]


def signed_row(parts: list[Term], leading: bool = True) -> Box:
    """Terms with their signs between them; a leading plus is only shown when not ``leading``."""
    items: list[Box] = []
    for sign, box in parts:
        if items or sign == "-" or not leading:
            items.append(MINUS if sign == "-" else PLUS)
        items.append(box)
    return items[0] if len(items) == 1 else Row(tuple(items))


def unit_vector(frame: str, axis: str) -> Box:
    """A hat over the frame's bold name, the axis as its index."""
    return name(frame, bold=True, accent="hat", index=Word(axis))


def _vector_terms(vector: Any) -> list[Term]:
    found: list[Term] = []
    for components, frame in sorted(vector.args, key=lambda part: part[1].index):
        for component, axis in zip(components, "xyz", strict=True):
            if component != 0:
                found += _along(component, unit_vector(frame.name, axis))
    return found or [("+", Word("0", "bold"))]


def _along(component: Any, unit: Box) -> list[Term]:
    """A component times its unit vector; a long sum term by term, so that lines can break."""
    if component in (1, -1):
        return [("+" if component == 1 else "-", unit)]
    parts = terms(component)
    if len(parts) > 1 and sum(width(box) for _, box in parts) < _LONG:
        parts = [("+", Fence(layout(component)))]
    return [(sign, Row((box, SPACE, unit))) for sign, box in parts]


@lru_cache(MOST_KEPT)
def _term(expression: Any) -> Term:
    """Sign and magnitude of a term; factors and sums recur in the terms of long equations."""
    if expression.could_extract_minus_sign() and (expression.is_Mul or expression.is_Number):
        coefficient, _ = expression.as_coeff_Mul()
        if coefficient.is_negative:
            return "-", _unsigned(-expression)
    return "+", _unsigned(expression)


def _unsigned(expression: Any) -> Box:
    for kind, rule in _RULES:
        if isinstance(expression, kind):
            return rule(expression)
    return Row((_word_of(expression), _arguments(expression.args)))


def _word_of(expression: Any) -> Box:
    return Word(type(expression).__name__, "function")


def _arguments(arguments: tuple[Any, ...]) -> Box:
    inside = _joined([layout(a) for a in arguments], Word(",", "operator"))
    return Fence(inside if inside else SPACE)


def _product(expression: Any) -> Box:
    above: list[Any] = []
    below: list[Any] = []
    coefficient, rest = expression.as_coeff_Mul()
    for factor in Mul.make_args(rest) if rest.is_commutative else rest.args:
        exponent = factor.exp if isinstance(factor, Pow) else S.One
        if exponent.is_Rational and exponent < 0:
            below.append(Pow(factor.base, -exponent))
        else:
            above.append(factor)
    above, below = (sorted(part, key=_reading_order) for part in (above, below))
    if not coefficient.is_Rational:
        above.insert(0, coefficient)
        coefficient = S.One
    return _quotient(coefficient, above, below)


def _quotient(coefficient: Any, above: list[Any], below: list[Any]) -> Box:
    """A fraction; in front of a long product only the number is one."""
    numerator, denominator = Rational(coefficient.p), Rational(coefficient.q)
    top = [_factor(f, alone=len(above) == 1 and numerator == 1) for f in above]
    if denominator != 1 and not below and sum(map(width, top)) > _WIDE:
        front = Fraction(layout(numerator), layout(denominator))
        return _side_by_side([front, *(_factor(f, alone=False) for f in above)])
    bottom = [_factor(f, alone=len(below) == 1 and denominator == 1) for f in below]
    if numerator != 1 or not top:
        top.insert(0, layout(numerator))
    if denominator != 1:
        bottom.insert(0, layout(denominator))
    if not bottom:
        return _side_by_side([_factor(f, alone=False) for f in above], numerator)
    return Fraction(_side_by_side(top), _side_by_side(bottom))


def _side_by_side(boxes: list[Box], number: Any = S.One) -> Box:
    boxes = boxes if number == 1 else [layout(number), *boxes]
    items: list[Box] = boxes[:1]
    for before, box in pairwise(boxes):
        both_numbers = all(isinstance(b, Word) and b.kind == "number" for b in (before, box))
        items += [Word("\N{MULTIPLICATION SIGN}", "operator") if both_numbers else SPACE, box]
    return items[0] if len(items) == 1 else Row(tuple(items))


def _reading_order(factor: Any) -> tuple[Any, ...]:
    """Constants first, then variables, then functions and sums."""
    base = factor.base if isinstance(factor, Pow) else factor
    rank = [Symbol, AppliedUndef, Derivative, Function, Add]
    place = next((k for k, kind in enumerate(rank) if isinstance(base, kind)), -1)
    return (place, *factor.sort_key())


def _factor(factor: Any, *, alone: bool) -> Box:
    box = layout(factor)
    negative = factor.is_Number and factor.is_negative
    return Fence(box) if not alone and (isinstance(factor, Add) or negative) else box


def _power(expression: Any) -> Box:
    base, exponent = expression.base, expression.exp
    if exponent.is_Rational and exponent < 0:
        return Fraction(layout(S.One), layout(Pow(base, -exponent)))
    if exponent == S.Half:
        return Root(layout(base))
    if isinstance(base, Function) and not isinstance(base, AppliedUndef) and base.args:
        return Row((Scripts(_word_of(base), sup=layout(exponent)), _arguments(base.args)))
    box = layout(base)
    if isinstance(box, Scripts) and box.sup is None:
        return Scripts(box.base, box.sub, layout(exponent))
    plain = isinstance(box, (Word, Accent)) and not base.is_negative
    return Scripts(box if plain else Fence(box), sup=layout(exponent))


def _number(expression: Any) -> Box:
    mantissa, _, exponent = repr(float(expression)).partition("e")
    if not exponent:
        return Word(mantissa.removesuffix(".0"), "number")
    ten = Scripts(Word("10", "number"), sup=layout(int(exponent)))
    return Row((Word(mantissa, "number"), Word("\N{MULTIPLICATION SIGN}", "operator"), ten))


def _rational(expression: Any) -> Box:
    top = Word(str(expression.p), "number")
    return top if expression.q == 1 else Fraction(top, Word(str(expression.q), "number"))


def _of_time(expression: Any, accent: str | None = None) -> Box:
    box = name(expression.func.__name__, accent=accent)
    plain = expression.args == (dynamicsymbols._t,)
    return box if plain else Row((box, _arguments(expression.args)))


def _derivative(expression: Any) -> Box:
    inner, *variables = expression.args
    time = dynamicsymbols._t
    if isinstance(inner, AppliedUndef) and len(variables) == 1 and variables[0][0] == time:
        marks = {1: "dot", 2: "ddot"}
        if variables[0][1] in marks:
            return _of_time(inner, marks[variables[0][1]])
    by = [Row((Word("∂"), layout(v if n == 1 else Pow(v, n)))) for v, n in variables]
    order = sum(n for _, n in variables)
    over = Word("∂") if order == 1 else Scripts(Word("∂"), sup=layout(order))
    return Row((Fraction(over, Row(tuple(by))), Fence(layout(inner))))


_RULES: list[tuple[Any, Callable[[Any], Box]]] = [
    (Symbol, lambda e: name(e.name)),
    (AppliedUndef, _of_time),
    (Derivative, _derivative),
    (Float, _number),
    (Rational, _rational),
    (Add, lambda e: Fence(layout(e))),
    (Mul, _product),
    (Pow, _power),
    (type(S.Pi), lambda e: Word("π")),
    (type(S.Exp1), lambda e: Word("e")),
    (type(S.ImaginaryUnit), lambda e: Word("i")),
]
