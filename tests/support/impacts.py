"""Particles on a line that hit what stands there, and the times of a bouncing ball."""

import numpy as np
from sympy import Symbol
from sympy.physics.mechanics import KanesMethod, Particle, Point, ReferenceFrame, dynamicsymbols

import mechc

G = 9.81


def points_on_a_line(name, count, force, **options):
    """Particles that move along a line, each under the force(q, u, m) on it."""
    frame, origin = ReferenceFrame("N"), Point("O")
    origin.set_vel(frame, 0)
    q = dynamicsymbols(f"q_:{count}")
    u = dynamicsymbols(f"u_:{count}")
    m = Symbol("m")
    bodies, loads = [], []
    for k in range(count):
        point = origin.locatenew(f"P_{k}", q[k] * frame.x)
        point.set_vel(frame, u[k] * frame.x)
        bodies.append(Particle(f"body_{k}", point, m))
        loads.append((point, force(q[k], u[k], m) * frame.x))
    t = dynamicsymbols._t
    kane = KanesMethod(frame, q, u, kd_eqs=[a.diff(t) - b for a, b in zip(q, u, strict=True)])
    kane.kanes_equations(bodies, loads)
    return mechc.compile(kane, name=name, defaults={"m": 1.0}, **options)


def impacts(restitution, count, height=1.0):
    """Times of the impacts of a ball that falls from rest."""
    fall = np.sqrt(2 * height / G)
    flights = 2 * fall * restitution ** np.arange(1, count)
    return fall + np.concatenate([[0.0], np.cumsum(flights)])
