"""Chains of point masses on massless links, from rest with every link level."""

from __future__ import annotations

from functools import partial

import numpy as np
from mechc_codegen.library.chains.pendulum import pendulum

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
