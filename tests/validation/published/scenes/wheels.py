"""Modelica's rolling wheels by Kane's method, and its masses about a point by Lagrange's."""

from functools import cache

import numpy as np
from sympy import Rational, sqrt, symbols
from sympy.physics.mechanics import (
    KanesMethod,
    LagrangesMethod,
    Particle,
    Point,
    ReferenceFrame,
    RigidBody,
    dynamicsymbols,
    inertia,
)

import mechc

from .loops import Example, G

ELEMENTARY = "Modelica/Mechanics/MultiBody/Examples/Elementary/"
T = dynamicsymbols._t


def _origin():
    ground, origin = ReferenceFrame("N"), Point("O")
    origin.set_vel(ground, 0)
    return ground, origin


@cache
def wheel():
    """One wheel of 0.3 m on z = 0: its centre, and angles about z, y, x that turn it."""
    N, O = _origin()
    x, y, a1, a2, a3 = q = dynamicsymbols("x y a1 a2 a3")
    u = dynamicsymbols("v_x v_y w1 w2 w3")
    radius, mass = Rational(3, 10), 2
    A = ReferenceFrame("A")
    A.orient_body_fixed(N, (a1, a2, a3), "ZYX")
    rates = dict(zip([c.diff(T) for c in q], u, strict=True))
    A.set_ang_vel(N, A.ang_vel_in(N).subs(rates))
    sideways = sqrt(1 - A.y.dot(N.z) ** 2)  # of the axle: 1 where the wheel is upright
    centre = O.locatenew("C", x * N.x + y * N.y + radius * sideways * N.z)
    centre.set_vel(N, centre.pos_from(O).dt(N).subs(rates))
    heading = N.z.cross(A.y) / sideways
    touch = radius * heading.cross(A.y)
    slip = centre.vel(N) + A.ang_vel_in(N).cross(touch)
    disc = inertia(A, Rational(12, 100), Rational(6, 100), Rational(12, 100))
    body = RigidBody("wheel", centre, A, mass, (disc, centre))
    kane = KanesMethod(
        N,
        q_ind=list(q),
        u_ind=list(u[2:]),
        u_dependent=list(u[:2]),
        kd_eqs=[c.diff(T) - speed for c, speed in zip(q, u, strict=True)],
        velocity_constraints=[slip.dot(N.x), slip.dot(N.y)],
    )
    kane.kanes_equations([body], [(centre, -mass * G * N.z)])
    return mechc.compile(kane, outputs=(), configuration_constraints=[])


@cache
def wheel_set():
    """Two wheels on an axle that turns about z, and a small mass 0.2 m ahead of its middle."""
    N, O = _origin()
    x, y, phi, t1, t2 = q = dynamicsymbols("x y phi theta1 theta2")
    u = dynamicsymbols("v_x v_y w w1 w2")
    T1, T2, F_x, F_y = dynamicsymbols("T1 T2 F_x F_y")
    R, half = Rational(1, 10), Rational(1, 4)
    A = N.orientnew("A", "Axis", (phi, N.z))
    A.set_ang_vel(N, u[2] * N.z)
    middle = O.locatenew("M", x * N.x + y * N.y)
    middle.set_vel(N, u[0] * N.x + u[1] * N.y)
    ahead = middle.locatenew("ahead", A.x / 5)
    ahead.v2pt_theory(middle, N, A)
    bodies = [
        RigidBody("load", ahead, A, Rational(1, 100), (inertia(A, *3 * [Rational(1, 1000)]), ahead))
    ]
    loads, slips = [(ahead, F_x * N.x + F_y * N.y)], []
    for k, (side, angle, torque) in enumerate(((half, t1, T1), (-half, t2, T2))):
        W = A.orientnew(f"W{k}", "Axis", (angle, A.y))
        W.set_ang_vel(A, u[3 + k] * A.y)
        hub = middle.locatenew(f"H{k}", side * A.y)
        hub.v2pt_theory(middle, N, A)
        disc = inertia(W, Rational(2, 100), Rational(1, 100), Rational(2, 100))
        bodies.append(RigidBody(f"wheel{k}", hub, W, Rational(1, 2), (disc, hub)))
        loads += [(W, torque * A.y), (A, -torque * A.y)]
        slip = hub.vel(N) + W.ang_vel_in(N).cross(-R * N.z)
        slips.append(slip.dot(A.x))
    slips.append(slip.dot(A.y))
    kane = KanesMethod(
        N,
        q_ind=list(q),
        u_ind=list(u[3:]),
        u_dependent=list(u[:3]),
        kd_eqs=[c.diff(T) - speed for c, speed in zip(q, u, strict=True)],
        velocity_constraints=slips,
    )
    kane.kanes_equations(bodies, loads)
    return mechc.compile(kane, outputs=(), configuration_constraints=[])


