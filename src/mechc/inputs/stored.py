"""Inputs of a run as JSON data, for files: numbers, signals, and what controllers have applied."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from mechc.inputs.signals import PARTS, Signal


def inputs_as_json(given: Mapping[str, Any]) -> dict[str, Any]:
    """Numbers and signals by name; functions of Python are left out."""
    return {name: _input_as_json(value) for name, value in given.items() if not _is_function(value)}


def _is_function(value: Any) -> bool:
    return not isinstance(value, Signal) and (callable(value) or isinstance(value, tuple))


def _input_as_json(value: Any) -> Any:
    if not isinstance(value, Signal):
        return float(value)
    words, arrays = value.parts
    return [words, {part: rows.tolist() for part, rows in arrays.items()}]


def inputs_from_json(data: Mapping[str, Any]) -> dict[str, Any]:
    """Inputs from the JSON data of :func:`inputs_as_json`.

    Raises
    ------
    TypeError, ValueError, LookupError
        For anything else.
    """
    return {name: _input(value) for name, value in data.items()}


def _input(data: Any) -> Any:
    if not isinstance(data, list):
        return float(data)
    words, rows = data
    return Signal.from_parts(words, {part: np.array(rows[part], np.float64) for part in PARTS})
