"""Expressions -> C over ``real``, through SymPy's C printer."""

from __future__ import annotations

from sympy import Expr, Float, Integer, Pow, Rational, Symbol
from sympy.printing.c import C99CodePrinter

from mechc_codegen.errors import MechanismError

_MOST_FACTORS = 8  # integer powers up to here are printed as products


class RealPrinter(C99CodePrinter):  # type: ignore[misc]
    """C over ``real``: powers as products, functions through the lane macros."""

    functions = ("tan", "asin", "acos", "atan", "sinh", "cosh", "tanh", "exp", "log", "atan2")

    def _print_Symbol(self, expr: Symbol) -> str:
        return str(expr.name)

    def _print_Integer(self, expr: Integer) -> str:
        return f"{int(expr)}.0"

    def _print_Rational(self, expr: Rational) -> str:
        exact = int(expr.q) & (int(expr.q) - 1) == 0 and int(expr.q) < 2**50 > abs(int(expr.p))
        return repr(float(expr)) if exact else f"({int(expr.p)}.0/{int(expr.q)}.0)"

    def _print_Float(self, expr: Float) -> str:
        return repr(float(expr))

    def _print_NumberSymbol(self, expr: Expr) -> str:
        return repr(float(expr))

    def _print_Pow(self, expr: Pow) -> str:
        base, exponent = expr.as_base_exp()
        if exponent.is_Integer and 0 < abs(int(exponent)) <= _MOST_FACTORS:
            factor = self.parenthesize(base, 100)
            product = "*".join([factor] * abs(int(exponent)))
            return f"({product})" if exponent > 0 else f"(1.0/({product}))"
        if exponent == Rational(1, 2):
            return f"R_SQRT({self._real(base)})"
        if exponent == Rational(-1, 2):
            return f"(1.0/R_SQRT({self._real(base)}))"
        return f"R_CALL2(pow, {self._real(base)}, {self._real(exponent)})"

    def _print_Function(self, expr: Expr) -> str:
        name = type(expr).__name__
        if name not in self.functions:
            raise MechanismError(
                f"the function {name} has no C form here; known are sin, cos, sqrt, Abs, "
                f"{', '.join(self.functions)}"
            )
        call = "R_CALL2" if len(expr.args) == 2 else "R_CALL"
        return f"{call}({name}, {', '.join(self._real(a) for a in expr.args)})"

    _print_tan = _print_asin = _print_acos = _print_atan = _print_atan2 = _print_Function
    _print_sinh = _print_cosh = _print_tanh = _print_exp = _print_log = _print_Function
    _print_sin = _print_cos = _print_Function  # these are paired before printing

    def _print_Abs(self, expr: Expr) -> str:
        return f"R_CALL(fabs, {self._real(expr.args[0])})"

    def _real(self, expression: Expr) -> str:
        """An expression whose C type is `real` also where it is a number."""
        text = self._print(expression)
        return text if expression.free_symbols else f"R({text})"

    def real(self, expression: Expr) -> str:
        """C text of type ``real``."""
        return self._real(expression)
