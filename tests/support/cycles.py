"""Systems whose cycles are known: van der Pol's, a driven pendulum, the simplest walker."""

from functools import cache
from math import pi

from sympy import cos, sin, symbols
from sympy.physics.mechanics import dynamicsymbols

import mechc

t = dynamicsymbols._t


def _of_one_coordinate(name, acceleration, defaults):
    q, u = dynamicsymbols("q u")
    equations = mechc.from_equations(
        [q], [u], None, [acceleration(q, u)], name=name, defaults=defaults
    )
    return mechc.compile(equations)


@cache
def van_der_pol():
    """q'' = mu (1 - q^2) q' - q, driven by A cos(Omega t) where A is given."""
    mu, A, Omega = symbols("mu A Omega")
    defaults = {mu: 1.0, A: 0.0, Omega: 1.0}
    return _of_one_coordinate(
        "van_der_pol", lambda q, u: mu * (1 - q**2) * u - q + A * cos(Omega * t), defaults
    )


@cache
def driven_pendulum():
    """Taylor's (Classical Mechanics, 2005, chapter 12): q'' = -2 beta q' - w0^2 (sin q - gamma
    cos(Omega t)) with w0 = 3 pi, beta = w0/4, Omega = 2 pi, all 1/s; without beta and gamma a
    plain one."""
    gamma, Omega, w0, beta = symbols("gamma Omega w0 beta")
    defaults = {gamma: 1.06, Omega: 2 * pi, w0: 3 * pi, beta: 0.75 * pi}
    return _of_one_coordinate(
        "driven_pendulum",
        lambda q, u: -2 * beta * u - w0**2 * (sin(q) - gamma * cos(Omega * t)), defaults,
    )  # fmt: skip


@cache
def walker():
    """The simplest walker (Garcia, Chatterjee, Ruina and Coleman 1998, J. Biomech. Eng. 120): the
    stance leg's angle theta, phi between the legs, on a slope gamma; and its heel strike."""
    theta, phi, w, v = dynamicsymbols("theta phi w v")
    gamma = symbols("gamma")
    falls = sin(theta - gamma)
    swings = falls + w**2 * sin(phi) - cos(theta - gamma) * sin(phi)
    equations = mechc.from_equations(
        [theta, phi], [w, v], None, [falls, swings], kinematics={theta: w, phi: v}, name="walker",
        defaults={gamma: 0.009},
    )  # fmt: skip
    strike = mechc.Event("phi - 2*theta", direction=1, reset={
        "theta": "-theta", "phi": "-2*theta", "w": "cos(2*theta)*w",
        "v": "cos(2*theta)*(1 - cos(2*theta))*w",
    })  # fmt: skip
    return mechc.compile(equations), strike
