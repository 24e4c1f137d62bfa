"""Operations of an expression as it is printed, each shared subexpression counted once and kept.

Sums and products share most of their terms, and one expression is counted many times: of each
output, and of each way to write a sum.
"""

from __future__ import annotations

from functools import lru_cache

from sympy import Add, Basic, Expr, Mul, Pow, S, exp, fraction
from sympy.core.operations import LatticeOp

KNOWN = 1 << 17
_PRINTED_AS_PRODUCTS = 4  # the largest power


def count_operations(expression: Expr) -> int:
    """Number of operations in one expression; an integer power is counted as its products."""
    exponents = (int(power.exp) for power in _powers(expression))
    beyond = (abs(n) - (2 if n > 0 else 1) for n in exponents)  # the one operation of a power
    return _tree(expression) + sum(beyond)


@lru_cache(maxsize=KNOWN)
def _tree(e: Basic) -> int:
    """Number of additions, signs, products, divisions, powers and function calls."""
    if e.is_Rational:
        return int(e.p < 0) + int(e.q != 1)
    if isinstance(e, Add):
        signs = [_negative(a) for a in e.args]
        terms = (-a if sign else a for a, sign in zip(e.args, signs, strict=True))
        return len(signs) - 1 + all(signs) + sum(map(_tree, terms))
    if isinstance(e, Mul):
        return _product(e)
    if isinstance(e, Pow) and e.exp is S.NegativeOne:
        return 1 + _tree(e.base)
    if isinstance(e, Pow) and e.base is S.Exp1:
        return 1 + _tree(e.exp)
    if isinstance(e, LatticeOp):  # Max, Min
        return len(e.args) - 1 + sum(map(_tree, e.args))
    called = bool(e.args) and (e.is_Pow or e.is_Function)
    return int(called or e is S.Exp1) + sum(map(_tree, e.args))


def _product(e: Mul) -> int:
    if _negative(e):
        return 1 + _tree(e.as_two_terms()[1] if e.args[0] is S.NegativeOne else -e)
    if not any(map(_may_divide, e.args)):
        return len(e.args) - 1 + sum(map(_tree, e.args))
    above, below = fraction(e)
    if below is S.One:
        return len(e.args) - 1 + sum(map(_tree, e.args))
    return 1 + (0 if above.is_Integer else _tree(above)) + (0 if below.is_Integer else _tree(below))


def _may_divide(factor: Basic) -> bool:
    """False where a factor stands above the line of a fraction; quicker than :func:`fraction`."""
    if isinstance(factor, (Pow, exp)):
        return not (factor.exp.is_Integer and factor.exp.p > 0)
    return bool(factor.is_Rational and factor.q != 1)


def _negative(e: Basic) -> bool:
    factor = e.args[0] if isinstance(e, Mul) else e
    return bool(factor.is_Number and factor.is_extended_negative)


@lru_cache(maxsize=KNOWN)
def _powers(e: Basic) -> frozenset[Pow]:
    """The different powers in an expression that are printed as products."""
    own = isinstance(e, Pow) and e.exp.is_Integer and abs(e.exp) <= _PRINTED_AS_PRODUCTS
    return frozenset({e} if own else ()).union(*map(_powers, e.args))
