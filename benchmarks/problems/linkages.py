"""Andrews' squeezing mechanism and the slider-crank."""

from __future__ import annotations

import numpy as np
from mechc_codegen.library.planar.andrews import ANGLES, andrews
from mechc_codegen.library.planar.slider_crank import slider_crank

from .data import values_at
from .problem import Problem


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