@cache
def orbits():
    """Two masses of 1 kg about a point with mu = 1 m³/s², and a spring between them."""
    N, O = _origin()
    c = symbols("c")
    q = dynamicsymbols("x1 y1 z1 x2 y2 z2")
    masses = []
    for k in range(2):
        point = O.locatenew(f"P{k}", sum((q[3 * k + n] * e for n, e in enumerate(N)), 0 * N.x))
        point.set_vel(N, point.pos_from(O).dt(N))
        masses.append(Particle(f"mass{k}", point, 1))
    first, second = (mass.point.pos_from(O) for mass in masses)
    line = second - first
    potential = -1 / first.magnitude() - 1 / second.magnitude() + c * line.dot(line) / 2
    kinetic = sum(mass.kinetic_energy(N) for mass in masses)
    lagrange = LagrangesMethod(kinetic - potential, list(q), frame=N, bodies=masses)
    lagrange.form_lagranges_equations()
    return mechc.compile(lagrange, defaults={c: 0.0}, outputs=())


def _masses(first, second):
    """Names of the recorded signals of two bodies, whose coordinates are those of `orbits`."""
    return {
        f"{body}.{kind}[{n + 1}]": f"{axis}{k + 1}{rate}"
        for k, (body, place) in enumerate((first, second))
        for kind, rate in ((place, ""), ("v_0", "_dot"))
        for n, axis in enumerate("xyz")
    }


def _placed(*places):
    return {f"{axis}{k + 1}": r[n] for k, r in enumerate(places) for n, axis in enumerate("xyz")}


_SET = {
    "wheelSet." + name: here
    for name, here in {
        "der_theta1": "w1", "der_theta2": "w2", "phi": "phi", "theta1": "theta1",
        "theta2": "theta2", "x": "x", "y": "y",
    }.items()
}  # fmt: skip
_SET_START = {"x": 0.1, "y": 0.1, "phi": 0.0, "theta1": 0.0, "theta2": 0.0}
_AT_REST = {"w1": 0.0, "w2": 0.0}
_KNOTS = [0.0, 1.0, 2.0, 3.0]

EXAMPLES = [
    Example(
        ELEMENTARY + "RollingWheel",
        wheel,
        {f"wheel1.angles[{k}]": f"a{k}" for k in (1, 2, 3)}
        | {f"wheel1.der_angles[{k}]": f"w{k}" for k in (1, 2, 3)}
        | {"wheel1.x": "x", "wheel1.y": "y"},
        4.0,
        start={"x": 0.2, "y": 0.2, "a1": 0.0, "a2": 0.0, "a3": 0.0},
        speeds={"w1": 0.0, "w2": 5.0, "w3": 1.0},
    ),
    Example(
        ELEMENTARY + "RollingWheelSetDriving",
        wheel_set,
        _SET,
        3.0,
        start=_SET_START,
        speeds=_AT_REST,
        inputs={
            "T1": lambda t: -2 * np.sin(2 * np.pi * t),
            "T2": lambda t: -2 * np.sin(2 * np.pi * t + 1.5707963267949),
            "F_x": 0.0,
            "F_y": 0.0,
        },
    ),
    Example(
        ELEMENTARY + "RollingWheelSetPulling",
        wheel_set,
        _SET,
        3.0,
        start=_SET_START,
        speeds=_AT_REST,
        inputs={
            "T1": 0.0,
            "T2": 0.0,
            "F_x": mechc.Signal(_KNOTS, [1.0, 1.0, 0.0, 0.0], "linear"),
            "F_y": mechc.Signal(_KNOTS, [0.0, 0.0, 2.0, 2.0], "linear"),
        },
    ),
    Example(
        ELEMENTARY + "PointGravity",
        orbits,
        _masses(("body1", "frame_a.r_0"), ("body2", "frame_a.r_0")),
        5.0,
        {"c": 0.0},
        _placed((0, 0.6, 0), (0.6, 0.6, 0)),
        {"x1_dot": 1.0, "x2_dot": 0.6},
    ),
    Example(
        ELEMENTARY + "PointGravityWithPointMasses",
        orbits,
        _masses(("body3", "r_0"), ("body4", "r_0")),
        2.0,
        {"c": 10.0},
        _placed((0, 0.8, 0), (0.3, 0.8, 0)),
        {"x1_dot": 0.6, "x2_dot": 0.6},
    ),
]
