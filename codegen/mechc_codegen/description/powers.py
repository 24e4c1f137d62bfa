"""Powers whose slope is taken as a whole, since the parts have none where the whole has one.

At 0 the slope of sqrt(|x|) is infinite, that of x sqrt(|x|) is 0, and the rule of products gives
0 / 0.  The root of a sum of squares has a corner where it is 0, as |x|, and there its slope counts
as 0, as that of |x|: x sqrt(x^2 + y^2) has the slope 0.
"""

from __future__ import annotations

from sympy import Abs, Add, Basic, Expr, Function, Mul, Pow, Rational, S, log

from mechc_codegen.description.piecewise import Where

HALF = Rational(1, 2)


class SignedPower(Function):  # type: ignore[misc]
    """x^n |x|^a, whose slope is (n + a) x^(n - 1) |x|^a."""

    nargs = 3
    is_real = True

    def fdiff(self, argindex: int = 1) -> Expr:
        x, n, a = self.args
        return (n + a) * x ** (n - 1) * Abs(x) ** a if argindex == 1 else log(Abs(x)) * self

    def whole(self) -> Expr:
        x, n, a = self.args
        return x**n * Abs(x) ** a


class RootOfSquares(Function):  # type: ignore[misc]
    """r^a of a sum r of squares, 1/2 <= a < 1."""

    nargs = 2
    is_real = True

    def fdiff(self, argindex: int = 1) -> Expr:
        r, a = self.args
        return a * Where(r, r ** (a - 1), S.Zero)

    def whole(self) -> Expr:
        r, a = self.args
        return r**a


def with_signed(e: Basic) -> Basic:
    """One product, its factors x^n |x|^a as :class:`SignedPower`."""
    if not isinstance(e, Mul):
        return e
    factors = list(e.args)
    for size in e.args:
        inner, a = size.as_base_exp()
        argument = left = inner.args[0] if isinstance(inner, Abs) else S.One
        for x in Mul.make_args(argument):
            beside = next((f for f in factors if _is_whole_power(f, x)), None)
            if beside is not None:
                factors.remove(beside)
                factors.append(SignedPower(*beside.as_base_exp(), a))
                left /= x
        if left != argument:
            factors.remove(size)
            factors.append(Abs(left) ** a)
    return Mul(*factors)


def held(e: Basic) -> Basic:
    """One node with such powers as functions of their own."""
    if isinstance(e, Pow) and e.exp.is_Rational and HALF <= e.exp < 1 and _are_squares(e.base):
        return RootOfSquares(*e.args)
    return with_signed(e)


def released(e: Basic) -> Basic:
    """One node without these functions."""
    return e.whole() if isinstance(e, (SignedPower, RootOfSquares)) else e


def is_of_sizes(e: Expr) -> bool:
    """Whether an expression is a product with powers of absolute values, and without sums."""
    bases = [factor.as_base_exp()[0] for factor in Mul.make_args(e)]
    return any(isinstance(base, Abs) for base in bases) and not e.has(Add)


def _is_whole_power(factor: Expr, x: Expr) -> bool:
    base, n = factor.as_base_exp()
    return base in (x, -x) and n.is_Integer and n > 0


def _are_squares(e: Expr) -> bool:
    return isinstance(e, Add) and all(
        factor.is_positive or factor.as_base_exp()[1].is_even
        for term in e.args
        for factor in Mul.make_args(term)
    )
