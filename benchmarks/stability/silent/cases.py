"""Runs that once ended wrong without a word, each with its own exact answer.

A four-bar that passes two near misses in one step and a double window whose second weak row hid
behind the first (exact motion on their curves of configurations, misses/on_curve.py); a crank that
spins, started 1e5 and 1e6 turns on (closure and energy); a folded slider-crank that turns with a
constant acceleration and passes a change point in every half turn (closed form); an event that
changes faster than the motion; the drift of the energy where the end alone is reported.

Linkages whose rows are redundant are a family of their own (redundant_loops.py).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np
from mechc_codegen.library.planar.slider_crank import slider_crank

import mechc

from ...problems.problem import Array
from ...problems.window_row import exact_row
from ...references.linkage_curve import four_bar
from ..judge import Outcome, Row, attempt, bounded, row, runs, verdict
from ..misses.on_curve import judged
from ..misses.window_misses import absolute, compiled

METHODS = ("auto", "dopri5", "dop853", "gauss8", "radau5")
SPUN_BY = ("auto", "dop853", "gauss8")  # others take more than a million steps at 1e-12
FAST = ("auto", "dopri5", "dop853", "gauss8")
CLOSURE, DRIFT = 1e-13, 1e-7  # of the longest link; of the largest kinetic energy, at rtol <= 1e-9
PASSAGE, ZERO = 1e-6, 1e-11  # rad; s


def once_silent(quick: bool) -> Iterator[Row]:
    """The same cases, by fewer methods and tolerances if quick."""
    yield from _two_near_misses((1e-4, 1e-6) if quick else (1e-3, 1e-4, 1e-6, 1e-9, 1e-12))
    yield from _double_window((1e-9,) if quick else (1e-3, 1e-4, 1e-6, 1e-9, 1e-12))
    yield from _spins((1e-9,) if quick else (1e-6, 1e-9, 1e-12))
    yield from _passages((None,) if quick else (None, 1e-3, 1e-4, 1e-6, 1e-9, 1e-12))
    yield from _fast_events((1000.0,) if quick else (300.0, 1000.0, 7777.0))
    yield from _drifts((1e-6,) if quick else (1e-3, 1e-6, 1e-9))


# -- near misses ----------------------------------------------------------------------------------


def _two_near_misses(rtols: Sequence[float]) -> Iterator[Row]:
    """Nearly a parallelogram: its links come in line within 3e-10 m, twice in one step."""
    model = mechc.load("four_bar")
    lengths, masses = (2.796875, 3.7499999996978386, 2.796875, 3.75), (0.792, 0.296, 4.489)
    params = {f"l_{k}": l for k, l in enumerate(lengths)}
    params |= {f"m_{k}": m for k, m in enumerate(masses)}
    first = model.assemble(
        {"theta_0": 1.2019444600348876}, speeds={"omega_0": -2.2806280593736563}, params=params,
        guess={"theta_1": -1.521, "theta_2": 0.418},
    )  # fmt: skip
    exact, ways = four_bar(lengths, masses), {"methods": METHODS, "rtols": rtols, "dense": False}
    for how, _, rtol, found in runs(model, 4.0, first, params, **ways):
        told = f"two near misses in one step, {how}"
        yield judged(told, found, exact, first, lambda state: state, 4.0, rtol)


def _double_window(rtols: Sequence[float]) -> Iterator[Row]:
    model, params = compiled(2), {"g_1": 0.9999999999689277, "g_2": 2.0}
    angle = 1.3746
    upright = {"q_1": -angle, "q_2": angle - np.pi, "q_3": 0.0, "q_4": angle - np.pi}
    first = model.assemble({"q_0": angle}, {"u_0": -0.5656}, params=params, guess=upright)
    exact, ways = exact_row([*params.values()]), {"methods": METHODS, "rtols": rtols}
    for how, _, rtol, found in runs(model, 2.5, first, params, **ways, dense=False):
        told = f"a second weak row behind the first, {how}"
        yield judged(told, found, exact, first, absolute, 2.5, rtol)


# -- large angles ---------------------------------------------------------------------------------


def _spins(rtols: Sequence[float]) -> Iterator[Row]:
    """A crank at 300 rad/s, 1,000 turns more, far from zero; angles are told as sums."""
    model = mechc.load("four_bar")
    params = {"l_0": 1.0, "l_1": 3.0, "l_2": 2.5, "l_3": 3.5}
    start = model.assemble({"theta_0": 1.0}, speeds={"omega_0": 300.0}, params=params)
    for turns in (0.0, 1e5, 1e6):
        first = start + np.repeat([2 * np.pi * turns, 0.0], 3)
        ways = {"methods": SPUN_BY, "rtols": rtols, "dense": False, "max_steps": 1_000_000}
        for how, _, rtol, found in runs(model, 20 * np.pi / 3, first, params, **ways):
            yield from _kept(f"spins from turn {turns:g}, {how}", found, rtol)


def _kept(case: str, found: Outcome, rtol: float) -> Iterator[Row]:
    if isinstance(found, str) or not found.status.ok:
        yield verdict(case, found, np.zeros(1), 0.0)
        return
    lengths = found.params[:4]
    yield closed(case, found, max(lengths), lengths[:3].sum())
    yield bounded(f"{case}: energy", _drift(found), max(DRIFT, 100 * rtol))


def closed(case: str, found: mechc.Solution, longest: float, reach: float) -> Row:
    """Loops closed at every step, but for the last digit of angles; ``reach``: of all rods."""
    digit = float(np.spacing(np.abs(found.q).max())) / 2
    open_by = float(found.closure.max())
    return bounded(f"{case}: closure", open_by, CLOSURE * longest + digit * reach)


def _drift(found: mechc.Solution) -> float:
    """Of the energies of all steps, of the largest kinetic one."""
    kinetic = found.model.kinetic_energy(found.y, found.params, found.t)
    return float(np.abs(found.energy - found.energy[0]).max() / kinetic.max())


# -- passages, events, the drift of the energy ----------------------------------------------------


def _passages(rtols: Sequence[float | None]) -> Iterator[Row]:
    """Crank and rod of one length, folded: the crank turns with a constant acceleration."""
    model = mechc.compile(slider_crank())
    first = np.array([0.3, 0.3 + np.pi, 0.0, 3.0, 3.0, 0.0])
    for method in METHODS:
        for rtol in rtols:
            policy = {} if rtol is None else {"rtol": rtol}
            found = attempt(model, 4.0, first, {"l_0": 0.75, "l_1": 0.75}, method=method, **policy)
            yield _counted(f"passages, {method}, {rtol or 'default'}", found)


def _counted(case: str, found: Outcome) -> Row:
    if isinstance(found, str) or not found.status.ok:
        return verdict(case, found, np.zeros(1), 0.0)
    exact = np.pi * (np.arange(1, found["theta"][-1] / np.pi + 0.5) - 0.5)
    return alike(case, [point.q[0] for point in found.change_points], exact, PASSAGE)


def _fast_events(rates: Sequence[float]) -> Iterator[Row]:
    """sin(rate t) on the four-bar, 20 s."""
    model = mechc.load("four_bar")
    first = model.assemble({"theta_0": 1.0}, params={"l_3": 3.5})
    for rate in rates:
        exact = np.arange(1, int(20.0 * rate / np.pi) + 1) * np.pi / rate
        for method in FAST:
            case = f"sin({rate:g} t) as an event, {method}"
            found = attempt(
                model, 20.0, first, {"l_3": 3.5}, method=method,
                events=[lambda t, y, rate=rate: math.sin(rate * t)],
            )  # fmt: skip
            if isinstance(found, str) or not found.status.ok or found.status.warnings:
                yield row(case, "flagged", status=str(getattr(found, "status", found)))
                continue
            yield alike(case, found.events[0].t, exact, ZERO)


def alike(case: str, found: Sequence[float] | Array, exact: Array, limit: float) -> Row:
    if len(found) != len(exact):
        return row(case, "WRONG", status=f"{len(found)} of {len(exact)} found")
    return bounded(case, float(np.abs(np.array(found) - exact).max()), limit)


def _drifts(rtols: Sequence[float]) -> Iterator[Row]:
    """The drift over all steps, whatever is reported: some, and the same."""
    model = mechc.load("four_bar")
    first = model.assemble({"theta_0": 1.0}, params={"l_3": 3.5})
    for method in METHODS:
        for rtol in rtols:
            whole, end = (
                model.simulate(20.0, first, {"l_3": 3.5}, rtol=rtol, method=method, **reported)
                for reported in ({}, {"t_eval": [20.0]})
            )
            drift = _drift(whole)
            case = f"energy_drift, the end alone reported, {method}, {rtol:g}"
            yield bounded(case, abs(end.energy_drift - drift), 1e-3 * drift)
