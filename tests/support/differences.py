"""Derivatives of runs by Richardson's extrapolation of differences of tight runs; equal batches."""

from collections.abc import Callable
from itertools import pairwise

import numpy as np


def extrapolated(end: Callable[[float], np.ndarray], h: float, levels: int = 4) -> np.ndarray:
    """The derivative of end(d) at d = 0."""
    steps = [h / 2**k for k in range(levels)]
    table = [(end(d) - end(-d)) / (2 * d) for d in steps]
    for k in range(1, levels):
        table = [(4**k * b - a) / (4**k - 1) for a, b in pairwise(table)]
    return table[0]


def apart(found: np.ndarray, wanted: np.ndarray) -> float:
    """The largest difference over the largest number wanted."""
    return float(np.abs(found - wanted).max() / np.abs(wanted).max())


def have_the_same_arrays(a, b) -> None:
    """Two batches, to the last bit."""
    assert set(a.arrays) == set(b.arrays)
    for name in a.arrays:
        assert np.array_equal(a[name], b[name], equal_nan=True), name
