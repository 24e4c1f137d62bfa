"""Default values of parameters: numbers are not compiled in, so that no value affects the key.

Names of numbers are checked when the model is there.  Defaults that follow other parameters are
expressions, and compiled.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Any

from mechc.errors import UnknownNameError
from mechc.system.names import by_name, name_of, without_unused
from mechc.system.system import System
from mechc.system.units import has_unit, is_with_unit


def split(
    defaults: Mapping[Any, Any], states: Iterable[Any]
) -> tuple[dict[Any, Any], dict[Any, Any]]:
    """(numbers, some with units; values to compile: expressions, and the starts of states)."""
    by_name(defaults, "defaults")  # refuses a name given twice
    kept = {name_of(state) for state in states}
    numbers: dict[Any, Any] = {}
    compiled: dict[Any, Any] = {}
    for key, value in defaults.items():
        number = None if name_of(key) in kept else _number(value)
        if number is None:
            compiled[key] = value
        else:
            numbers[key] = number
    return numbers, compiled


def with_defaults(system: System, numbers: Mapping[Any, Any], read: Iterable[str]) -> System:
    """The system with these values; ``read``: names of all symbols that the object contains.

    Values of symbols that are not in the equations are kept for further outputs, as that of g, on
    which the potential energy alone may depend.  Where the object does not contain the symbol
    either, a warning says that its value is ignored.

    Raises :class:`UnknownNameError` for a text that names no symbol of the object.
    """
    idle = {*read, *system.data["fixed"]} - set(system.parameters)
    told = {key: value for key, value in numbers.items() if name_of(key) not in idle}
    for name in without_unused(told, system.parameters, "defaults"):
        if name not in system.parameters:
            raise UnknownNameError("parameter", name, system.parameters)
    return _again_or_new(system, by_name(numbers, "defaults"))


def _again_or_new(system: System, numbers: Mapping[str, Any]) -> System:
    """The system with these defaults; the same object as the last time if they are the same."""
    last: tuple[Any, System] = system.cache.get(_again_or_new, (None, system))
    if last[0] != numbers:
        last = system.cache[_again_or_new] = dict(numbers), system.with_defaults(numbers)
    return last[1]


def _number(value: Any) -> Any:
    """A finite number, or one with a unit; None for what the compiler takes or refuses."""
    if has_unit(value) and not (isinstance(value, str) and not is_with_unit(value)):
        return value
    if isinstance(value, str) or getattr(value, "free_symbols", None):
        return None
    try:
        number = float(value)
    except (TypeError, ValueError):
        return None
    return number if math.isfinite(number) else None
