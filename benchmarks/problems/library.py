"""Problems of the library's mechanisms: chains of point masses, linkages, the top, the governor."""

from __future__ import annotations

from functools import partial

import numpy as np
from mechc_codegen.library.chains.pendulum import pendulum
from mechc_codegen.library.planar.andrews import ANGLES, andrews
from mechc_codegen.library.planar.slider_crank import slider_crank
from mechc_codegen.library.spatial.flyball_governor import flyball_governor
from mechc_codegen.library.spatial.heavy_top import heavy_top

from .data import values_at
from .problem import Array, Problem

ENDS = {1: 10.0, 2: 10.0, 5: 5.0, 10: 4.0}
NOTES = {
    1: "problem A01 of the IFToMM library: closed form in Jacobi functions",
    2: "errors of the start grow 54 times",
    5: "errors of the start grow 30 times",
    10: "errors of the start grow 20 times",
}


def chain(count: int) -> Problem:
    """A chain of several links, compared in all angles and rates."""
    names = tuple(f"{x}_{k}" for x in ("theta", "omega") for k in range(count))
    y = np.zeros(2 * count)
    y[:count] = np.pi / 2
    return Problem(
        name=f"pendulum_{count}", title=f"{'Double' if count == 2 else f'{count}-fold'} pendulum",
        mechanism=partial(pendulum, count), start=y, t_end=ENDS[count], quantities=names,
        exact=values_at(f"pendulum_{count}", ENDS[count], names), note=NOTES[count],
    )  # fmt: skip


def simple() -> Problem:
    """A single link from the left, compared in place and velocity of its end."""
    names = ("x", "y", "vx", "vy")
    return Problem(
        name="pendulum_1", title="Simple pendulum", mechanism=partial(pendulum, 1),
        start=np.array([-np.pi / 2, 0.0]), t_end=ENDS[1], quantities=names,
        exact=values_at("pendulum_1", ENDS[1], names), observe=end_of_the_link, note=NOTES[1],
    )  # fmt: skip


def end_of_the_link(y: Array) -> Array:
    """Place (m) and velocity (m/s) of the bob, y upwards."""
    (theta, omega), c, s = y, np.cos(y[0]), np.sin(y[0])
    return np.array([np.sin(theta), -np.cos(theta), c * omega, s * omega])


def squeezing_mechanism() -> Problem:
    """Seven bodies in three loops for 0.03 s; rates are counted in 1000 rad/s."""
    rates = tuple(f"{name}_dot" for name in ANGLES)
    start = np.zeros(14)
    start[:7] = values_at("andrews", 0.0, ANGLES)
    return Problem(
        name="andrews", title="Andrews' squeezing mechanism", mechanism=andrews, start=start,
        t_end=0.03, quantities=(*ANGLES, *rates),
        exact=values_at("andrews", 0.03, (*ANGLES, *rates)), scale=np.array([1.0] * 7 + [1e3] * 7),
        note="Test Set for IVP Solvers; rates in 1000 rad/s",
    )  # fmt: skip


def crank_and_slider() -> Problem:
    """From rest and stretched, driven by a torque, 2 s: three and a half turns."""
    return Problem(
        name="slider_crank", title="Slider-crank", mechanism=slider_crank,
        start=np.array([0.0, 0.0, 1.5, 0.0, 0.0, 0.0]), t_end=2.0,
        quantities=("theta", "omega", "x"),
        exact=values_at("slider_crank", 2.0, ("theta", "omega", "x")),
        observe=lambda y: y[[0, 3, 2]],
        note="starts where the slider cannot be the independent coordinate",
    )  # fmt: skip


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
