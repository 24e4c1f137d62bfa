"""Events written as expressions of SymPy: their zeros are found as those of functions are."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from mechc.errors import UnknownNameError
from mechc.system.names import name_of
from mechc.system.parameters import Array
from mechc.system.system import System

EventFunction = Callable[[float, Array], float]


def is_expression(event: Any) -> bool:
    """Whether it is a symbol or an expression of SymPy, and no function."""
    return hasattr(event, "free_symbols") and hasattr(event, "xreplace")


def function_of(expression: Any, system: System, p: Array) -> EventFunction:
    """The function of t and y that an expression of time, state and parameters is.

    Raises
    ------
    UnknownNameError
        For a symbol that the model does not have.
    """
    from sympy import Symbol, lambdify
    from sympy.core.function import AppliedUndef

    names = (*system.coordinates, *system.speeds)
    constants = dict(zip(system.parameters, p.tolist(), strict=True))
    atoms = expression.atoms(AppliedUndef)
    state: list[Any] = []
    places: list[int] = []
    for symbol in sorted(atoms | expression.atoms(Symbol), key=str):
        name = name_of(symbol)
        if name in names:
            state.append(symbol)
            places.append(names.index(name))
        elif name in constants:
            expression = expression.xreplace({symbol: constants[name]})
        elif name != "t":
            raise UnknownNameError("coordinate, speed or parameter", name, (*names, *constants))
    compiled = lambdify([Symbol("t"), state], expression, "numpy", cse=True)
    return lambda t, y: float(compiled(t, y[places]))
