"""A small grammar for typed expressions: numbers, names, ``+ - * / ** ^``, known functions.

Input: text from a user.  Output: a SymPy expression over the names allowed.  Invariant: nothing
is ever evaluated as Python (``sympify`` would run whatever it is given), and every number on
the way is small, finite and real, so that no text takes SymPy long.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping

from sympy import (
    Abs,
    Expr,
    Float,
    I,
    Integer,
    Max,
    Min,
    Mul,
    Number,
    Pow,
    S,
    acos,
    asin,
    atan,
    cos,
    exp,
    log,
    nan,
    oo,
    pi,
    sign,
    sin,
    sqrt,
    tan,
    tanh,
    zoo,
)

from mechc_codegen.description.parsing.bounded_work import TooMuchWorkError, with_at_most
from mechc_codegen.errors import ExpressionError

FUNCTIONS = {f.__name__: f for f in (sin, cos, tan, asin, acos, atan, exp, log, sqrt, tanh)} | {
    "abs": Abs,
    "sign": sign,
    **dict.fromkeys(("max", "Max"), Max),
    **dict.fromkeys(("min", "Min"), Min),
}
_TOKEN = re.compile(
    r"\s*(?:(?P<number>(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?)"
    r"|(?P<name>[^\W\d]\w*)|(?P<operator>\*\*|[-+*/^(),]))"
)
_MAX_LENGTH, _MAX_DEPTH, _MAX_EXPONENT = 1000, 50, 12
_MAX_FUNCTIONS, _MAX_EXACT, _MAX_SIZE = 6, 10**15, 1e300
_MAX_CALLS = 1_500_000  # of Python functions: some seconds


def parse_expression(text: str, names: Mapping[str, Expr]) -> Expr:
    """Read ``text`` as an expression of the given names (``pi`` is known besides).

    Whole numbers, fractions and multiples of pi stay exact; every other number is a double.

    Raises
    ------
    ExpressionError
        With the place in the text and what was expected there.
    """
    if len(text) > _MAX_LENGTH:
        raise ExpressionError(f"an expression of {len(text)} characters: {_MAX_LENGTH} at most")
    try:
        return with_at_most(_MAX_CALLS, _ExpressionParser(text, {"pi": pi, **names}).whole)
    except TooMuchWorkError:
        raise ExpressionError(
            f"cannot read {text!r}: it takes SymPy too long; write it more simply, or give "
            "it as a function of time with the run"
        ) from None
    except (ArithmeticError, ValueError, TypeError, RecursionError) as error:
        if isinstance(error, ExpressionError):
            raise
        raise ExpressionError(f"cannot read {text!r}: {error}") from error


class _ExpressionParser:
    """Recursive descent over the tokens of one text."""

    def __init__(self, text: str, names: Mapping[str, Expr]) -> None:
        self.text, self.names = text, names
        self.depth = self.functions = 0
        self.tokens = self._split()
        self.next = 0

    def whole(self) -> Expr:
        value = self._sum()
        if self.next < len(self.tokens):
            raise self._error("an operator was expected")
        return value

    def _within_bounds(self, value: Expr) -> Expr:
        """``value``, checked to be real and of a size that doubles can hold."""
        if value.has(nan, zoo, oo, -oo, I):
            raise self._error("this has no finite real value")
        if not value.free_symbols:
            value = _number(value)
        if any(abs(number) > _MAX_SIZE for number in value.atoms(Number)):
            raise self._error(f"a number greater than {_MAX_SIZE:g}")
        powers = [power.exp for power in value.atoms(Pow)]
        if any(e.is_Number and abs(e) > _MAX_EXPONENT for e in powers):
            raise self._error(f"an exponent must be a number of at most {_MAX_EXPONENT}")
        return value

    def _split(self) -> list[tuple[str, str, int]]:
        tokens, place = [], 0
        text = self.text.rstrip()
        while place < len(text):
            match = _TOKEN.match(text, place)
            if match is None:
                place += len(text[place:]) - len(text[place:].lstrip())
                raise ExpressionError(
                    f"cannot read {text!r} at character {place + 1}: {text[place]!r} means "
                    "nothing here"
                )
            kind = str(match.lastgroup)
            tokens.append((kind, match.group(kind), match.start(kind)))
            place = match.end()
        return tokens

    def _error(self, what: str) -> ExpressionError:
        where = (
            self.tokens[self.next][2] + 1 if self.next < len(self.tokens) else len(self.text) + 1
        )
        return ExpressionError(f"cannot read {self.text!r} at character {where}: {what}")

    def _take(self, *operators: str) -> str | None:
        if self.next < len(self.tokens) and self.tokens[self.next][:2] in [
            ("operator", o) for o in operators
        ]:
            self.next += 1
            return self.tokens[self.next - 1][1]
        return None

    def _sum(self) -> Expr:
        value = self._product()
        while sign := self._take("+", "-"):
            term = self._product()
            value = self._within_bounds(value + term if sign == "+" else value - term)
        return value

    def _product(self) -> Expr:
        value = self._unary()
        while sign := self._take("*", "/"):
            factor = self._unary()
            if sign == "/" and factor == 0:
                raise self._error("division by zero")
            value = self._within_bounds(value * factor if sign == "*" else value / factor)
        return value

    def _unary(self) -> Expr:
        if sign := self._take("+", "-"):
            value = self._one_level_deeper(self._unary)
            return -value if sign == "-" else value
        return self._power()

    def _power(self) -> Expr:
        base = self._atom()
        if not self._take("**", "^"):
            return base
        exponent = self._one_level_deeper(self._unary)
        if exponent.free_symbols or abs(exponent) > _MAX_EXPONENT:
            raise self._error(f"an exponent must be a number of at most {_MAX_EXPONENT}")
        if base == 0 and exponent < 0:
            raise self._error("division by zero")
        return self._to_power(base, exponent)

    def _to_power(self, base: Expr, exponent: Expr) -> Expr:
        """A checked power; SymPy takes very long for roots of powers of complex numbers."""
        factors = Mul.make_args(base) if base.free_symbols and not exponent.is_Integer else ()
        if any(isinstance(f, (Pow, exp)) and not f.args[0].is_Atom for f in factors):
            raise self._error("a root of a power: write it as one power, or with abs")
        return self._within_bounds(base**exponent)

    def _atom(self) -> Expr:
        if self.next == len(self.tokens):
            raise self._error("the expression ends too early")
        kind, token, _ = self.tokens[self.next]
        if kind == "number":
            self.next += 1
            return self._within_bounds(Integer(token) if token.isdigit() else Float(float(token)))
        if kind == "name":
            return self._symbol_or_call(token)
        if self._take("("):
            return self._closing(self._one_level_deeper(self._sum))
        raise self._error("a number, a name or '(' was expected")

    def _symbol_or_call(self, name: str) -> Expr:
        if name in FUNCTIONS:
            self.next += 1
            if not self._take("("):
                raise self._error(f"'(' was expected after {name}")
            self.functions += 1
            if self.functions > _MAX_FUNCTIONS:
                raise self._error(f"more than {_MAX_FUNCTIONS} functions inside each other")
            arguments = self._arguments(several=FUNCTIONS[name] in (Max, Min))
            self.functions -= 1
            if name == "sqrt":
                return self._to_power(arguments[0], S.Half)
            return self._within_bounds(FUNCTIONS[name](*arguments))
        if name not in self.names:
            known = ", ".join([*self.names, *FUNCTIONS])
            raise self._error(f"{name!r} is not known here; known are {known}")
        self.next += 1
        return self.names[name]

    def _arguments(self, *, several: bool) -> list[Expr]:
        found = [self._one_level_deeper(self._sum)]
        while several and self._take(","):
            found.append(self._one_level_deeper(self._sum))
        self._closing(found[0])
        return found

    def _closing(self, value: Expr) -> Expr:
        if not self._take(")"):
            raise self._error("')' was expected")
        return value

    def _one_level_deeper(self, rule: Callable[[], Expr]) -> Expr:
        self.depth += 1
        if self.depth > _MAX_DEPTH:
            raise self._error(f"more than {_MAX_DEPTH} levels of nesting")
        value = rule()
        self.depth -= 1
        return value


def _number(value: Expr) -> Expr:
    """A small fraction or small multiple of pi unchanged, any other number as a double."""
    fraction = value if value.is_Rational else value / pi
    if fraction.is_Rational and max(abs(fraction.p), fraction.q) <= _MAX_EXACT:
        return value
    number = value.evalf(17)
    if not number.is_Float:
        raise ValueError("this has no finite real value")
    return number if abs(number) > _MAX_SIZE else Float(float(number))
