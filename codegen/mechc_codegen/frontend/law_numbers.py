"""Numbers of the law of an input, as parameters: a law with other numbers is the same program.

Input: the expression of an input.  Output: the expression with a positive symbol for each number,
and their values.  Numbers that decide the form of the equations stay: 0, 1 and exponents.
"""

from __future__ import annotations

from collections.abc import Collection

from sympy import Basic, Expr, Number, Pow, Symbol


def numbers_apart(law: Expr, name: str, taken: Collection[str]) -> tuple[Expr, dict[Symbol, float]]:
    """The law of the input ``name`` with ``name.1``, ``name.2`` and so on for its numbers.

    A number has one symbol wherever it stands; its sign stays in the law, so that what SymPy
    concludes from signs is concluded as before.
    """
    found: dict[Number, Symbol] = {}
    free = (each for count in range(1, 2**31) if (each := f"{name}.{count}") not in taken)

    def apart(part: Basic) -> Basic:
        if isinstance(part, Number):
            return symbol_for(part)
        if isinstance(part, Pow):
            return part if part.is_number else Pow(apart(part.base), part.exp)
        return part.func(*map(apart, part.args)) if part.args else part

    def symbol_for(number: Number) -> Expr:
        size = abs(number)
        if not number.is_finite or size in (0, 1):
            return number
        if size not in found:
            found[size] = Symbol(next(free), positive=True)
        return found[size] if number.is_positive else -found[size]

    return apart(law), {symbol: float(number) for number, symbol in found.items()}
