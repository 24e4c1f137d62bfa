"""Bodies that hit what stands there, and the times of a bouncing ball."""

import numpy as np
from sympy import Symbol, cos, sin, symbols
from sympy.physics.mechanics import (
    KanesMethod,
    Particle,
    Point,
    ReferenceFrame,
    RigidBody,
    dynamicsymbols,
    inertia,
)

import mechc

G = 9.81
TIP_GAP, TIP_SLIP = "y - l*sin(theta)", "v_x + l*sin(theta)*omega"


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


def block():
    """A particle of 2 kg at x along and y above a slope a."""
    x, y, v_x, v_y = dynamicsymbols("x y v_x v_y")
    m, g, a = symbols("m g a")
    frame, origin = ReferenceFrame("N"), Point("O")
    origin.set_vel(frame, 0)
    point = origin.locatenew("P", x * frame.x + y * frame.y)
    point.set_vel(frame, v_x * frame.x + v_y * frame.y)
    weight = -m * g * (sin(a) * frame.x + cos(a) * frame.y)
    t = dynamicsymbols._t
    kane = KanesMethod(frame, [x, y], [v_x, v_y], kd_eqs=[x.diff(t) - v_x, y.diff(t) - v_y])
    kane.kanes_equations([Particle("block", point, m)], [(point, weight)])
    return mechc.compile(kane, name="block", defaults={"m": 2.0, "g": 9.81, "a": 0.3})


def rod():
    """A thin rod of the half length l, whose tip at -l along it touches a floor."""
    x, y, theta, v_x, v_y, omega = dynamicsymbols("x y theta v_x v_y omega")
    m, g, l = Symbol("m"), Symbol("g"), Symbol("l")
    frame, origin = ReferenceFrame("N"), Point("O")
    origin.set_vel(frame, 0)
    turned = frame.orientnew("B", "Axis", [theta, frame.z])
    turned.set_ang_vel(frame, omega * frame.z)
    centre = origin.locatenew("C", x * frame.x + y * frame.y)
    centre.set_vel(frame, v_x * frame.x + v_y * frame.y)
    body = RigidBody("rod", centre, turned, m, (inertia(turned, 0, 0, m * l**2 / 3), centre))
    t = dynamicsymbols._t
    rates = [x.diff(t) - v_x, y.diff(t) - v_y, theta.diff(t) - omega]
    kane = KanesMethod(frame, [x, y, theta], [v_x, v_y, omega], kd_eqs=rates)
    kane.kanes_equations([body], [(centre, -m * g * frame.y)])
    return mechc.compile(kane, name="rod", defaults={"m": 1.0, "g": 9.81, "l": 1.0})
