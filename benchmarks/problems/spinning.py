"""The heavy top and the flyball governor."""

from __future__ import annotations

import numpy as np
from mechc_codegen.library.spatial.flyball_governor import flyball_governor
from mechc_codegen.library.spatial.heavy_top import heavy_top

from .data import values_at
from .problem import Array, Problem


def top() -> Problem:
    """One second at 150 rad/s, the top's axis level at first."""
    names = ("w_x", "w_y", "w_z", "x", "y", "z")
    return Problem(
        name="heavy_top", title="Heavy top", mechanism=heavy_top,
        start=np.array([0.0, 0.0, 0.0, 0.0, 150.0, -4.61538]), t_end=1.0, quantities=names,
        exact=values_at("heavy_top", 1.0, names), observe=spin_and_centre,
        note="24 turns about its axis; speeds are body rates, not rates of the angles",
    )  # fmt: skip


def spin_and_centre(y: Array) -> Array:
    """Body rates (rad/s) and mass centre (m) from precession, nutation, spin and body rates."""
    psi, theta = y[:2]
    c = np.cos(theta)
    return np.array([*y[3:], -np.sin(psi) * c, np.cos(psi) * c, np.sin(theta)])


def governor() -> Problem:
    """One second; the springs make it stiff, with eigenvalues to -8100 1/s."""
    columns = ("psi", "s", "alpha", "alpha", "omega", "s_dot", "alpha_dot", "alpha_dot")
    return Problem(
        name="flyball_governor", title="Flyball governor (stiff)", mechanism=flyball_governor,
        start=np.array([0.0, 0.5, np.pi / 6, np.pi / 6, 2 * np.pi, 0.0, 0.0, 0.0]), t_end=1.0,
        quantities=("psi", "s", "alpha_1", "alpha_2", "omega", "v", "nu_1", "nu_2"),
        exact=values_at("flyball_governor", 1.0, columns), stiff=True,
        note="problem A05 of the IFToMM library: eigenvalues from -2200 to -8100 1/s",
    )  # fmt: skip
