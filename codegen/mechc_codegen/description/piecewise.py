"""Functions with corners and jumps, rewritten by three functions that vector code can compute.

Piecewise, Max, Min, sign and Heaviside become :class:`Step` and :class:`Where`; floor, ceiling,
frac and Mod become :class:`Floor`.  These are ordinary functions of numbers, so that passes may
move and share their arguments.

Some powers have their slope taken as a whole, since the parts have none where the whole has one: at
0 that of sqrt(|x|) is infinite, that of x sqrt(|x|) is 0, and the rule of products gives 0 / 0.
The root of a sum of squares has a corner where it is 0, as |x|, and there its slope counts as 0, as
that of |x|: x sqrt(x^2 + y^2) has the slope 0.
"""

from __future__ import annotations

import sys
from functools import reduce
from typing import Any

from sympy import (
    ITE,
    Abs,
    Add,
    And,
    Basic,
    DiracDelta,
    Expr,
    Function,
    Heaviside,
    Integer,
    Max,
    Min,
    Mod,
    Mul,
    Not,
    Or,
    Piecewise,
    Pow,
    Rational,
    S,
    Symbol,
    UnevaluatedExpr,
    ceiling,
    floor,
    frac,
    log,
    nsimplify,
    sign,
)
from sympy.core.relational import Eq, Ge, Gt, Le, Lt, Ne
from sympy.logic.boolalg import Boolean

from mechc_codegen.errors import MechanismError


class Step(Function):  # type: ignore[misc]
    """1 where the argument is greater than 0, else 0."""

    nargs = 1
    is_real = True

    @classmethod
    def eval(cls, x: Expr) -> Expr | None:
        return Integer(int(bool(x > 0))) if x.is_number else None

    def fdiff(self, argindex: int = 1) -> Expr:
        return S.Zero

    def _pythoncode(self, printer: Any) -> str:
        return f"(1.0 if {printer._print(self.args[0])} > 0 else 0.0)"


class Floor(Function):  # type: ignore[misc]
    """The greatest whole number that is not above the argument."""

    nargs = 1
    is_real = True

    @classmethod
    def eval(cls, x: Expr) -> Expr | None:
        return floor(x) if x.is_number else None

    def fdiff(self, argindex: int = 1) -> Expr:
        return S.Zero

    def _pythoncode(self, printer: Any) -> str:
        return f"math.floor({printer._print(self.args[0])})"


class Where(Function):  # type: ignore[misc]
    """The second argument where the first is not 0, else the third."""

    nargs = 3
    is_real = True

    @classmethod
    def eval(cls, chosen: Expr, one: Expr, other: Expr) -> Expr | None:
        if chosen.is_number:
            return other if chosen == 0 else one
        return one if one == other else None

    def _eval_derivative(self, symbol: Symbol) -> Expr:
        chosen, one, other = self.args
        return Where(chosen, one.diff(symbol), other.diff(symbol))

    def _pythoncode(self, printer: Any) -> str:
        chosen, one, other = map(printer._print, self.args)
        return f"({one} if {chosen} else {other})"


def without_corners(expression: Basic) -> Basic:
    """One node, whose arguments are rewritten already, by the functions of this module.

    Raises
    ------
    MechanismError
        For a Piecewise without a value for all other cases, or an unknown condition.
    """
    if isinstance(expression, Piecewise):
        return _piecewise(expression)
    if isinstance(expression, (Max, Min)):
        least = isinstance(expression, Min)
        return reduce(lambda a, b: Where(Step(b - a if least else a - b), a, b), expression.args)
    if isinstance(expression, sign):
        return _sign(expression.args[0])
    if isinstance(expression, Heaviside):
        x, at_zero = expression.args
        return Step(x) + at_zero * (1 - Step(x) - Step(-x))
    if isinstance(expression, (floor, ceiling, frac, Mod)):
        return _whole(expression)
    if _is_curve(expression):
        return expression.doit(deep=False).replace(UnevaluatedExpr, lambda held: held)
    if isinstance(expression, UnevaluatedExpr):
        return expression.args[0]
    if isinstance(expression, Pow) and isinstance(expression.base, Add):
        odd = expression.exp.is_Rational and expression.exp.q == 2
        return _as_square(expression.base) ** expression.exp if odd else expression
    if isinstance(expression, DiracDelta):  # a derivative across a jump, where it is not defined
        return S.Zero
    return expression


