"""Names in arguments of users: texts, and symbols and functions of time of SymPy.

SymPy is not imported for it: a symbol has its name.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from mechc.errors import UnknownNameError, UnusedValueWarning, ValueOutOfBoundsError, brief


def name_of(key: Any) -> Any:
    """The name of a key: a text unchanged, a symbol or function of time as it is printed.

    The rate ``q.diff(t)`` is the speed ``q_dot`` of a model by Lagrange's method.  Anything else
    is returned unchanged, and is no name that is known.

    Raises
    ------
    TypeError
        For what cannot be a key.
    """
    if isinstance(key, str):
        return key
    if getattr(key, "is_Symbol", False):
        return str(key.name)
    if getattr(key, "is_Derivative", False) and key.derivative_count == 1:
        return f"{name_of(key.expr)}_dot"
    if getattr(key, "is_Function", False):
        return str(key.func.__name__)
    if not _is_hashable(key):
        raise TypeError(f"a name or a symbol is needed, not {brief(key)}")
    return key


def _is_hashable(key: Any) -> bool:
    """Whether it has a hash; tuples and NumPy's masked constant have only the method."""
    try:
        hash(key)
    except TypeError:
        return False
    return True


def checked_word(what: str, given: Any, known: Iterable[str]) -> str:
    """One of the words that an option takes; raises :class:`UnknownNameError` for others."""
    if not isinstance(given, str) or given not in known:
        raise UnknownNameError(what, given if isinstance(given, str) else brief(given), known)
    return given


def names_of(keys: Any) -> list[Any]:
    """The names of several; a single text or symbol counts as one."""
    if isinstance(keys, str) or not isinstance(keys, Iterable) or getattr(keys, "ndim", 1) == 0:
        return [name_of(keys)]
    return [name_of(key) for key in keys]


def by_name(values: Any, what: str, example: str = "{name or symbol: value}") -> dict[Any, Any]:
    """A mapping, with names for symbols and copies of arrays.

    Raises ``TypeError`` for anything but a mapping; the message has ``what`` and the ``example``;
    :class:`ValueOutOfBoundsError` if two keys have one name.
    """
    if not isinstance(values, Mapping):
        raise TypeError(f"{what} are given by name, such as {example}, not as {brief(values)}")
    found: dict[Any, Any] = {}
    for key, value in values.items():
        name = name_of(key)
        if name in found:
            raise ValueOutOfBoundsError(f"{what}: two keys are called {name!r}")
        found[name] = owned(value)
    return found


def owned(given: Any) -> Any:
    """A value that a caller gave, with copies of the arrays, mappings and sequences in it.

    Raises :class:`ValueOutOfBoundsError` for what contains itself.
    """
    kind = type(given)
    if kind is float or kind is str or given is None:
        return given  # nearly always, and fast
    if isinstance(given, np.ndarray):
        return given.copy()
    try:
        if kind is tuple or kind is list:
            return kind(map(owned, given))
        if kind is dict or isinstance(given, Mapping):
            return {key: owned(value) for key, value in given.items()}
    except RecursionError:
        raise ValueOutOfBoundsError(
            "a value contains itself, or is nested too deeply: give numbers, texts or arrays"
        ) from None
    return given


def without_unused(values: Mapping[Any, Any], known: Iterable[str], what: str) -> dict[Any, Any]:
    """Values by name, without symbols that are not in the equations.

    A derivation's constants are often in one dict, and some are not in the equations: two moments
    of inertia of a body that moves in a plane.  They are named in one warning; an unknown text
    stays, and is refused later, since it is likely a typing error.
    """
    names, kept = set(known), by_name(values, what)
    symbols = [n for key, n in zip(values, kept, strict=True) if n is not key]
    unused = [name for name in symbols if name not in names]
    for name in unused:
        del kept[name]
    if unused:
        warnings.warn(
            f"{what}: {', '.join(sorted(unused))} {'is' if len(unused) == 1 else 'are'} not in the "
            "equations of this model, and ignored",
            UnusedValueWarning,
            stacklevel=4,
        )
    return kept
