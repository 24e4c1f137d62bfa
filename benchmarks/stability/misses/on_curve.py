"""A run of a planar linkage with one freedom, against its exact motion on its curve of
configurations (references/linkage_curve.py).

Right: within (100 rtol + 2.5e-10) times the condition, and what the exact motion itself changes
when a pivot moves by the rounding of the closure.  Condition: the largest |d state / d start| at
32 times along the run, by differences.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ...problems.problem import Array
from ...references.linkage_curve import PlanarLinkage
from ..judge import LARGEST, ROUNDING, Outcome, Row, measured, row, verdict

SHIFT = 1e-7  # of the start, rad and rad/s
ROUNDINGS = 8  # of 2^-51 m each, a loop: sums of lengths, whose angles are sums of relative ones
LOOKS = 32


def judged(
    told: str, found: Outcome, linkage: PlanarLinkage, first: Array,
    absolute: Callable[[Array], Array], t_end: float, rtol: float, rounding: float = ROUNDING,
) -> Row:  # fmt: skip
    """``absolute``: angles and rates against the ground, of a state of the run."""
    if isinstance(found, str) or not found.status.ok:
        return verdict(told, found, first, 0.0)
    start, tolerance = absolute(first), 100 * rtol + rounding
    exact = vectors(linkage.integrate(start, np.array([t_end])))[-1]
    state, scale = vectors(absolute(found.y[-1])), fastest(exact)
    if float((np.abs(state - exact) / scale).max()) <= tolerance:
        return measured(told, state, exact, tolerance, scale)
    rounded, condition = margins(linkage, start, t_end)
    limit = tolerance * condition + rounded
    if not limit < LARGEST:
        return row(told, "unjudged", status="no arithmetic of doubles at this rtol can tell")
    return measured(told, state, exact, limit, scale, condition=condition, rounded=rounded)


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
    angles, rates = np.split(start, 2)
    later = linkage.integrate(start, times[:1] / 1000)[0, len(rates) :]
    along = SHIFT * later / np.abs(later).max()  # of the curve, at rest too
    beside = np.concatenate([angles + along, rates]), np.concatenate([angles, rates + along])
    pushed = [linkage.integrate(each, times) for each in beside]
    scale = fastest(exact[-1])
    apart = [np.abs((vectors(each) - exact) / scale).max() for each in (*moved, *pushed)]
    grown = np.array(apart[len(moved) :]) / SHIFT
    return float(np.sum(apart[: len(moved)])), float(np.max([1.0, *grown]))
