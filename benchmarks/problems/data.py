"""Exact motions of ``benchmarks/data``, and values from them."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from .problem import Array

DATA = Path(__file__).resolve().parents[1] / "data"


def reference(name: str) -> dict[str, Any]:
    """The whole of ``data/NAME.json``."""
    return json.loads((DATA / f"{name}.json").read_text("utf-8"))  # type: ignore[no-any-return]


def four_bar_state(scene: str, time: float) -> Array:
    """The exact state (6,) of the "regular" or the "change_point" four-bar at a time (s)."""
    return np.array(reference(f"four_bar_{scene}")["states"][str(float(time))], float)


def values_at(name: str, time: float, columns: Sequence[str]) -> Array:
    """Exact values of these columns of ``data/NAME.json`` at a time; a KeyError without it."""
    data = reference(name)
    for row in data["rows"]:
        if float(row[0]) == time:
            return np.array([float(row[data["columns"].index(column)]) for column in columns])
    raise KeyError(f"{name}: nothing is known at t = {time}")
