"""What a path prescribes: numbers of the model as functions of time, with two derivatives."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mechc.compilation.event_tapes import typed_expression
from mechc.errors import UnknownNameError, ValueOutOfBoundsError, brief
from mechc.inputs.accept import samples_or_signal
from mechc.inputs.signals import Signal, polynomials_at
from mechc.simulation.events.expressions import EventReader, function_of, is_expression
from mechc.system.names import by_name
from mechc.system.parameters import Array
from mechc.system.quantities import Quantity, outputs_in, read_quantity
from mechc.system.system import System
from mechc.system.units import in_si, is_number

Function = Callable[[float], Sequence[float]]  # of t: value, rate, second rate
ORDERS = range(3)


@dataclass(frozen=True)
class Path:
    """Numbers of a model, coordinates or of points, and what each is at a time."""

    quantities: Sequence[Quantity]
    functions: Sequence[Function]

    def at(self, t: float) -> Array:
        """Values, rates and second rates (3, n)."""
        return np.array([function(t) for function in self.functions], np.float64).T


def read_path(system: System, given: Any, p: Array) -> Path:
    """The path that a user gives by names.

    Raises :class:`UnknownNameError`, :class:`ValueOutOfBoundsError` for what is neither coordinate
    nor point, and what is no function of time with two derivatives.
    """
    named = by_name(given, "path", "{'theta': '0.5*sin(2*t)'}")
    if not named:
        raise ValueOutOfBoundsError("the path is empty: give path={'theta': '0.5*sin(2*t)'}")
    for name in named:
        if name not in system.coordinates and outputs_in([name]) != ["points"]:
            known = (*system.coordinates, "points[1,0]")
            raise UnknownNameError("coordinate or number of a point", name, known)
    quantities = [read_quantity(system, name) for name in named]
    functions = [
        _function(system, one, value, p)
        for one, value in zip(quantities, named.values(), strict=True)
    ]
    return Path(quantities, functions)


def _function(system: System, one: Quantity, given: Any, p: Array) -> Function:
    """What a user gives for one number of a path, as a function."""
    if is_expression(given) and not (isinstance(given, str) and is_number(given)):
        return _of_expression(system, one, given, p)
    signal = samples_or_signal(given, 2)
    if signal is not None:
        return _of_signal(one, signal)
    if hasattr(given, "derivative"):
        return lambda t: [float(each(t)) for each in (given, *map(given.derivative, (1, 2)))]
    if isinstance(given, (tuple, list)) and len(given) == 3 and all(map(callable, given)):
        return lambda t: [float(each(t)) for each in given]
    try:
        value = float(in_si(given, one.meaning))
    except (TypeError, ValueError):
        raise ValueOutOfBoundsError(
            f"the path of {one.name} is an expression of t as text, samples (times, values), a "
            "mechc.Signal, a spline of SciPy, or three functions of t: value, rate and second "
            f"rate; it is {brief(given)}"
        ) from None
    return lambda t: [value, 0.0, 0.0]


def _of_expression(system: System, one: Quantity, given: Any, p: Array) -> Function:
    reader = EventReader(system, p, typed_expression)
    expression, t = reader.plain(given), reader.names["t"]
    for name in (*system.coordinates, *system.speeds):
        if expression.has(reader.names[name]):
            raise ValueOutOfBoundsError(
                f"the path of {one.name} depends on t and parameters, not on {name}"
            )
    values, still = function_of([expression.diff(t, order) for order in ORDERS]), np.zeros(0)
    return lambda t: [float(each) for each in values(t, still, p)]


def _of_signal(one: Quantity, signal: Signal) -> Function:
    if signal.smoothness < 1:
        raise ValueOutOfBoundsError(
            f"the path of {one.name} is a {signal.kind} signal, whose rate jumps: take "
            "kind='cubic' or 'quintic'"
        )
    low, high = signal.span

    def values(t: float) -> list[float]:
        rounding = 4 * float(np.spacing(abs(t)))
        if not low - rounding <= t <= high + rounding:
            raise ValueOutOfBoundsError(
                f"the path of {one.name} is sampled from {low:.9g} to {high:.9g} s, but is needed "
                f"at {t:.9g} s"
            )
        at = np.array([t])
        return [float(polynomials_at(*signal.pieces, at, order)[0]) for order in ORDERS]

    return values
