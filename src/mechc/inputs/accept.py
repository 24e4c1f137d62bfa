"""Values given for inputs -> by name: numbers, signals, functions of t or of t, q and u.

Also accepted: texts with a unit, quantities of pint, samples as ``(times, values)``, interpolants
of SciPy, one function for several inputs ``{(F, G): f}``, and functions of state and time together,
``f(x, t)`` or ``f(t, x)`` with x = [q, u].
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from mechc.errors import ValueOutOfBoundsError, brief
from mechc.inputs.signals import Signal
from mechc.system.names import name_of, owned
from mechc.system.parameters import Array
from mechc.system.quantity import NamedQuantity
from mechc.system.system import System
from mechc.system.units import in_si, is_number, refuse_names

TIME = ("t", "time")


def accepted_inputs(given: Any, system: System) -> dict[str, Any]:
    """Name -> number, signal, function, or functions for value and rates.

    Raises ``TypeError`` if it is not a mapping; :class:`ValueOutOfBoundsError` if samples are not
    valid, a unit is not the input's, or it is not known which argument of a function is the time.
    """
    orders = {slot["name"]: max(slot["orders"]) for slot in system.data.get("inputs", ())}

    def one(name: str, value: Any) -> Any:
        quantity = system.quantity_of(name)
        if isinstance(value, str) and not quantity.unit:
            refuse_names(quantity.name, value, system.quantities)
        return _one(quantity, value, orders.get(name, 0))

    if not isinstance(given, Mapping):
        raise TypeError(f"inputs are given by name, such as {{'F': 0.5}}, not as {brief(given)}")
    found: dict[str, Any] = {}
    for key, value in given.items():
        if isinstance(key, tuple):
            several = _several([name_of(each) for each in key], value)
            found |= {name: one(name, x) for name, x in several.items()}
        else:
            name = name_of(key)
            found[name] = one(name, value)
    return found


def laws_apart(given: Any) -> tuple[dict[str, str], Any]:
    """The inputs given as texts that are expressions, by name, and the others as they are."""
    if not isinstance(given, Mapping):
        return {}, given
    laws = {k: x for k, x in given.items() if isinstance(x, str) and not is_number(x)}
    others = {key: value for key, value in given.items() if key not in laws}
    return {name_of(key): law for key, law in laws.items()}, others


def samples_or_signal(
    value: Any, order: int, quantity: NamedQuantity | None = None
) -> Signal | None:
    """Samples ``(times, values)``, signals and interpolants as a signal; None for anything else.

    ``order``: the highest derivative that is needed of samples.  ``quantity``: that of the values.
    """
    if isinstance(value, Signal):
        return value
    pair = isinstance(value, (tuple, list)) and len(value) == 2 and not any(map(callable, value))
    if pair and all(np.ndim(row) == 1 for row in value):
        kind = "linear" if order == 0 else "cubic" if order <= 3 else "quintic"
        times, values = value
        return Signal(times, values if quantity is None else in_si(values, quantity), kind)
    return Signal.of_interpolant(value)


def _one(quantity: NamedQuantity, value: Any, order: int) -> Any:
    signal = samples_or_signal(value, order, quantity)
    if signal is not None:
        return signal
    told = quantity.name
    return with_state_apart(told, value) if callable(value) else owned(in_si(value, quantity))


def with_state_apart(what: str, function: Callable[..., Any]) -> Callable[..., Any]:
    """A function of state and time as one of t, q and u; any other unchanged."""
    try:
        signature = inspect.signature(function)
    except (TypeError, ValueError):  # unknown for some compiled functions
        return function
    if _binds(signature, 1) or _binds(signature, 3) or not _binds(signature, 2):
        return function
    first, second = list(signature.parameters)[:2]
    if (first in TIME) == (second in TIME):
        raise ValueOutOfBoundsError(
            f"{what} must be a function of t, or of t, q and u; it takes {signature}, and it "
            "is not clear which of them is the time: write lambda t, q, u: "
            "f(numpy.hstack([q, u]), t)"
        )
    if second in TIME:
        return lambda t, q, u: function(np.concatenate([q, u]), t)
    return lambda t, q, u: function(t, np.concatenate([q, u]))


def takes_state(what: str, function: Callable[..., Any], counts: Sequence[int] = (1, 3)) -> bool:
    """Whether a function is one of t, q and u, not of t alone.

    ``counts``: of a function that could be called both ways, the number of arguments that is meant
    comes first.
    """
    try:
        signature = inspect.signature(function)
    except (TypeError, ValueError):  # unknown for some compiled functions
        return False
    for count in counts:
        if _binds(signature, count):
            return count == 3
    raise ValueOutOfBoundsError(
        f"{what} must be a function of t, or of t, q and u; it takes {signature}"
    )


def _binds(signature: inspect.Signature, count: int) -> bool:
    try:
        signature.bind(*[0.0] * count)
    except TypeError:
        return False
    return True


def _several(names: list[str], value: Any) -> dict[str, Any]:
    """Numbers, samples or interpolants for several inputs, or a function evaluated once for all."""
    what = f"the inputs {', '.join(names)}"
    columns = _columns(value, len(names))
    if columns is not None:
        return dict(zip(names, columns, strict=True))
    if not callable(value):
        if not isinstance(value, (tuple, list, np.ndarray)) or len(value) != len(names):
            raise ValueOutOfBoundsError(
                f"{what} take {len(names)} numbers, a function that returns as many, or "
                f"(times, values) with values (n, {len(names)})"
            )
        return dict(zip(names, value, strict=True))
    function = _Together(what, len(names), value)
    return {name: function.component(k) for k, name in enumerate(names)}


def _columns(value: Any, count: int) -> list[Any] | None:
    """The samples, or the interpolants, of each of several inputs; None for anything else."""
    if isinstance(value, (tuple, list)) and len(value) == 2 and np.ndim(value[0]) == 1:
        times, values = value
        if np.shape(values) == (len(times), count):
            return [(times, column) for column in np.asarray(values).T]
    signals = Signal.of_interpolants(value)
    return signals if signals is not None and len(signals) == count else None


class _Together:
    """A function of several inputs; its last value is kept, as they are evaluated in sequence."""

    def __init__(self, what: str, size: int, function: Callable[..., Any]) -> None:
        self._what, self._size = what, size
        self._function = with_state_apart(what, function)
        self._of_time = _binds(inspect.signature(self._function), 1)
        self._last: tuple[Any, Array] = (None, np.zeros(0))

    def component(self, k: int) -> Callable[..., float]:
        """The function of one of them."""
        if self._of_time:
            return lambda t: float(self._at(t)[k])
        return lambda t, q, u: float(self._at(t, q, u)[k])

    def _at(self, t: float, *state: Array) -> Array:
        key = (t, *(part.tobytes() for part in state))
        if self._last[0] != key:
            values = np.ravel(np.asarray(self._function(t, *state), dtype=np.float64))
            if len(values) != self._size:
                raise ValueError(f"{self._what} need {self._size} numbers, not {len(values)}")
            self._last = key, values
        return self._last[1]
