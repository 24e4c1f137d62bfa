"""The kinds of quantities, which decide in code; unit texts are only printed.

The compiler gives each quantity its kind, which is part of the metadata of a scene.
"""

from __future__ import annotations

import math
from enum import StrEnum


class Kind(StrEnum):
    """Kinds of quantities, with the members of the compiler's ``mechc.Kind``."""

    ANGLE = "angle"
    ANGULAR_SPEED = "angular speed"
    LENGTH = "length"
    SPEED = "speed"
    PURE = "pure number"
    PURE_RATE = "rate of a pure number"
    MASS = "mass"
    TIME = "time"
    OTHER = "other"


ANGULAR = frozenset((Kind.ANGLE, Kind.ANGULAR_SPEED))
DIMENSIONLESS = ANGULAR | {Kind.PURE, Kind.PURE_RATE}
# Angles are in radians in the API; people read degrees.
_IN_DEGREES = {Kind.ANGLE: "°", Kind.ANGULAR_SPEED: "°/s"}


def shown_in(kind: Kind, unit: str) -> tuple[str, float]:
    """The unit for display, and the factor that values are multiplied by for it."""
    if kind in _IN_DEGREES:
        return _IN_DEGREES[kind], math.degrees(1.0)
    return unit, 1.0
