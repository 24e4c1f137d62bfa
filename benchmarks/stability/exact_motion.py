"""The reference scene against its exact motion: lengths 1, 2, 3, 4 m, two change points a swing.

From rest at 85 degrees, by every explicit method and by gauss8, at seven tolerances: the error at
20 s within 100 rtol 80 and under 2e-8 at rtol <= 1e-11; at 100 s within 100 rtol 160 and under
4e-7; closure to 1e-13 m and 1e-12 m/s at every step and at 20,000 times of the dense output.  Rows
tell the first two change points and the turning angle against the exact ones, too.

The same started whole turns on, 1e3, 1e5 and 1e6, by unit vectors of the links and speeds.  The
start is known to half an ulp of its angles, the end told to another: both are in the limit.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

import mechc

from ..problems.data import four_bar_state, reference
from ..problems.problem import Array
from .judge import Row, bounded, row, runs, verdict
from .random_starts import error_of

METHODS = ("dopri5", "dop853", "gauss8")
RTOLS = tuple(10.0**-k for k in range(6, 13))
GROWTH = {20.0: 80.0, 100.0: 160.0}  # of an error of the start, until then
TIGHTEST = {20.0: 2e-8, 100.0: 4e-7}  # limits at rtol <= 1e-11
CLOSURE, VELOCITY = 1e-13, 1e-12  # m, m/s
OUTPUTS = 20_000
TURNS, TURNED_FOR = (1e3, 1e5, 1e6), 20.0  # s
TURNED_BY, TURNED_RTOLS = ("auto", "dop853", "radau5"), (1e-6, 1e-9)


def exact_motion(quick: bool) -> Iterator[Row]:
    """The same, quick or not: some seconds."""
    for method in METHODS:
        for rtol in RTOLS:
            yield from _judged(method, rtol)


def _judged(method: str, rtol: float) -> Iterator[Row]:
    model, start = mechc.load("four_bar"), four_bar_state("change_point", 0.0)
    for t_end in GROWTH:
        case = f"{method}, {rtol:g}, {t_end:g} s"
        sol = model.simulate(t_end, start, rtol=rtol, method=method, max_steps=2_000_000)
        figures: dict[str, Any] = {"method": method, "rtol": rtol, "steps": sol.stats["steps"]}
        figures |= {"seconds": sol.stats["wall_s"], "passages": len(sol.change_points)}
        if not sol.status.ok:
            yield row(case, "flagged", status=sol.status.code, **figures)
            continue
        error = float(np.abs(sol.y[-1] - four_bar_state("change_point", t_end)).max())
        yield bounded(f"{case}: error", error, limit(rtol, t_end), **figures)
        if t_end == min(GROWTH):
            yield from _throughout(case, sol, figures)


def limit(rtol: float, t_end: float) -> float:
    """What the error may be: rad, rad/s."""
    return min(100 * rtol * GROWTH[t_end], TIGHTEST[t_end] if rtol < 2e-11 else 1.0)


def _throughout(case: str, sol: mechc.Solution, figures: dict[str, Any]) -> Iterator[Row]:
    """Closure at the steps and between them."""
    exact = reference("four_bar_change_point")
    half, turning = float(exact["half_period"]), float(exact["turning_angle_deg"])
    found = [point.t for point in sol.change_points]
    times = [*np.linspace(0, sol.t[-1], OUTPUTS), *found, half]
    states = np.concatenate([sol.y, sol(np.sort(times))])
    known = zip(found, map(float, exact["change_point_times_first_swing"]), strict=False)
    figures |= {"change_points": [abs(a - b) for a, b in known]}
    figures |= {"turning": abs(float(np.degrees(states[:, 0].max())) - turning)}
    yield bounded(f"{case}: closure", _largest(sol.model.constraints(states)), CLOSURE, **figures)
    rates = sol.model.velocity_constraints(states)
    yield bounded(f"{case}: velocity closure", _largest(rates), VELOCITY, **figures)


def _largest(values: Array) -> float:
    return float(np.abs(values).max())


def turns(quick: bool) -> Iterator[Row]:
    """Radau's method only where every case is run."""
    model, exact = mechc.load("four_bar"), four_bar_state("change_point", TURNED_FOR)
    for count in TURNS:
        start = four_bar_state("change_point", 0.0)
        start[:3] += 2 * np.pi * count
        digit = float(np.spacing(start[:3]).max())
        ways = {"methods": TURNED_BY[: 2 if quick else 3], "rtols": TURNED_RTOLS, "dense": False}
        for told, _, rtol, found in runs(model, TURNED_FOR, start, **ways):
            allowed = limit(rtol, TURNED_FOR) + GROWTH[TURNED_FOR] * digit
            apart = lambda sol: np.array([error_of(sol.y[-1], exact)])  # noqa: E731
            case = f"{count:g} turns, {told}"
            yield verdict(case, found, np.zeros(1), allowed, observe=apart, rtol=rtol)
