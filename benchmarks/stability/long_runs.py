"""A million periods: phase, energy and closure at the end, each against a closed form.

The pendulum's phase is known from the Jacobi functions in 40 digits, the four-bar's from its
period in 17 digits and its exact state a second after the start.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import mpmath as mp
import numpy as np

import mechc

from ..problems.data import four_bar_state
from ..references.linkage_curve import four_bar
from ..timing.cases import Array
from .judge import Row, bounded, limit_of, measured, row
from .values import energy, model_of

ANGLE = 1.0  # rad, from which the pendulum is let go
PERIOD = 2 * 1.6607240639610833  # s, of the regular four-bar
REGULAR = {"l_3": 3.5}
FIXED = 0.01  # s
RUNS: Mapping[str, Mapping[str, Any]] = {
    "dop853": {"method": "dop853"},
    "gauss8": {"method": "gauss8"},
    "gauss8, fixed steps": {"method": "gauss8", "first_step": FIXED, "max_step": FIXED},
}
DRIFT = 1e-7  # of the largest kinetic energy: where it adds up, it shows in the phase as well
CLOSURE = 1e-13  # m, whatever the length of the run
LOOKS = 101  # times at which the energy is taken
ALIKE = 1e-3  # of a step: fixed steps differ by rounding of the time, nothing else
FAR = 8  # periods over which the growth of an error of the start is measured


def periods(quick: bool) -> Iterator[Row]:
    """The pendulum swings a million times, the four-bar a tenth of that."""
    for method, rtol, count in (
        ("auto", 1e-10, 10**6), ("dop853", 1e-12, 10**5), ("taylor", 1e-9, 10**6),
    ):  # fmt: skip
        yield from _pendulum(method, rtol, count // 100 if quick else count)
    for method, rtol, count in (("auto", 1e-12, 10**5), ("dop853", 1e-12, 10**4)):
        yield from _four_bar(method, rtol, count // 100 if quick else count)
    yield from _kept(1e3 if quick else 1e4)


def swing(theta: mp.mpf, t: mp.mpf) -> Array:
    """Angle and rate of a pendulum of 1 m, let go at an angle: sin(x / 2) = k cd(w t, k)."""
    w, k = mp.sqrt(mp.mpf(9.81)), mp.sin(theta / 2)
    u = mp.fmod(w * t, 4 * mp.ellipk(k**2))
    cd, sd, nd = (mp.ellipfun(name, u, m=k**2) for name in ("cd", "sd", "nd"))
    angle = 2 * mp.asin(k * cd)
    rate = -2 * k * w * (1 - k**2) * sd * nd / mp.sqrt(1 - (k * cd) ** 2)
    return np.array([float(angle), float(rate)])


def _pendulum(method: str, rtol: float, count: int) -> Iterator[Row]:
    """Until the lowest point, where a shift of the phase shows most."""
    model = model_of("pendulum")
    with mp.workdps(40):
        period = 4 * mp.ellipk(mp.sin(mp.mpf(ANGLE) / 2) ** 2) / mp.sqrt(mp.mpf(9.81))
        t_end = float((count + mp.mpf(1) / 4) * period)
        exact = swing(mp.mpf(ANGLE), mp.mpf(t_end))
        pushed = swing(mp.mpf(ANGLE) + mp.mpf(10) ** -12, mp.mpf(t_end))
    condition = float(np.abs(pushed - exact).max()) / 1e-12
    case = f"pendulum, {count} periods, {method}, {rtol:g}"
    yield from _followed(case, model, t_end, np.array([ANGLE, 0.0]), {}, exact, condition,
                         "pendulum", rtol=rtol, method=method)  # fmt: skip


def _four_bar(method: str, rtol: float, count: int) -> Iterator[Row]:
    model = model_of("four_bar")
    y0, beside = (
        model.assemble({"theta_0": angle}, params=REGULAR)
        for angle in (np.radians(85), np.radians(85) + 1e-6)
    )
    exact = four_bar_state("regular", 1.0)
    bar, far = four_bar((1.0, 2.0, 3.0, 3.5)), np.array([FAR * PERIOD + 1.0])
    ends = [bar.integrate(y, far) for y in (y0, beside)]
    growth = float(np.abs(ends[1] - ends[0]).max()) / 1e-6 / FAR
    case = f"four-bar, {count} periods, {method}, {rtol:g}"
    yield from _followed(case, model, count * PERIOD + 1.0, y0, REGULAR, exact, growth * count,
                         "four_bar", rtol=rtol, method=method)  # fmt: skip


def _followed(
    case: str, model: mechc.Model, t_end: float, y0: Array, params: Mapping[str, float],
    exact: Array, condition: float, scene: str, *, rtol: float, method: str,
) -> Iterator[Row]:  # fmt: skip
    """One member of a batch, which keeps no steps; angles after whole periods are the same."""
    batch = model.simulate_batch(
        t_end, y0, params, rtol=rtol, method=method, t_eval=np.linspace(0, t_end, LOOKS),
        max_steps=10**9, progress=False,
    )  # fmt: skip
    if not batch.ok[0]:
        yield row(case, "flagged", status=batch.status(0).code)
        return
    yield measured(f"{case}: state", batch.y[0], exact, limit_of(rtol, condition))
    states = batch["y_eval"][0]
    values = dict(
        zip(model.parameters, model.system.parameter_set.resolve(params).tolist(), strict=True)
    )
    kinetic, potential = energy(scene, states, values)
    total = kinetic + potential
    drift = float(np.abs(total - total[0]).max() / kinetic.max())
    yield bounded(f"{case}: energy", drift, DRIFT)
    if model.constraint_names:
        open_by = float(np.abs(model.constraints(states, params)).max())
        yield bounded(f"{case}: closure", open_by, CLOSURE)


def _kept(t_end: float) -> Iterator[Row]:
    """Every step of a long run at rtol 1e-10: closure and energy stay where they are.

    Fixed steps are shorter than their error asks for, and are all alike.
    """
    model = model_of("four_bar")
    y0 = model.assemble({"theta_0": np.radians(85)}, params=REGULAR)
    for name, policy in RUNS.items():
        case = f"four-bar, {name}, until {t_end:g} s"
        sol = model.simulate(t_end, y0, REGULAR, rtol=1e-10, dense=False, **policy)
        if not sol.status.ok:
            yield row(case, "flagged", status=sol.status.code)
            continue
        departure = np.abs(sol.energy - sol.energy[0]) / model.kinetic_energy(sol.y, REGULAR).max()
        figures = {"method": name, "steps": sol.stats["steps"], "seconds": sol.stats["wall_s"]}
        figures |= {"early": float(departure[sol.t <= t_end / 10].max())}
        figures |= {"velocity": float(sol.velocity_closure.max())}
        yield bounded(f"{case}: closure", float(sol.closure.max()), CLOSURE, **figures)
        yield bounded(f"{case}: energy", float(departure.max()), DRIFT / 10, **figures)
        if "max_step" in policy:
            steps = np.diff(sol.t)
            spread = float(steps.max() - steps[:-1].min()) / FIXED
            yield bounded(f"{case}: alike", spread, ALIKE, **figures)
