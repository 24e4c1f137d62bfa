"""Events written as expressions of SymPy, turned into functions of t and y."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np

from mechc.errors import UnknownNameError
from mechc.simulation.events import Event
from mechc.system.names import name_of
from mechc.system.parameters import Array
from mechc.system.system import System

EventFunction = Callable[[float, Array], float]
_DIRECTIONS = {">": 1.0, ">=": 1.0, "<": -1.0, "<=": -1.0, "==": 0.0}  # SymPy's names


def checked_events(given: Any, system: System, p: Array) -> list[Any]:
    """Events, or one by itself, as a run takes them: expressions are functions of t and y."""
    if not isinstance(given, (tuple, list)) and _is_one(given):
        given = [given]
    return [_as_function(event, system, p) for event in given]


def _is_one(given: Any) -> bool:
    if callable(given) or isinstance(given, (Event, str)) or is_expression(given):
        return True
    return not isinstance(given, Iterable)


def _as_function(event: Any, system: System, p: Array) -> Any:
    if is_expression(event):
        difference, direction = _difference(event)
        return Event(function_of(difference, system, p), direction)
    if isinstance(event, Event) and is_expression(event.function):
        difference, direction = _difference(event.function)
        function = function_of(difference, system, p)
        return replace(event, function=function, direction=event.direction or direction)
    return event


def _difference(expression: Any) -> tuple[Any, float]:
    """What is zero at the event, and its direction: of ``q > 1`` q - 1, rising."""
    direction = _DIRECTIONS.get(getattr(expression, "rel_op", ""))
    if direction is None:
        return expression, 0.0
    return expression.lhs - expression.rhs, direction


def is_expression(event: Any) -> bool:
    """Whether it is a symbol or an expression of SymPy, not a function."""
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
    held: dict[Any, float] = {}
    state: list[Any] = []
    places: list[int] = []
    for symbol in sorted(atoms | expression.atoms(Symbol), key=str):
        name = name_of(symbol)
        if name in names:
            state.append(symbol)
            places.append(names.index(name))
        elif name in constants:
            held[symbol] = constants[name]
        elif name != "t":
            raise UnknownNameError("coordinate, speed or parameter", name, (*names, *constants))
    compiled = lambdify([Symbol("t"), state], expression.xreplace(held), "numpy", cse=True)

    def function(t: float, y: Array) -> float:
        return float(compiled(t, y[places]))

    function.slopes = _Slopes(expression, state, places, held, system)  # type: ignore[attr-defined]
    return function


class _Slopes:
    """The derivatives of an expression by time, state (nq + nu,) and parameters (np,)."""

    def __init__(
        self, expression: Any, state: list[Any], places: list[int], held: Mapping[Any, float],
        system: System,
    ) -> None:  # fmt: skip
        self.expression, self.state, self.places, self.held = expression, state, places, held
        self.sizes = system.scene.width, len(system.parameters)
        self.fixed = [system.parameters.index(name_of(symbol)) for symbol in held]

    @cached_property
    def compiled(self) -> Any:
        from sympy import Symbol, diff, lambdify

        plain = {x: Symbol(f"y{k}") for k, x in enumerate(self.state)}  # functions of time
        free = self.expression.xreplace(plain)
        by = [Symbol("t"), *plain.values(), *self.held]
        found = [diff(free, x).xreplace(self.held) for x in by]
        return lambdify([Symbol("t"), list(plain.values())], found, "numpy", cse=True)

    def __call__(self, t: float, y: Array) -> tuple[float, Array, Array]:
        by_time, *others = self.compiled(t, y[self.places])
        by_state, by_parameters = (np.zeros(size) for size in self.sizes)
        by_state[self.places] = others[: len(self.places)]
        by_parameters[self.fixed] = others[len(self.places) :]
        return float(by_time), by_state, by_parameters
