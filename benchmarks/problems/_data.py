"""Values of the reference files in ``benchmarks/data`` by column and time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from _problem import Array
from _scene import reference


def values_at(name: str, time: float, columns: Sequence[str]) -> Array:
    """Exact values of these columns of ``data/NAME.json`` at a time; a KeyError without it."""
    data = reference(name)
    for row in data["rows"]:
        if float(row[0]) == time:
            return np.array([float(row[data["columns"].index(column)]) for column in columns])
    raise KeyError(f"{name}: nothing is known at t = {time}")


def state(model: Any, given: Mapping[str, float]) -> Array:
    """The state with these components, the others zero."""
    y = np.zeros(len(model.coordinates) + len(model.speeds))
    for name, value in given.items():
        y[model.state_index(name)] = value
    return y
