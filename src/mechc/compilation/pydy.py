"""The ``System`` of PyDy, recognised by its attributes: PyDy itself is never imported."""

from __future__ import annotations

from typing import Any

HELD = ("eom_method", "constants", "initial_conditions", "specifieds", "times")


def is_pydy_system(thing: Any) -> bool:
    """Whether it has a method, constants, initial conditions, specified functions and times."""
    return all(hasattr(thing, name) for name in HELD)


def start_of(thing: Any) -> dict[Any, float]:
    """Coordinates and speeds it starts from; by default 0, as in PyDy."""
    method = thing.eom_method
    given = dict(thing.initial_conditions)
    return {state: float(given.get(state, 0.0)) for state in (*method.q, *method.u)}
