"""Small scenes without loops, by equations of motion that are written down.

Oscillators, points under central and gravitational forces, and pendulums, some with a diagonal mass
matrix and some with coupled speeds.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from sympy import Matrix, Rational, cos, diag, eye, sin
from sympy.physics.mechanics import dynamicsymbols

import mechc

from ..problems.problem import Array

G = Rational(981, 100)
FIGURE_EIGHT = (  # three bodies: Chenciner & Montgomery (2000), digits by Simo
    *(0.97000436, -0.24308753, -0.97000436, 0.24308753, 0.0, 0.0),
    *(0.466203685, 0.43236573, 0.466203685, 0.43236573, -0.93240737, -0.86473146),
)
STARTS: dict[str, tuple[Sequence[float], float]] = {  # states, and the time that they are followed
    "duffing": ((1.0, 0.0), 30.0),
    "van_der_pol": ((1.0, 0.0), 30.0),
    "henon_heiles": ((0.1, 0.2, 0.3, 0.1), 60.0),
    "kepler": ((0.7, 0.0, 0.0, 1.3), 30.0),
    "three_bodies": (FIGURE_EIGHT, 12.0),
    "spherical_pendulum": ((0.8, 0.0, 0.0, 2.0), 20.0),
    "elastic_pendulum": ((1.2, 1.0, 0.0, 0.0), 20.0),
    "cart_pole": ((0.0, 2.0, 0.1, 0.0), 10.0),
}


def mechanism(name: str) -> Any:
    """The equations M u' = F of a scene; q' is u."""
    count = len(STARTS[name][0]) // 2
    q, u = dynamicsymbols(f"q0:{count}"), dynamicsymbols(f"u0:{count}")
    mass, forcing = EQUATIONS[name](q, u)
    return mechc.from_equations(list(q), list(u), mass, list(forcing), name=name)


def start(name: str) -> Array:
    return np.array(STARTS[name][0])


def _duffing(q: Any, u: Any) -> Any:
    return eye(1), [q[0] - q[0] ** 3 - u[0] / 10 + 3 * cos(6 * dynamicsymbols._t / 5) / 10]


def _van_der_pol(q: Any, u: Any) -> Any:
    return eye(1), [(1 - q[0] ** 2) * u[0] - q[0]]


def _henon_heiles(q: Any, u: Any) -> Any:
    x, y = q
    return eye(2), [-x - 2 * x * y, -y - x**2 + y**2]


def _kepler(q: Any, u: Any) -> Any:
    cube = (q[0] ** 2 + q[1] ** 2) ** Rational(3, 2)
    return eye(2), [-x / cube for x in q]


def _three_bodies(q: Any, u: Any) -> Any:
    places = [Matrix(q[k : k + 2]) for k in (0, 2, 4)]
    forces = []
    for one in places:
        ways = [other - one for other in places if other != one]
        forces += sum((way / way.dot(way) ** Rational(3, 2) for way in ways), Matrix([0, 0]))
    return eye(6), forces


def _spherical_pendulum(q: Any, u: Any) -> Any:
    s, c = sin(q[0]), cos(q[0])
    return diag(1, s**2), [u[1] ** 2 * s * c - G * s, -2 * u[0] * u[1] * s * c]


def _elastic_pendulum(q: Any, u: Any) -> Any:
    r, angle = q
    radial = r * u[1] ** 2 + G * cos(angle) - 40 * (r - 1)
    return diag(1, r**2), [radial, -G * r * sin(angle) - 2 * r * u[0] * u[1]]


def _cart_pole(q: Any, u: Any) -> Any:
    cart, pole, length = 1, Rational(3, 10), Rational(4, 5)
    coupling = pole * length * cos(q[1])
    mass = Matrix([[cart + pole, coupling], [coupling, pole * length**2]])
    return mass, [pole * length * u[1] ** 2 * sin(q[1]), -pole * G * length * sin(q[1])]


EQUATIONS = {
    "duffing": _duffing, "van_der_pol": _van_der_pol, "henon_heiles": _henon_heiles,
    "kepler": _kepler, "three_bodies": _three_bodies, "spherical_pendulum": _spherical_pendulum,
    "elastic_pendulum": _elastic_pendulum, "cart_pole": _cart_pole,
}  # fmt: skip
