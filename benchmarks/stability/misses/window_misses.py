"""Rows of windows that miss their change points by 1e-3 to 1e-15 m, each by its own: right, or
flagged?

Two and three four-bars of links of 1 m in a row, ground pivots at k +- 10^-x, from random closed
starts, against the exact motion on their curve of configurations (on_curve.py).
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache

import numpy as np

import mechc

from ...problems.problem import Array
from ...problems.window_row import exact_row, hung, window_row
from ..judge import Row, attempt, row
from .on_curve import judged

METHODS = ("auto", "dopri5", "dop853", "gauss8")
RTOLS = (1e-3, 1e-4, 1e-6, 1e-9, 1e-12)
T_ENDS = (0.5, 1.0, 2.0, 3.0)


def window_misses(quick: bool) -> Iterator[Row]:
    """Random cases, two windows and three in turn."""
    for seed in range(30 if quick else 1000):
        yield case(seed)


@cache
def compiled(count: int) -> mechc.Model:
    return mechc.compile(window_row(count))


def case(seed: int, narrowest: float = 15.0, widest: float = 3.0) -> Row:
    """The run of a seed and its verdict; gaps of 10^-widest to 10^-narrowest m."""
    rng = np.random.default_rng(seed)
    count = 2 + seed % 2
    model = compiled(count)
    gaps = rng.choice([-1.0, 1.0], count) * 10.0 ** -rng.uniform(widest, narrowest, count)
    grounds = np.arange(1, count + 1) + gaps
    params = {f"g_{k}": float(g) for k, g in enumerate(grounds, 1)}
    method, rtol = str(rng.choice(METHODS)), float(rng.choice(RTOLS))
    t_end = float(rng.choice(T_ENDS))
    told = f"seed {seed}: {count} windows, {method}, {rtol:g}"
    guess = {f"q_{k}": float(rng.uniform(-np.pi, np.pi)) for k in range(1, 2 * count + 1)}
    try:
        first = model.assemble(
            {"q_0": float(rng.uniform(-np.pi, np.pi))}, speeds={"u_0": float(rng.normal(0, 3))},
            params=params, guess=guess,
        )  # fmt: skip
    except mechc.MechcError as error:
        return row(told, "refused", status=str(error))
    found = attempt(
        model, t_end, first, params, rtol=rtol, method=method, dense=False, max_steps=500_000
    )
    return judged(told, found, exact_row(list(params.values())), first, absolute, t_end, rtol)


def absolute(state: Array) -> Array:
    """Angles and rates against the ground."""
    n = len(state) // 2
    angles = np.stack([state[:n], state[n:]])
    for k, on in enumerate(hung(n // 2)):
        angles[:, k] += angles[:, on] if on >= 0 else 0.0
    return angles.ravel()
