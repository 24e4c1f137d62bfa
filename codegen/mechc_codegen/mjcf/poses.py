"""Numbers, positions and quaternions of MuJoCo -> numbers and places of robots."""

from __future__ import annotations

from typing import Any

from mechc_codegen.robots.geometry import Place, of_quaternion
from mechc_codegen.robots.robot import V3, Number


def exact(number: float) -> Number:
    """The number; as an int where it is -1, 0 or 1, so that products with it vanish."""
    return int(number) if number in (-1.0, 0.0, 1.0) else number


def triple(numbers: Any) -> V3:
    x, y, z = (exact(float(number)) for number in numbers)
    return x, y, z


def place_at(position: Any, quaternion: Any = (1.0, 0.0, 0.0, 0.0)) -> Place:
    return Place(of_quaternion(*map(float, quaternion)), triple(position))
