"""Inputs of a run as JSON data, for files: numbers, signals, and what controllers have applied."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from mechc.inputs.signals import PARTS, Signal


def inputs_as_json(given: Mapping[str, Any]) -> dict[str, Any]:
    """Numbers and signals by name; functions of Python are left out."""
    found: dict[str, Any] = {}
    for name, value in given.items():
        if isinstance(value, Signal):
            words, arrays = value.parts
            found[name] = [words, {part: rows.tolist() for part, rows in arrays.items()}]
        elif not callable(value) and not isinstance(value, tuple):
            found[name] = float(value)
    return found


def inputs_from_json(data: Mapping[str, Any]) -> dict[str, Any]:
    """Inputs from the JSON data of :func:`inputs_as_json`.

    Raises ``TypeError``, ``ValueError``, ``LookupError`` for anything else.
    """
    return {name: _input(value) for name, value in data.items()}


def _input(data: Any) -> Any:
    if not isinstance(data, list):
        return float(data)
    words, rows = data
    return Signal.from_parts(words, {part: np.array(rows[part], np.float64) for part in PARTS})
