"""Runs that end, or start, within 1e-4 s of a change point.

Four-bars of random neutral lengths, parallelograms, kites and the reference linkage, from random
starts.  An end is at 10^-4 to 10^-12 s before or after a change point of the motion; a start is a
state of the exact motion as long before one, and the run goes on for two seconds.

The judge integrates on the exact closure curve (references/closure_curve.py), where a change point
is a point as any other, to the end, and from the start.  mechc's own run over the change point
tells no more than its time, to choose the ends.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

import mechc

from ..problems.problem import Array
from ..references.closure_curve import Geometry
from . import random_starts
from .judge import Row

METHODS = ("auto", "dopri5", "dop853", "gauss8", "radau5")
RTOLS = (1e-4, 1e-6, 1e-9, 1e-12)
LOOSE = 3  # of them for radau5, which takes 1e5 steps a second at 1e-12
NEAREST, FARTHEST = 12.0, 4.0  # decimal exponents of the time apart, s
SEARCHED, AFTER = 10.0, 2.0  # s
SEEDS = (6, 7, 8)
MOST = 6  # change points of a motion


def ends(quick: bool) -> Iterator[Row]:
    """Before a change point or after it."""
    yield from _near(quick, _end_of)


def starts(quick: bool) -> Iterator[Row]:
    """Before a change point."""
    yield from _near(quick, _start_of)


def _near(quick: bool, chosen) -> Iterator[Row]:  # type: ignore[no-untyped-def]
    """A run for every change point that a motion passes, by methods and tolerances drawn."""
    for rng in map(np.random.default_rng, SEEDS[: 1 if quick else None]):
        yield from _drawn(quick, chosen, rng)


def _drawn(quick, chosen, rng: np.random.Generator) -> Iterator[Row]:  # type: ignore[no-untyped-def]
    names, geometry = random_starts.cases(rng, *(6, 10) if quick else (60, 60))
    psi = np.stack([rng.uniform(0, 2 * np.pi, len(names)), rng.normal(0, 3, len(names))])
    for i, name in enumerate(names):
        one = Geometry(*(part[i : i + 1] for part in vars(geometry).values()))
        for met in _change_points(one, psi[:, i : i + 1]):
            apart = float(rng.choice([-1.0, 1.0]) * 10.0 ** -rng.uniform(FARTHEST, NEAREST))
            given = chosen(name, one, psi[:, i : i + 1], met, apart)
            method = str(rng.choice(METHODS))
            rtol = float(rng.choice(RTOLS[: LOOSE if method == "radau5" else None]))
            yield from random_starts.judged(given, (method,), (rtol,))


def _change_points(one: Geometry, psi: Array) -> list[float]:
    """Times of the change points that the motion passes."""
    lengths = {f"l_{k}": float(l) for k, l in enumerate(one.lengths[0])}
    sol = mechc.load("four_bar").simulate(SEARCHED, one.state(psi)[0], lengths, rtol=1e-11)
    return [point.t for point in sol.change_points[:MOST]]


def _end_of(name: str, one: Geometry, psi: Array, met: float, apart: float) -> random_starts.Trials:
    return _trials(f"{name}, {apart:+.1e} s", one, psi, met + apart)


def _start_of(
    name: str, one: Geometry, psi: Array, met: float, apart: float
) -> random_starts.Trials:
    """From the exact motion a little before the change point on."""
    before = one.integrate(psi, np.array([met - abs(apart)]))[-1]
    return _trials(f"{name}, {abs(apart):.1e} s before", one, before, AFTER)


def _trials(name: str, one: Geometry, psi: Array, t_end: float) -> random_starts.Trials:
    times = np.linspace(0, t_end, random_starts.LOOKS + 1)[1:]
    exact, condition = random_starts.judge(one, psi, times)
    return random_starts.Trials((name,), one, psi, t_end, exact, condition)
