"""Edges of narrow features: bumps and smooth steps whose width is known from the expression.

Input: one function or power of a program.  Output: functions that vanish where it begins to be
more than rounding, and where it ends, scaled so that over the feature they change by 2; and one
that vanishes in its middle, which changes by 16.
Invariant: a function without a known width has none.

A method sees nothing of a bump between its nodes.  A step that ends at the edge is followed by one
that ends in the middle at the latest, unless an eighth of the feature is longer.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import exp as exponential

from sympy import Abs, Add, Expr, Float, Mul, Pow, Rational, S, atan, cos, cosh, exp, sin, tanh

from mechc_codegen.ir.definitions import Definitions

_NOTHING = 36  # exp of minus that is the rounding of 1
_MIDDLE = 8  # times as steep as an edge: low orders have nodes half a step apart
_HALF = 0.5**0.5  # |sin| above that is half of its period


def edges(part: Expr, definitions: Definitions) -> Iterator[Expr]:
    """The edges of exp(-z^2), tanh(z), atan(z), logistic functions, 1/cosh(z), 1/(1 + z^2),
    sin(z)^n, and of what saturates, as atan(x exp(z^2))."""
    if isinstance(part, exp):
        yield from _of_exponent(definitions.look_up(part.exp), definitions)
    elif isinstance(part, (atan, tanh)):
        factors = definitions.exponentials(part.args[0])  # SymPy writes atan2(y, exp(g)) so
        for factor in factors:
            yield from _of_exponent(-definitions.look_up(factor.exp), definitions)
        if not factors:
            yield from _beside_zero(part.args[0] * Rational(2, _NOTHING), definitions)
    elif isinstance(part, Pow) and part.exp.is_negative:
        divisor = definitions.look_up(part.base)
        yield from _of_fraction(divisor, definitions)
        for term in Add.make_args(divisor):
            yield from _of_divisor(term, definitions)
    elif isinstance(part, Pow) and part.exp.is_Number:
        yield from _of_power(definitions.look_up(part.base), float(part.exp))


def _beside_zero(z: Expr, definitions: Definitions) -> Iterator[Expr]:
    """Edges where z, which has no pole, is 1 and -1, and the middle."""
    if all(definitions.is_fixed(x) for x in definitions.divisors(z)):
        yield z - 1
        yield z + 1
        yield _MIDDLE * z


def _of_exponent(g: Expr, definitions: Definitions) -> Iterator[Expr]:
    """Edges of exp(g) where g falls to both sides, as it does with a negative even power."""
    for term in Add.make_args(g):
        z = _root(term, definitions)
        if z is None or not term.could_extract_minus_sign():
            continue
        base, exponent, factor = z
        scaled = base * (factor / _NOTHING) ** (1 / exponent)
        if not isinstance(g, Add):
            yield from _beside_zero(scaled, definitions)
            return
        yield g / _NOTHING + 1
        if all(definitions.is_fixed(other) for other in g.args if other != term):
            yield _MIDDLE * scaled
        return


def _root(term: Expr, definitions: Definitions) -> tuple[Expr, Expr, Expr] | None:
    """x, n and f > 0 of a term f |x|^n or -f |x|^n with an even n or n = 1; None of any other."""
    varying = [x for x in Mul.make_args(term) if not definitions.is_fixed(x)]
    power = definitions.look_up(varying[0]) if len(varying) == 1 else term
    base, exponent = power.as_base_exp()
    if isinstance(power, Abs):
        base = power.args[0]
    elif not (exponent.is_even and exponent.is_positive):
        return None
    return base, exponent, Abs(term / varying[0]) if len(varying) == 1 else S.One


def _of_fraction(divisor: Expr, definitions: Definitions) -> Iterator[Expr]:
    """Edges of 1 / (c + f x^2), which is as wide as x = sqrt(c / f); of no wave, which is not
    narrow as a rule, and not where c and f have different signs: that is a pole."""
    terms = Add.make_args(divisor)
    fixed = [x for x in terms if definitions.is_fixed(x)]
    varying = [x for x in terms if not definitions.is_fixed(x)]
    found = _root(varying[0], definitions) if len(varying) == 1 else None
    signs = {x.could_extract_minus_sign() for x in (*varying, Add(*fixed))}
    if not fixed or found is None or len(signs) == 2:
        return
    base, exponent, factor = found
    if not isinstance(definitions.look_up(base), (sin, cos)):
        width = (Abs(Add(*fixed)) / factor) ** (1 / exponent)
        yield from _beside_zero(base / width * Rational(2, _NOTHING), definitions)


def _of_divisor(term: Expr, definitions: Definitions) -> Iterator[Expr]:
    """Edges of 1 / (1 + exp(z)) and 1 / cosh(z), from a term of their divisor."""
    for factor in Mul.make_args(definitions.look_up(term)):
        found = definitions.look_up(factor)
        if isinstance(found, (exp, cosh)):
            yield from _beside_zero(found.args[0] / _NOTHING, definitions)


def _of_power(wave: Expr, exponent: float) -> Iterator[Expr]:
    """Edges of sin(x)^n where it is nothing for more than half of the period."""
    edge = exponential(-_NOTHING / exponent) if exponent > 0 else 0.0
    if isinstance(wave, (sin, cos)) and edge > _HALF:
        yield (wave - Float(edge)) / Float(1 - edge)
        yield (wave + Float(edge)) / Float(1 - edge)
        slope = (cos if isinstance(wave, sin) else sin)(wave.args[0])
        yield _MIDDLE * slope / Float((1 - edge**2) ** 0.5)
