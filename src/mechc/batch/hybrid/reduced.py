"""Reductions of members that no compiled code runs: of a trajectory, by the rules of those in C.

A quantity is sampled eight times in every step on the dense output, and extremes and crossings
found there are refined; means are Gauss-Legendre sums over the steps (``batch/reductions.h``).
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from mechc.batch.reductions import Primitive
from mechc.native._codes import ABSOLUTE, FIRST_CROSSING, LAST, MAXIMUM, MEAN, NORM
from mechc.simulation.trajectory import Trajectory
from mechc.system.parameters import Array

SAMPLES = 8  # of a step, besides its start
ROUNDING = 1e-12  # of a minimum: a parabola that dips less has nothing to find
FINE = 3e-6  # of a step: an extreme placed so is right to the square of it
EXACT = 4e-16  # of the time: of a crossing
NODES, WEIGHTS = np.polynomial.legendre.leggauss(SAMPLES)


class _Samples(NamedTuple):
    """Times and values (n, 9) of a quantity in n steps; at a jump before it at the end of a step,
    after it at the start of the next."""

    t: Array
    values: Array


def reduced(sol: Trajectory, primitive: Primitive) -> float:
    """The number that a motion is reduced to; NaN for a crossing that does not come."""
    kind, *_, direction, level, _ = primitive
    quantity = _quantity(sol, primitive)
    t, y = sol.span, sol.record.states()[1]
    if kind == LAST or not t[1] > t[0]:
        last = float(quantity(np.array([t[1]]), y[-1:])[0])
        return np.nan if kind == FIRST_CROSSING else last
    if kind == MEAN:
        return _mean(sol, quantity)
    samples = _sampled(sol, quantity)
    if kind == FIRST_CROSSING:
        return _first(sol, quantity, samples, direction, level)
    sign = -1.0 if kind == MAXIMUM else 1.0
    return sign * _least(sol, lambda t, y: sign * quantity(t, y), samples, sign)


def _quantity(sol: Trajectory, primitive: Primitive) -> Callable[[Array, Array], Array]:
    """The quantity as a function of times (n,) and states (n, nq + nu)."""
    _, form, output, second, component, *_ = primitive
    system, names = sol.system, list(sol.system.scene.outputs)

    def rows(number: int, t: Array, y: Array) -> Array:
        if number < 0:
            return y
        return system.evaluate(names[number], y, sol.values_along(t), t).reshape(len(t), -1)

    def quantity(t: Array, y: Array) -> Array:
        found = rows(output, t, y)
        if form == NORM:
            return np.asarray(np.linalg.norm(found, axis=1))
        one = found[:, component]
        one = np.abs(one) if form == ABSOLUTE else one
        return one + rows(second, t, y)[:, component] if second >= 0 else one

    return quantity


def _steps(sol: Trajectory) -> tuple[Array, Array]:
    """Starts and ends of the steps between jumps (n,)."""
    t = sol.record.states()[0]
    smooth = np.diff(t) > 0.0
    return t[:-1][smooth], t[1:][smooth]


def _sampled(sol: Trajectory, quantity: Callable[[Array, Array], Array]) -> _Samples:
    begin, end = _steps(sol)
    t = begin[:, None] + (end - begin)[:, None] * np.linspace(0.0, 1.0, SAMPLES + 1)
    t[:, -1] = end
    flat = t.reshape(-1)
    return _Samples(t, quantity(flat, sol.record.interpolate(flat)).reshape(t.shape))


def _mean(sol: Trajectory, quantity: Callable[[Array, Array], Array]) -> float:
    begin, end = _steps(sol)
    half = 0.5 * (end - begin)
    t = (begin + half)[:, None] + half[:, None] * NODES
    flat = t.reshape(-1)
    values = quantity(flat, sol.record.interpolate(flat)).reshape(t.shape)
    first, last = sol.span
    return float(half @ (values @ WEIGHTS)) / (last - first)


# -- extremes --------------------------------------------------------------------------------------


def _least(
    sol: Trajectory, quantity: Callable[[Array, Array], Array], samples: _Samples, sign: float
) -> float:
    """The least of a quantity, by samples and by the dips between them that may go lower."""
    f = sign * samples.values
    best = float(f.min())
    for row, low, high in _dips(f, best):
        best = min(best, _refined(sol, quantity, samples.t[row, low], samples.t[row, high]))
    return best


def _dips(f: Array, best: float) -> list[tuple[int, int, int]]:
    """Steps, and the samples about minima whose parabola may be less than what is known: inside a
    step, and next to its ends where the neighbouring sample is higher."""
    a, b, c = f[:, :-2], f[:, 1:-1], f[:, 2:]
    bend = a - 2.0 * b + c
    with np.errstate(all="ignore"):
        vertex, foreseen = 0.5 * (a - c) / bend, b - 0.125 * (a - c) ** 2 / bend
    inner = (b <= a) & (b <= c) & ((b < a) | (b < c))
    start, end = (
        (a < b) & (vertex > -1.0) & (vertex < 0.0),
        (c < b) & (vertex > 0.0) & (vertex < 1.0),
    )
    start[:, 1:] = end[:, :-1] = False
    found = []
    for where, value, low, high in ((inner, b, 0, 2), (start, a, 0, 1), (end, c, 1, 2)):
        depth = np.abs(value - foreseen)
        may = where & (value - 3.0 * depth < best) & (depth > ROUNDING * np.abs(value))
        found += [(int(row), k + low, k + high) for row, k in np.argwhere(may).tolist()]
    return found


def _refined(
    sol: Trajectory, quantity: Callable[[Array, Array], Array], low: float, high: float
) -> float:
    """The least value between two times of a step."""
    from scipy.optimize import minimize_scalar

    def value(t: float) -> float:
        at = np.array([t])
        return float(quantity(at, sol.record.interpolate(at))[0])

    found = minimize_scalar(
        value, bounds=(low, high), method="bounded", options={"xatol": FINE * (high - low)}
    )
    return float(found.fun)


# -- crossings -------------------------------------------------------------------------------------


def _first(
    sol: Trajectory, quantity: Callable[[Array, Array], Array], samples: _Samples, direction: int,
    level: float,
) -> float:  # fmt: skip
    """The first time at which the quantity goes through a level, smoothly or by a jump."""
    t, f = samples.t.reshape(-1), samples.values.reshape(-1) - level
    crosses = _crosses(f[:-1], f[1:], direction)
    for at in np.flatnonzero(crosses | _turns(f)):
        low, high = t[at], t[at + 1]
        if high == low:
            if crosses[at]:
                return float(low)
            continue
        found = _crossing(sol, quantity, level, direction, (low, high), (f[at], f[at + 1]))
        if found is not None:
            return found
    return np.nan


def _crosses(a: Any, b: Any, direction: int) -> Any:
    """Whether a quantity goes through zero from a to b in the direction asked for."""
    through = (a != 0.0) & ((b == 0.0) | ((a < 0.0) != (b < 0.0)))
    return through & (direction * (b - a) >= 0.0)


def _turns(f: Array) -> Any:
    """Between which samples the quantity may turn on the other side of zero."""
    slopes = np.diff(f)
    turns = np.zeros(len(slopes), bool)
    turning = slopes[:-1] * slopes[1:] < 0.0
    size = np.maximum(np.abs(slopes[:-1]), np.abs(slopes[1:]))
    near = turning & (np.abs(f[1:-1]) <= size)
    turns[:-1] |= near
    turns[1:] |= near
    return turns


def _crossing(
    sol: Trajectory, quantity: Callable[[Array, Array], Array], level: float, direction: int,
    span: tuple[float, float], ends: tuple[float, float],
) -> float | None:  # fmt: skip
    """The first crossing between two samples, of which the quantity may turn between them."""
    from scipy.optimize import brentq, minimize_scalar

    def value(t: float) -> float:
        at = np.array([t])
        return float(quantity(at, sol.record.interpolate(at))[0]) - level

    (low, high), (f_low, f_high) = span, ends
    points = [(low, f_low), (high, f_high)]
    if f_low * f_high > 0.0:
        side = np.sign(f_low)
        found = minimize_scalar(
            lambda t: side * value(t), bounds=span, method="bounded",
            options={"xatol": FINE * (high - low)},
        )  # fmt: skip
        points.insert(1, (float(found.x), float(side * found.fun)))
    for (a, f_a), (b, f_b) in pairwise(points):
        if _crosses(f_a, f_b, direction):
            return b if f_b == 0.0 else float(brentq(value, a, b, xtol=EXACT * max(abs(b), 1.0)))
    return None