def _as_square(e: Add) -> Expr:
    """A square that is written out, as x^2 + 2 x + 1, as one; any other sum as it is.

    Written out, rounding makes it negative where it touches zero, and its root is no number there.
    """
    for x in sorted({term.base for term in e.atoms(Pow) if term.exp == 2}, key=str):
        polynomial = e.as_poly(x)
        if polynomial is None or polynomial.degree() != 2:
            continue
        a, b, c = (nsimplify(each, rational=True) for each in polynomial.all_coeffs())
        if (b**2 - 4 * a * c).expand() == 0:
            return a * (x + b / (2 * a)) ** 2
    return e


def _is_curve(expression: Basic) -> bool:
    """Whether a function is a curve of SymPy's muscle models, made of exp, log and sinh."""
    module = sys.modules.get("sympy.physics.biomechanics.curve")
    return module is not None and isinstance(expression, module.CharacteristicCurveFunction)


def _sign(x: Expr) -> Expr:
    return Step(x) - Step(-x)


def _whole(expression: Expr) -> Expr:
    """The floor function as this module's class; Mod has the sign of its divisor, as in Python."""
    x, *divisor = expression.args
    if isinstance(expression, floor):
        return Floor(x)
    if isinstance(expression, ceiling):
        return -Floor(-x)
    if isinstance(expression, frac):
        return x - Floor(x)
    return x - divisor[0] * Floor(x / divisor[0])


def _piecewise(expression: Piecewise) -> Expr:
    *pieces, (value, condition) = expression.args
    if condition != True:  # noqa: E712  SymPy's own
        raise MechanismError(
            f"{str(expression)[:80]!r} has no value where none of its conditions holds; add a last "
            "pair (value, True)"
        )
    for other, chosen in reversed(pieces):
        value = Where(_number(chosen), other, value)
    return value


def _number(condition: Boolean) -> Expr:
    """1 where the condition holds, else 0."""
    if isinstance(condition, (Gt, Lt)):
        return Step(condition.gts - condition.lts)
    if isinstance(condition, (Ge, Le)):
        return 1 - Step(condition.lts - condition.gts)
    if isinstance(condition, (Eq, Ne)):
        apart = Step(condition.lhs - condition.rhs) + Step(condition.rhs - condition.lhs)
        return apart if isinstance(condition, Ne) else 1 - apart
    if isinstance(condition, And):
        return reduce(lambda a, b: a * b, map(_number, condition.args))
    if isinstance(condition, Or):
        return 1 - reduce(lambda a, b: a * b, (1 - _number(c) for c in condition.args))
    if isinstance(condition, Not):
        return 1 - _number(condition.args[0])
    if isinstance(condition, ITE):  # of a comparison with another Piecewise
        return Where(*map(_number, condition.args))
    if condition in (True, False):
        return Integer(int(bool(condition)))
    raise MechanismError(
        f"the condition {str(condition)[:80]!r} has no C form; known are comparisons, and And, Or, "
        "Not and ITE of them"
    )


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


def is_held_product(e: Mul) -> bool:
    """Whether the slope of a product is taken as a whole."""
    sizes = any(isinstance(factor.as_base_exp()[0], Abs) for factor in e.args)
    return sizes and with_signed(e) != e


def held(e: Basic) -> Basic:
    """One node with such powers as functions of their own."""
    if (
        isinstance(e, Pow)
        and e.exp.is_Rational
        and Rational(1, 2) <= e.exp < 1
        and _are_squares(e.base)
    ):
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
