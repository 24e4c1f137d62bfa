"""Derivatives of runs by Richardson's extrapolation of differences of tight runs; equal batches;
motions that other tools simulate."""

from collections.abc import Callable
from itertools import pairwise

import numpy as np

import mechc
from tests.support.pendulums import pushed_mass


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


def has_the_options_of_simulate(tool):
    """Check ``mechc.jax`` or ``mechc.torch``: the motion is that of simulate with the same options,
    and each option changes it."""
    model = mechc.compile(pushed_mass(), defaults={"m": 2.0, "k": 1.0}, outputs=("sensitivities",))
    y0, options = [0.1, 0.2], {"inputs": {"F": "sin(2*t)"}, "rtol": 1e-6, "method": "dop853"}

    def end(t0, **given):
        return np.asarray(tool(model, t0=t0, **given)(2.0, y0))

    found = end(0.3, **options)
    np.testing.assert_array_equal(found, model.simulate((0.3, 2.0), y0, **options).y[-1])
    assert apart(found, end(0.0, **options)) > 1e-3
    assert apart(found, end(0.3, **{**options, "inputs": {"F": 0.0}})) > 1e-3
    assert apart(found, end(0.3, **{**options, "method": "auto"})) > 1e-12
