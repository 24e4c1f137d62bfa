"""Sums that are written out, as products.

Input: a sum.  Output: its factors, where they are found in short time.  SymPy writes exp(a + b) as
a product of powers as high as the coefficients of a and b, and holds every power below; so
exponentials are symbols here, and what has a high degree is left as it is.
"""

from __future__ import annotations

from sympy import Add, Dummy, Expr, Mul, Pow, exp, factor, nsimplify

HIGHEST = 100  # degree of a sum of which factors are looked for; those of laws are below 10


def as_product(e: Expr) -> Expr:
    """The sum as a product of its factors; a sum that has none, or may take long, as it is."""
    e = nsimplify(e, rational=True)
    symbols = _exponentials(e)
    plain = e.xreplace(symbols)
    if _degree(plain) > HIGHEST:
        return e
    back = {one: part for part, one in symbols.items() if one.is_Symbol}
    return factor(plain).xreplace(back)


def _exponentials(e: Expr) -> dict[Expr, Expr]:
    """Powers whose exponents are no numbers -> symbols; where one is a whole power of another, that
    power of its symbol."""
    found: dict[Expr, Expr] = {}
    least: dict[tuple[Expr, Expr], tuple[Expr, Dummy]] = {}
    parts = [part for part in e.atoms(exp, Pow) if not part.as_base_exp()[1].is_number]
    for part in sorted(parts, key=lambda part: (abs(_split(part)[1]), str(part))):
        kind, coefficient = _split(part)
        first, symbol = least.setdefault(kind, (coefficient, Dummy()))
        ratio = coefficient / first
        found[part] = symbol**ratio if ratio.is_integer else Dummy()
    return found


def _split(power: Expr) -> tuple[tuple[Expr, Expr], Expr]:
    """(base, exponent without its number), and the number."""
    base, exponent = power.as_base_exp()
    number, rest = exponent.as_content_primitive()
    return (base, rest), number


def _degree(e: Expr) -> int:
    """A bound of the degree of an expression as a polynomial of its functions and symbols."""
    if isinstance(e, Add):
        return max(map(_degree, e.args))
    if isinstance(e, Mul):
        return sum(map(_degree, e.args))
    if isinstance(e, Pow) and e.exp.is_Rational:
        return int(abs(e.exp.p)) * _degree(e.base)
    return 0 if e.is_number else 1
