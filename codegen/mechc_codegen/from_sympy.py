"""Objects of ``sympy.physics.mechanics`` -> Source: which reader reads which."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from sympy.physics.mechanics import KanesMethod, LagrangesMethod, System

from mechc_codegen.from_kane import read_kane
from mechc_codegen.from_lagrange import read_lagrange
from mechc_codegen.from_system import read_system
from mechc_codegen.source import Source

READERS: dict[type, Callable[[Any], Source]] = {
    KanesMethod: read_kane,
    LagrangesMethod: read_lagrange,
    System: read_system,
}


def readable(thing: object) -> bool:
    """Whether there is a reader for it."""
    return isinstance(_unwrapped(thing), tuple(READERS))


def read(thing: Any) -> Source:
    """What a mechanics object holds.

    Raises
    ------
    MechanismError
        If its equations are not formed; the message says what to call.
    """
    inner = _unwrapped(thing)
    reader = next(reader for kind, reader in READERS.items() if isinstance(inner, kind))
    return reader(inner)


def _unwrapped(thing: Any) -> Any:
    """A JointsMethod, deprecated, keeps the real object inside."""
    return thing.method if type(thing).__name__ == "JointsMethod" else thing
