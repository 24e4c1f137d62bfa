"""SymPy's expressions -> C over ``real``, through its C printer.

Input: one expression.  Output: its C, as a part of others.  Invariant: only functions with a vector
form are printed; all others are refused by name, and never reach the C compiler.
"""

from __future__ import annotations

import math
from dataclasses import replace

from sympy import Add, Expr, Float, Integer, Mul, NumberSymbol, Pow, Rational, Symbol, exp
from sympy.core.function import AppliedUndef
from sympy.printing.c import C99CodePrinter

from mechc_codegen.description.tables import Lookup
from mechc_codegen.emit.expressions import ATOM, PRODUCT, Value, call, fma, named, real, select
from mechc_codegen.errors import MechanismError

_MOST_FACTORS = 8  # integer powers up to here are printed as products
_EXACT = 2**53  # integers up to here are doubles
_CORNERED = ("Abs", "Step", "Where", "Floor")
_PRINTED = (Symbol, Rational, Float, NumberSymbol, Add, Mul, Pow, exp)


class RealPrinter(C99CodePrinter):  # type: ignore[misc]
    """C over ``real``: powers as products, functions through the lane macros.

    ``tables``: whether the text has the functions of tables.
    """

    functions = (
        *("sin", "cos", "tan", "asin", "acos", "atan", "atan2"),
        *("sinh", "cosh", "tanh", "exp", "log"),
    )

    def __init__(self, tables: bool = False) -> None:
        super().__init__()
        self.tables = tables
        self._known: dict[Expr, Value] = {}  # a part is printed alone, and within what it is of

    def _print(self, expr: Expr, **kwargs: object) -> str:
        self._refuse_unknown(expr)
        if isinstance(expr, (Rational, Float)) or expr.free_symbols:
            return str(super()._print(expr, **kwargs))
        return _number(expr)

    def _refuse_unknown(self, expr: Expr) -> None:
        name = type(expr).__name__
        known = name in (*self.functions, *_CORNERED) and not isinstance(expr, AppliedUndef)
        known = known or (self.tables and isinstance(expr, Lookup))
        if not known and not isinstance(expr, _PRINTED):
            raise MechanismError(
                f"{name} has no C form here, in {str(expr)[:80]!r}; known are numbers, "
                f"+, -, *, /, **, sqrt, Abs, {', '.join(self.functions)}, and sign, Heaviside, "
                "Max, Min, Piecewise, floor, ceiling, frac, Mod"
            )

    def parenthesize(self, item: Expr, level: int, strict: bool = False) -> str:
        """A part of an expression; a number such as cos(2) may begin with a sign."""
        if item.is_Add and item.free_symbols:
            return self.real(item).within(ATOM)
        text = str(super().parenthesize(item, level, strict))
        return f"({text})" if text.startswith("-") else text

    def _print_Symbol(self, expr: Symbol) -> str:
        return str(expr.name)

    def _print_Integer(self, expr: Integer) -> str:
        return f"{int(expr)}.0" if abs(int(expr)) <= _EXACT else _number(expr)

    def _print_Rational(self, expr: Rational) -> str:
        exact = int(expr.q) & (int(expr.q) - 1) == 0 and int(expr.q) < 2**50 > abs(int(expr.p))
        if exact or max(abs(int(expr.p)), int(expr.q)) > _EXACT:
            return _number(expr)
        return f"({int(expr.p)}.0/{int(expr.q)}.0)"

    def _print_Float(self, expr: Float) -> str:
        return _number(expr)

    def _print_Pow(self, expr: Pow) -> str:
        base, exponent = expr.as_base_exp()
        if exponent.is_Float and float(exponent).is_integer():
            exponent = Integer(int(exponent))  # else each compiler chooses when pow is a product
        if exponent.is_Integer and 0 < abs(int(exponent)) <= _MOST_FACTORS:
            factor = self.parenthesize(base, 100)
            product = "*".join([factor] * abs(int(exponent)))
            return f"({product})" if exponent > 0 else f"(1.0/({product}))"
        if exponent == Rational(1, 2):
            return f"R_SQRT({self.real(base)})"
        if exponent == Rational(-1, 2):
            return f"(1.0/R_SQRT({self.real(base)}))"
        return f"R_CALL2(pow, {self.real(base)}, {self.real(exponent)})"

    def _print_Function(self, expr: Expr) -> str:
        name = {"Abs": "fabs", "Floor": "floor"}.get(type(expr).__name__, type(expr).__name__)
        macro = "R_CALL2" if len(expr.args) == 2 else "R_CALL"
        return str(call(macro, named(name), *map(self.real, expr.args)))

    _print_tan = _print_asin = _print_acos = _print_atan = _print_atan2 = _print_Function
    _print_sinh = _print_cosh = _print_tanh = _print_exp = _print_log = _print_Function
    _print_sin = _print_cos = _print_Function  # in a program these are paired before printing
    _print_Abs = _print_Floor = _print_Lookup = _print_Function

    def _print_Step(self, expr: Expr) -> str:
        return str(select(self.real(expr.args[0]).compared(">", 0.0), real(1.0), real(0.0)))

    def _print_Where(self, expr: Expr) -> str:
        chosen, one, other = map(self.real, expr.args)
        return str(select(chosen.compared("!=", 0.0), one, other))

    def _print_Add(self, expr: Expr, order: object = None) -> str:
        return str(self.real(expr))

    def real(self, expression: Expr) -> Value:
        """An expression whose C type is ``real`` even if it is a number."""
        if expression not in self._known:
            self._known[expression] = self._real(expression)
        return self._known[expression]

    def _real(self, expression: Expr) -> Value:
        symbols = expression.free_symbols
        if expression.is_Add and symbols:
            return self._sum(expression)
        text = self._print(expression)
        if not symbols:
            return Value(f"R({text})")
        binds = PRODUCT if expression.is_Mul else ATOM
        return Value(text, binds, frozenset(symbol.name for symbol in symbols))

    def _sum(self, expression: Expr) -> Value:
        """The terms that are no products of two values, then these, each in one operation."""
        self._refuse_unknown(expression)
        terms = [_signed(term) for term in self._as_ordered_terms(expression)]
        ordered = [(sign, self._term(term)) for sign, term in terms]
        ordered.sort(key=lambda each: (each[1].factors is not None, each[0]))  # stable
        (sign, found), *others = ordered
        if sign and others and others[0][0] and (factors := others[0][1].factors):
            found = fma(*factors, found, by="R_FNMS")
            others = others[1:]
        elif sign:
            found = -found
        for sign, term in others:
            found = found - term if sign else found + term
        return found

    def _term(self, expression: Expr) -> Value:
        """A term of a sum; what it is the product of, if it is."""
        text, factors = self.real(expression), list[Expr]()
        for factor in expression.as_ordered_factors():
            base, exponent = factor.as_base_exp()
            several = exponent.is_Integer and 1 < exponent <= _MOST_FACTORS
            factors += [base] * int(exponent) if several else [factor]
        if len(factors) < 2 or any(f.is_Pow and f.exp.is_negative for f in factors):
            return text
        one, other = self.real(Mul(*factors[:-1], evaluate=False)), self.real(factors[-1])
        return replace(text, operations=1, factors=(one, other))


def _signed(term: Expr) -> tuple[bool, Expr]:
    """Whether a term is subtracted, and what then."""
    coefficient, _ = term.as_coeff_Mul()
    return (True, -term) if coefficient.is_negative else (False, term)


def _number(expression: Expr) -> str:
    """A number as the double nearest to it."""
    value = complex(expression.evalf(30))
    if value.imag != 0 or not math.isfinite(value.real):
        raise MechanismError(f"{str(expression)[:80]!r} is not a real number of double range")
    return repr(value.real)
