"""Parameters and arguments that cannot be, or that hardly can: zero, subnormal, infinite, NaN.

Where a run finishes all the same, its energy, written by hand here, judges it together with the
closure: a parameter of 5e-324 is a real one.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from mechc_codegen.library.chains.pendulum import pendulum
from mechc_codegen.library.planar.slider_crank import slider_crank
from mechc_codegen.library.spatial.flyball_governor import flyball_governor
from mechc_codegen.library.spatial.heavy_top import heavy_top

import mechc

from ..timing.cases import Array
from .judge import REFUSALS, Row, bounded, row

VALUES = {
    "zero": 0.0, "-0": -0.0, "subnormal": 5e-324, "tiny": 1e-300, "huge": 1e300,
    "infinite": np.inf, "NaN": np.nan, "negative": -1.0,
}  # fmt: skip
QUICK = ("zero", "subnormal", "infinite", "NaN", "negative")
RTOL = 1e-9
DRIFT = 1e-6  # of the largest kinetic energy in a second: a thousand tolerances
CLOSURE = 1e-12  # of the longest link
Values = Mapping[str, float]
Energy = Callable[[Array, Array, Values], tuple[Array, Array]]


@dataclass(frozen=True)
class Scene:
    """A mechanism, where it starts, and kinetic and potential energy (J) of states (n, nq + nu)."""

    build: Callable[[], Any]
    coordinates: Values
    energy: Energy
    speeds: Values | None = None
    damping: str = ""  # the parameter that takes energy away, or gives it where it is negative
    lengths: tuple[str, ...] = ()


def bad_values(quick: bool) -> Iterator[Row]:
    for name in ("four_bar", "pendulum", "slider_crank") if quick else SCENES:
        model, scene = model_of(name), SCENES[name]
        for parameter in model.parameters:
            for word in QUICK if quick else VALUES:
                case = f"{name}, {parameter} {word}"
                yield _tried(case, model, scene, {parameter: VALUES[word]})


def bad_arguments(quick: bool) -> Iterator[Row]:
    """Starts, spans and tolerances that cannot be: every one is refused before the run."""
    model, scene = model_of("four_bar"), SCENES["four_bar"]
    y0 = model.assemble(scene.coordinates, params={"l_3": 3.5})
    for word in ("infinite", "NaN"):
        for place in range(6):
            bad = y0.copy()
            bad[place] = VALUES[word]
            yield _refused(f"y0[{place}] {word}", model, 1.0, bad)
        yield _refused(f"t_end {word}", model, VALUES[word], y0)
        yield _refused(f"t_0 {word}", model, (VALUES[word], 1.0), y0)
    for name in ("rtol", "atol", "max_step", "first_step", "max_steps"):
        for word in ("zero", "NaN", "negative"):
            yield _refused(f"{name} {word}", model, 1.0, y0, **{name: VALUES[word]})


def _refused(case: str, model: mechc.Model, span: Any, y0: Array, **policy: Any) -> Row:
    try:
        sol = model.simulate(span, y0, {"l_3": 3.5}, **policy)
    except REFUSALS as error:
        return row(case, "refused", status=str(error))
    return row(case, "flagged" if not sol.status.ok else "WRONG", status=str(sol.status))


def _tried(case: str, model: mechc.Model, scene: Scene, changed: Values) -> Row:
    params = {"l_3": 3.5, **changed} if model.name == "four_bar" else dict(changed)
    try:
        y0 = model.assemble(scene.coordinates, scene.speeds, params=params)
        sol = model.simulate(1.0, y0, params, rtol=RTOL, max_steps=200_000)
    except REFUSALS as error:
        return row(case, "refused", status=str(error))
    if not sol.status.ok:
        return row(case, "flagged", status=sol.status.code)
    values = dict(zip(model.parameters, map(float, sol.params), strict=True))
    return judged(case, sol, scene, values)


def judged(case: str, sol: mechc.Solution, scene: Scene, values: Values) -> Row:
    """A finished run: finite, closed, and with the energy that it began with."""
    if not np.isfinite(sol.y).all():
        return row(case, "WRONG", status="not finite")
    longest = max([values[name] for name in scene.lengths], default=1.0)
    open_by = float(sol.closure.max(initial=0.0)) / longest
    if open_by > CLOSURE:
        return row(case, "WRONG", status=f"open by {open_by:g} of the longest link")
    with np.errstate(all="ignore"):
        kinetic, potential = scene.energy(sol.q, sol.u, values)
        departure = kinetic + potential - (kinetic[0] + potential[0])
        damped = np.sign(values[scene.damping]) if scene.damping else 0.0
        drift = (damped * departure).max() if damped else np.abs(departure).max()
        size = float(kinetic.max() + np.ptp(potential))
    if not np.isfinite(size):
        return row(case, "unjudged", status="energies overflow")
    # Energies that are all subnormal have no digits left to be judged by.
    return bounded(case, float(drift) / size if size > 1e-290 else 0.0, DRIFT)


# -- energies by hand -----------------------------------------------------------------------------


def _four_bar(q: Array, u: Array, p: Values) -> tuple[Array, Array]:
    return _rods(q, u, p, range(3), lambda k: p[f"I_{k}"], p["g"])


def _rods(q, u, p, links, inertia, g):  # type: ignore[no-untyped-def]
    """Rods end to end, each at its own angle from x; mass centres in their middles."""
    end = np.zeros((len(q), 2))
    kinetic, potential, height = np.zeros(len(q)), np.zeros(len(q)), np.zeros(len(q))
    for k in links:
        across = p[f"l_{k}"] * np.stack([-np.sin(q[:, k]), np.cos(q[:, k])], axis=1)
        velocity = end + across * u[:, k, None] / 2
        kinetic += p[f"m_{k}"] / 2 * (velocity**2).sum(axis=1) + inertia(k) / 2 * u[:, k] ** 2
        potential += p[f"m_{k}"] * g * (height + p[f"l_{k}"] / 2 * np.sin(q[:, k]))
        end = end + across * u[:, k, None]
        height = height + p[f"l_{k}"] * np.sin(q[:, k])
    return kinetic, potential


def _pendulum(q: Array, u: Array, p: Values) -> tuple[Array, Array]:
    l, m, g = p["l_0"], p["m_0"], p["g"]
    return m / 2 * (l * u[:, 0]) ** 2, -m * g * l * np.cos(q[:, 0])


def _slider_crank(q: Array, u: Array, p: Values) -> tuple[Array, Array]:
    def inertia(k: int) -> float:
        return p[f"m_{k}"] * p[f"l_{k}"] ** 2 / 12

    kinetic, _ = _rods(q, u, p, range(2), inertia, 0.0)
    return kinetic + p["m_2"] / 2 * u[:, 2] ** 2, -p["T"] * q[:, 0]


def _heavy_top(q: Array, u: Array, p: Values) -> tuple[Array, Array]:
    """The body's y, along which the mass centre lies, rises by sin(theta)."""
    m, d = p["m"], p["d"]
    across = p["I_t"] + m * d**2
    kinetic = (across * (u[:, 0] ** 2 + u[:, 2] ** 2) + p["I_s"] * u[:, 1] ** 2) / 2
    return kinetic, m * p["g"] * d * np.sin(q[:, 1])


