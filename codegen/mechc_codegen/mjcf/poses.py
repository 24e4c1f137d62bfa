"""Numbers, positions and quaternions of MuJoCo -> numbers and places of robots."""

from __future__ import annotations

from math import ulp
from typing import Any

from mechc_codegen.robots.geometry import IDENTITY, Mat, Place
from mechc_codegen.robots.robot import V3, Number

_ROUNDING = 4 * ulp(1.0)  # of products of a quaternion of length one


def exact(number: float) -> Number:
    """The number; as an int where it is -1, 0 or 1, so that products with it vanish."""
    return int(number) if number in (-1.0, 0.0, 1.0) else number


def triple(numbers: Any) -> V3:
    x, y, z = (exact(float(number)) for number in numbers)
    return x, y, z


def place_at(position: Any, quaternion: Any = (1.0, 0.0, 0.0, 0.0)) -> Place:
    return Place(_rotation(*map(float, quaternion)), triple(position))


def _rotation(w: float, x: float, y: float, z: float) -> Mat:
    entries = (
        (w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z),
    )
    rounded = tuple(tuple(_round(entry) for entry in row) for row in entries)
    return IDENTITY if rounded == IDENTITY else rounded


def _round(entry: float) -> Number:
    """-1, 0 or 1 where rounding alone parts the entry from it."""
    nearest = round(entry)
    return nearest if abs(entry - nearest) <= _ROUNDING else entry
