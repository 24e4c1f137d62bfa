"""The four-bar that is synthesised in tests: one compiled scene for all of them."""

from functools import cache

import numpy as np

import mechc

LENGTHS = ("l_0", "l_1", "l_2", "l_3")
PLACES = ("x_C", "y_C", "x_O", "y_O")


@cache
def four_bar():
    """A four-bar with a coupler point, placed anywhere, whose crank is driven at Omega_0."""
    return mechc.load(
        "four_bar", coupler_point=True, placed=True, crank_speed=True,
        outputs=("points", "sensitivities"),
    )  # fmt: skip


def bounds(longest, *, shortest=0.3):
    """The whole geometry, free."""
    lengths = dict.fromkeys(LENGTHS, (shortest, longest))
    return {**lengths, **dict.fromkeys(PLACES, (-longest, longest)), "alpha": (-np.pi, np.pi)}


def coupler_points(params, crank):
    """The coupler point (n, 2) at crank angles, by complex numbers, and the coupler's angles (n,).

    The assembly with the coupler's joint to the left of the line from the crank's end to the
    rocker's pivot.
    """
    l = [params[name] for name in LENGTHS]
    end = params["x_O"] + 1j * params["y_O"] + l[0] * np.exp(1j * crank)
    pivot = params["x_O"] + 1j * params["y_O"] + l[3] * np.exp(1j * params["alpha"])
    across = pivot - end
    cosine = (l[1] ** 2 + abs(across) ** 2 - l[2] ** 2) / (2 * l[1] * abs(across))
    coupler = np.angle(across) + np.arccos(cosine)
    point = end + (params["x_C"] + 1j * params["y_C"]) * np.exp(1j * coupler)
    return np.column_stack([point.real, point.imag]), coupler
