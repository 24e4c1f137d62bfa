"""Parameters and arguments that cannot be, or that hardly can: zero, subnormal, infinite, NaN.

Where a run finishes all the same, its energy, as SymPy has it of the bodies, judges it together
with the closure: a parameter of 5e-324 is a real one.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from mechc_codegen.library.chains.pendulum import pendulum
from mechc_codegen.library.planar.four_bar import four_bar
from mechc_codegen.library.planar.slider_crank import slider_crank
from mechc_codegen.library.spatial.flyball_governor import flyball_governor
from mechc_codegen.library.spatial.heavy_top import heavy_top
from sympy import Symbol, lambdify
from sympy.physics.mechanics import dynamicsymbols, kinetic_energy, potential_energy

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


@dataclass(frozen=True)
class Scene:
    """A mechanism, where it starts, and the work of its constant loads."""

    build: Callable[[], Any]
    coordinates: Values
    work: Any = 0
    speeds: Values | None = None
    damping: str = ""  # the parameter that takes energy away, or gives it where it is negative
    lengths: tuple[str, ...] = ()


def bad_values(quick: bool) -> Iterator[Row]:
    for name in ("four_bar", "pendulum", "slider_crank") if quick else SCENES:
        for parameter in model_of(name).parameters:
            for word in QUICK if quick else VALUES:
                case = f"{name}, {parameter} {word}"
                yield _tried(case, name, {parameter: VALUES[word]})


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


def _tried(case: str, name: str, changed: Values) -> Row:
    model, scene = model_of(name), SCENES[name]
    params = {"l_3": 3.5, **changed} if name == "four_bar" else dict(changed)
    try:
        y0 = model.assemble(scene.coordinates, scene.speeds, params=params)
        sol = model.simulate(1.0, y0, params, rtol=RTOL, max_steps=200_000)
    except REFUSALS as error:
        return row(case, "refused", status=str(error))
    if not sol.status.ok:
        return row(case, "flagged", status=sol.status.code)
    values = dict(zip(model.parameters, map(float, sol.params), strict=True))
    return judged(case, sol, name, values)


def judged(case: str, sol: mechc.Solution, name: str, values: Values) -> Row:
    """A finished run: finite, closed, and with the energy that it began with."""
    if not np.isfinite(sol.y).all():
        return row(case, "WRONG", status="not finite")
    scene = SCENES[name]
    longest = max([values[name] for name in scene.lengths], default=1.0)
    open_by = float(sol.closure.max(initial=0.0)) / longest
    if open_by > CLOSURE:
        return row(case, "WRONG", status=f"open by {open_by:g} of the longest link")
    with np.errstate(all="ignore"):
        kinetic, potential = energy(name, sol.y, values)
        departure = kinetic + potential - (kinetic[0] + potential[0])
        damped = np.sign(values[scene.damping]) if scene.damping else 0.0
        drift = (damped * departure).max() if damped else np.abs(departure).max()
        size = float(kinetic.max() + np.ptp(potential))
    if not np.isfinite(size):
        return row(case, "unjudged", status="energies overflow")
    # Energies that are all subnormal have no digits left to be judged by.
    return bounded(case, float(drift) / size if size > 1e-290 else 0.0, DRIFT)


# -- energies -------------------------------------------------------------------------------------


@cache
def _energies(name: str) -> Callable[..., tuple[Any, Any]]:
    """Of coordinates, speeds and parameters, those of all bodies."""
    scene = SCENES[name]
    mechanism = scene.build()
    kinetic = kinetic_energy(mechanism.frame, *mechanism.bodies).xreplace(mechanism.rates)
    potential = potential_energy(*mechanism.bodies) - scene.work
    parameters = [p.symbol for p in mechanism.parameters]
    arguments = [mechanism.q, mechanism.u, parameters]
    return lambdify(arguments, (kinetic, potential), "numpy")  # type: ignore[no-any-return]


def energy(name: str, states: Array, values: Values) -> tuple[Array, Array]:
    """Kinetic and potential energy (J) of states (n, nq + nu) as SymPy has them of the bodies."""
    q, u = np.split(states.T, 2)
    found = _energies(name)(q, u, [np.float64(x) for x in values.values()])
    kinetic, potential = (np.broadcast_to(each, len(states)) for each in found)
    return kinetic, potential


SCENES: Mapping[str, Scene] = {
    "four_bar": Scene(four_bar, {"theta_0": 1.0}, lengths=("l_0", "l_1", "l_2", "l_3")),
    "pendulum": Scene(lambda: pendulum(1), {"theta_0": 1.0}),
    "slider_crank": Scene(
        slider_crank, {"theta": 0.5}, Symbol("T") * dynamicsymbols("theta"), lengths=("l_0", "l_1")
    ),
    "heavy_top": Scene(heavy_top, {}, speeds={"w_y": 150.0, "w_z": -4.6}),
    "flyball_governor": Scene(
        flyball_governor, {"s": 0.5, "alpha_1": np.pi / 6, "alpha_2": np.pi / 6},
        speeds={"omega": 2 * np.pi}, damping="c",
    ),
}  # fmt: skip


@cache
def model_of(name: str) -> mechc.Model:
    return mechc.load(name) if name == "four_bar" else mechc.compile(SCENES[name].build())
