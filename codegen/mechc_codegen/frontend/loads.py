"""Loads in every form that SymPy takes -> (place, vector) pairs."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from sympy.physics.mechanics import Point, ReferenceFrame
from sympy.physics.mechanics.loads import Force, Torque

from mechc_codegen.description.terms import Load
from mechc_codegen.errors import MechanismError


def plain_loads(loads: Iterable[Any]) -> tuple[Load, ...]:
    """``Force``, ``Torque`` and bare tuples as pairs; actuators give their own loads."""
    pairs: list[Load] = []
    for load in loads:
        if isinstance(load, Force):
            pairs.append((load.point, load.force))
        elif isinstance(load, Torque):
            pairs.append((load.frame, load.torque))
        elif hasattr(load, "to_loads"):
            pairs.extend(plain_loads(load.to_loads()))
        else:
            pairs.append(_pair(load))
    return tuple(pairs)


def _pair(load: Any) -> Load:
    try:
        place, vector = load
    except (TypeError, ValueError):
        raise MechanismError(f"{load!r} is not a load, a pair (Point or frame, vector)") from None
    if not isinstance(place, (Point, ReferenceFrame)):
        raise MechanismError(f"a load acts on a Point or a ReferenceFrame, not on {place!r}")
    return place, vector
