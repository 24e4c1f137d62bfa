"""Rows of windows that miss their change points by 1e-3 to 1e-15 m, each by its own: right, or
flagged?

Two and three four-bars of links of 1 m in a row, ground pivots at k +- 10^-x, from random closed
starts, against the exact motion on their curve of configurations (references/linkage_curve.py).
Right: within (100 rtol + 2.5e-10) times the condition, and what the exact motion itself changes
when a pivot moves by the rounding of the closure.  Condition: the largest |d state / d start| at
32 times along the run, by differences.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache

import numpy as np

import mechc

from ...problems.problem import Array
from ...problems.window_row import exact_row, hung, window_row
from ...references.linkage_curve import PlanarLinkage
from ..judge import LARGEST, ROUNDING, Outcome, Row, attempt, measured, row, verdict

METHODS = ("auto", "dopri5", "dop853", "gauss8")
RTOLS = (1e-3, 1e-4, 1e-6, 1e-9, 1e-12)
SHIFT = 1e-7  # of the start, rad and rad/s
ROUNDINGS = 8  # of 2^-51 m each, a loop: sums of lengths, whose angles are sums of relative ones
LOOKS = 32
T_ENDS = (0.5, 1.0, 2.0, 3.0)


def window_misses(quick: bool) -> Iterator[Row]:
    """Random cases, two windows and three in turn."""
    for seed in range(30 if quick else 1000):
        yield case(seed)


@cache
def _compiled(count: int) -> mechc.Model:
    return mechc.compile(window_row(count))


def case(seed: int, narrowest: float = 15.0, widest: float = 3.0) -> Row:
    """The run of a seed and its verdict; gaps of 10^-widest to 10^-narrowest m."""
    rng = np.random.default_rng(seed)
    count = 2 + seed % 2
    model = _compiled(count)
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
    return _judged(told, found, exact_row(list(params.values())), first, t_end, rtol)


def _judged(
    told: str, found: Outcome, linkage: PlanarLinkage, first: Array, t_end: float, rtol: float
) -> Row:
    if isinstance(found, str) or not found.status.ok:
        return verdict(told, found, first, 0.0)
    start, tolerance = _absolute(first), 100 * rtol + ROUNDING
    exact = vectors(linkage.integrate(start, np.array([t_end])))[-1]
    state, scale = vectors(_absolute(found.y[-1])), fastest(exact)
    if float((np.abs(state - exact) / scale).max()) <= tolerance:
        return measured(told, state, exact, tolerance, scale)
    rounded, condition = margins(linkage, start, t_end)
    limit = tolerance * condition + rounded
    if not limit < LARGEST:
        return row(told, "unjudged", status="no arithmetic of doubles at this rtol can tell")
    return measured(told, state, exact, limit, scale, condition=condition, rounded=rounded)


def _absolute(state: Array) -> Array:
    """Angles and rates against the ground."""
    n = len(state) // 2
    angles = np.stack([state[:n], state[n:]])
    for k, on in enumerate(hung(n // 2)):
        angles[:, k] += angles[:, on] if on >= 0 else 0.0
    return angles.ravel()


def vectors(state: Array) -> Array:
    """Unit vectors along the rods, as real and imaginary parts, and their rates."""
    n = state.shape[-1] // 2
    angles, rates = state[..., :n], state[..., n:]
    return np.concatenate([np.cos(angles), np.sin(angles), rates], axis=-1)


def fastest(exact: Array) -> Array:
    """Scales: 1 for unit vectors, the largest rate, at least 1 rad/s, for the rates."""
    n = len(exact) // 3
    return np.repeat([1.0, 1.0, max(1.0, float(np.abs(exact[2 * n :]).max()))], n)


def margins(linkage: PlanarLinkage, start: Array, t_end: float) -> tuple[float, float]:
    """What rounding of the closure changes of the motion, and the condition; NaN where the judge's
    motion does not end."""
    times = np.linspace(0.0, t_end, LOOKS + 1)[1:]
    exact = vectors(linkage.integrate(start, times))
    ulp = ROUNDINGS * 2.0**-51 * len(linkage.grounds)
    sides = [(loop, side) for loop in range(len(linkage.grounds)) for side in (-1, 1)]
    moved = [linkage.moved(loop, side * ulp).integrate(start, times) for loop, side in sides]
    pushed = [linkage.integrate(each, times) for each in _pushed(start)]
    scale = fastest(exact[-1])
    apart = [np.abs((vectors(each) - exact) / scale).max() for each in (*moved, *pushed)]
    grown = np.array(apart[len(moved) :]) / SHIFT
    return float(np.sum(apart[: len(moved)])), float(np.max([1.0, *grown]))


def _pushed(start: Array) -> Iterator[Array]:
    """The start a little later on its curve, and a little faster."""
    angles, rates = np.split(start, 2)
    share = SHIFT / np.abs(rates).max()
    yield np.concatenate([angles + share * rates, rates])
    yield np.concatenate([angles, rates * (1 + share)])
