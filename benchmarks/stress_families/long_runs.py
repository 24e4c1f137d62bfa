"""A million periods: phase, energy and closure at the end, each against a closed form.

The pendulum's phase is known from the Jacobi functions in 40 digits, the four-bar's from its
period in 17 digits and its exact state a second after the start.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import mpmath as mp
import numpy as np
from _four_bar_tangent import TangentBar
from _scene import reference
from _stress_judge import Row, bounded, limit_of, measured, row
from _timing import Array
from long_run import FIXED, RUNS, measure

import mechc
from stress_families.values import SCENES, model_of

ANGLE = 1.0  # rad, from which the pendulum is let go
PERIOD = 2 * 1.6607240639610833  # s, of the regular four-bar
REGULAR = {"l_3": 3.5}
DRIFT = 1e-7  # of the largest kinetic energy: where it adds up, it shows in the phase as well
CLOSURE = 1e-13  # m, whatever the length of the run
LOOKS = 101  # times at which the energy is taken
ALIKE = 1e-3  # of a step: fixed steps differ by rounding of the time, nothing else
FAR = 8  # periods over which the growth of an error of the start is measured


def periods(quick: bool) -> Iterator[Row]:
    """The pendulum swings a million times, the four-bar a tenth of that."""
    for method, rtol, count in (("auto", 1e-10, 10**6), ("dop853", 1e-12, 10**5)):
        yield from _pendulum(method, rtol, count // 100 if quick else count)
    for method, rtol, count in (("auto", 1e-12, 10**5), ("dop853", 1e-12, 10**4)):
        yield from _four_bar(method, rtol, count // 100 if quick else count)
    yield from _steps_alike(100.0 if quick else 1e4)


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
    exact = np.array(reference("four_bar_regular")["states"]["1.0"], float)
    bar = TangentBar((1.0, 2.0, 3.0, 3.5), (1.0, 2.0, 3.0))
    ends = [bar.final(y, FAR * PERIOD + 1.0, 1e-11) for y in (y0, beside)]
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
    states, size = batch["y_eval"][0], len(y0) // 2
    values = dict(
        zip(model.parameters, model.system.parameter_set.resolve(params).tolist(), strict=True)
    )
    kinetic, potential = SCENES[scene].energy(states[:, :size], states[:, size:], values)
    energy = kinetic + potential
    drift = float(np.abs(energy - energy[0]).max() / kinetic.max())
    yield bounded(f"{case}: energy", drift, DRIFT)
    if model.constraint_names:
        open_by = float(np.abs(model.constraints(states, params)).max())
        yield bounded(f"{case}: closure", open_by, CLOSURE)


def _steps_alike(t_end: float) -> Iterator[Row]:
    """Short steps of one length: closure and energy stay where they are."""
    model = model_of("four_bar")
    y0 = model.assemble({"theta_0": np.radians(85)}, params=REGULAR)
    found = measure(model, y0, REGULAR, t_end, RUNS["gauss8, fixed steps"])
    case = f"four-bar, steps of {FIXED:g} s until {t_end:g} s"
    if found["status"] != "finished":
        yield row(case, "flagged", status=found["status"])
        return
    spread = (found["longest"] - found["shortest"]) / FIXED
    yield bounded(f"{case}: alike", spread, ALIKE)
    yield bounded(f"{case}: closure", found["closure"], CLOSURE)
    yield bounded(f"{case}: energy", found["drift"], DRIFT / 10)
