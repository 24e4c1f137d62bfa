"""A motion does not depend on the units of length and mass that it is given in.

Lengths and masses in other units are other numbers.  Where the units are apart by powers of
two, whose products are exact, every step and every bit of the states is the same.  Masses are apart
by powers of four: distances are weighted by their roots.
"""

from __future__ import annotations

import re

import numpy as np
import pytest

import mechc

DIMENSIONS = {"m": (1, 0, 0), "kg": (0, 1, 0), "s": (0, 0, 1), "N": (1, 1, -2)}
UNITS = [(10, 0, 0), (-10, 0, 0), (0, 20, 0), (0, -20, 0), (-9, 8, 0)]  # powers of two
METHODS = ("gauss8", "dop853", "dopri5")
FOLDED = {"l_0": 0.5, "l_1": 0.5}  # goes through change points
SCENES = {
    "four-bar": ("four_bar", {}, {"l_3": 3.5}, 5.0),
    "four-bar with change points": ("four_bar", {}, {}, 5.0),
    "slider-crank": ("slider_crank", {}, {}, 3.0),
    "slider-crank with change points": ("slider_crank", {}, FOLDED, 3.0),
    **{
        name: pytest.param(name, options, {}, t_end, marks=pytest.mark.slow)
        for name, options, t_end in (
            ("windows", {}, 2.0), ("bicycle", {}, 3.0), ("car_axis", {}, 2.0),
            ("planar_chain", {"links": 12}, 1.0), ("pendulum", {}, 5.0), ("andrews", {}, 0.02),
        )
    },
}  # fmt: skip


def exponents(unit: str) -> np.ndarray:
    """Of length, mass and time in a unit as ``"kg m^2/s"``; what is none of them is a number."""
    found, (above, _, below) = np.zeros(3), unit.partition("/")
    for text, side in ((above, 1), (below, -1)):
        for name, power in re.findall(r"([a-zA-Z]+)\^?(\d*)", text):
            found += side * int(power or 1) * np.array(DIMENSIONS.get(name, (0, 0, 0)))
    return found


def factor(model: mechc.Model, name: str, unit: tuple[int, ...]) -> float:
    return float(2.0 ** (exponents(model.units[name]) @ unit))


def start(model: mechc.Model, params: dict[str, float]) -> np.ndarray:
    if params is not FOLDED:
        return model.assemble(params=params)
    x, v, l = 0.3, 3.0, 0.5
    return np.array([x, -x, 2 * l * np.cos(x), v, -v, -2 * l * np.sin(x) * v])


@pytest.mark.parametrize(("name", "options", "params", "t_end"), SCENES.values(), ids=SCENES)
def test_a_motion_is_the_same_in_all_units(name, options, params, t_end):
    model = mechc.load(name, **options)
    values = {k: v for k, v in model.defaults.items() if v is not None} | params
    y0, states = start(model, params), (*model.coordinates, *model.speeds)
    for method in METHODS:
        given = model.simulate(t_end, y0, values, rtol=1e-7, method=method, max_steps=3000)
        for unit in UNITS:
            scale = np.array([factor(model, each, unit) for each in states])
            other = {each: value * factor(model, each, unit) for each, value in values.items()}
            sol = model.simulate(t_end, y0 * scale, other, rtol=1e-7, method=method, max_steps=3000)
            told = f"{method}, units {unit}: {given.stats['steps']} steps, {sol.stats['steps']}"
            assert sol.status.code == given.status.code, told
            assert sol.y.shape == given.y.shape, told
            assert (sol.y == given.y * scale).all(), told