def _governor(q: Array, u: Array, p: Values) -> tuple[Array, Array]:
    """Points of a rod by its angle below the horizontal, in the turning plane."""
    (_, s, *alpha), (omega, v, *nu) = q.T, u.T
    l, a, b, h, m, m_b = (p[x] for x in ("l", "a", "b", "h", "m", "m_b"))
    square, along = m * (l**2 + a**2) / 12, m * a**2 / 6
    kinetic = along / 2 * omega**2 + p["m_s"] / 2 * (v**2 + h**2 / 6 * omega**2)
    potential = p["m_s"] * p["g"] * s
    for x, rate in zip(alpha, nu, strict=True):
        for mass, arm in ((m, l / 2), (m_b, l)):
            out, down = b + arm * np.cos(x), l - arm * np.sin(x)
            kinetic = kinetic + mass / 2 * ((arm * rate) ** 2 + (out * omega) ** 2)
            potential = potential + mass * p["g"] * down
        turned = along * (omega * np.sin(x)) ** 2 + square * ((omega * np.cos(x)) ** 2 + rate**2)
        kinetic = kinetic + turned / 2
        stretched = np.hypot(l / 2 * np.cos(x), l - l / 2 * np.sin(x) - s) - p["l_0"]
        potential = potential + p["k"] / 2 * stretched**2
    return kinetic, potential


SCENES: Mapping[str, Scene] = {
    "four_bar": Scene(
        lambda: None, {"theta_0": 1.0}, _four_bar, lengths=("l_0", "l_1", "l_2", "l_3")
    ),
    "pendulum": Scene(lambda: pendulum(1), {"theta_0": 1.0}, _pendulum),
    "slider_crank": Scene(slider_crank, {"theta": 0.5}, _slider_crank, lengths=("l_0", "l_1")),
    "heavy_top": Scene(heavy_top, {}, _heavy_top, {"w_y": 150.0, "w_z": -4.6}),
    "flyball_governor": Scene(
        flyball_governor, {"s": 0.5, "alpha_1": np.pi / 6, "alpha_2": np.pi / 6}, _governor,
        {"omega": 2 * np.pi}, damping="c",
    ),
}  # fmt: skip


@cache
def model_of(name: str) -> mechc.Model:
    return mechc.load(name) if name == "four_bar" else mechc.compile(SCENES[name].build())
