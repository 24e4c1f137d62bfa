"""The start and the closed form of the row of four-bar windows, problem A02."""

from __future__ import annotations

import mpmath
import numpy as np

from .problem import Array


def upright_start(count: int, *, angle: float = np.pi / 2, rate: float = -1.0) -> Array:
    """The state in which all uprights stand at an angle (rad) and turn at a rate (rad/s).

    By default that of problem A02, vertical, the first upright's end moving at +1 m/s along x.
    """
    size = 2 * count + 1
    y = np.zeros(2 * size)
    # The first coupler lies along the ground; uprights point down from the couplers.
    y[0], y[1], y[2:size:2] = angle, -angle, angle - np.pi
    y[size], y[size + 1], y[size + 2 :: 2] = rate, -rate, rate
    return y


def first_upright(count: int, times: Array, g: float = 9.81) -> Array:
    """The first upright's end (m, on the ground's axes) in problem A02, at each time."""
    return np.stack([first_upright_motion(count, time, g)[:2] for time in times])


def first_upright_motion(count: int, time: float, g: float = 9.81) -> Array:
    """Place (m) and velocity (m/s) of the first upright's end in problem A02, from 40 digits."""
    with mpmath.workdps(40):
        half, third = (mpmath.mpf(count + 1) / k + count for k in (2, 3))
        a = mpmath.mpf(g) * half / third
        omega = mpmath.sqrt(1 + 4 * a) / 2
        m = a / omega**2
        sn, cn, dn = (
            mpmath.ellipfun(name, mpmath.ellipk(m) + omega * time, m=m)
            for name in ("sn", "cn", "dn")
        )
        place = [-2 * sn * cn, sn**2 - cn**2]
        velocity = [-2 * (cn**2 - sn**2) * dn * omega, 4 * sn * cn * dn * omega]
        return np.array([float(x) for x in (*place, *velocity)])
