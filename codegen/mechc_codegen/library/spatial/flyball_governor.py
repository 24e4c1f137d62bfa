"""Flyball governor, problem A05 of the IFToMM benchmark library: two rods on a spinning shaft.

The rods hang outwards from the shaft's top; a spring and damper from each rod's middle carries
the slider.  Every rod has its angle: that both move equally is a result.
"""

from __future__ import annotations

from math import pi

from sympy import Expr, Symbol, sqrt
from sympy.physics.mechanics import (
    Particle,
    Point,
    ReferenceFrame,
    RigidBody,
    dot,
    dynamicsymbols,
    inertia,
)

from mechc_codegen.description.mechanism import Drawing, Load, Mechanism, Parameter
from mechc_codegen.library.parts import (
    coordinates,
    fixed_point,
    locate,
    parameter,
    speeds,
    spring,
    turn_frame,
    weight,
)

l, a, b, h = Symbol("l"), Symbol("a"), Symbol("b"), Symbol("h")
m, m_s, m_b = Symbol("m"), Symbol("m_s"), Symbol("m_b")
k, c, l_0, g = Symbol("k"), Symbol("c"), Symbol("l_0"), Symbol("g")


def flyball_governor() -> Mechanism:
    psi, s, *alpha = q = dynamicsymbols("psi s alpha_1 alpha_2")
    omega, v, *nu = u = dynamicsymbols("omega v nu_1 nu_2")
    r = ReferenceFrame("r")
    origin = fixed_point("O", r)
    shaft = turn_frame("shaft", r, psi, omega, r.z)

    # The shaft and the slider on it, which turns with the shaft.
    middle = locate("middle", origin, l / 2 * shaft.z, shaft, r)
    top = locate("top", origin, l * shaft.z, shaft, r)
    slider = origin.locatenew("slider", s * shaft.z)
    slider.set_vel(r, v * shaft.z)
    bodies = [
        _body("shaft", middle, shaft, m, _prism(shaft, 2)),
        _body("slider", slider, shaft, m_s, inertia(shaft, *[m_s * h**2 / 6] * 3)),
    ]

    # A rod to either side, turned downwards, with its mass, spring and damper.
    loads: list[Load] = []
    points = [origin, top, slider]
    for side, sign in ((1, 1), (2, -1)):
        angle, rate = sign * alpha[side - 1], sign * nu[side - 1]
        rod = turn_frame(f"rod_{side}", shaft, angle, rate, shaft.y)
        hinge = locate(f"hinge_{side}", top, sign * b * shaft.x, shaft, r)
        centre = locate(f"centre_{side}", hinge, sign * l / 2 * rod.x, rod, r)
        ball = locate(f"ball_{side}", hinge, sign * l * rod.x, rod, r)
        bodies.append(_body(f"rod_{side}", centre, rod, m, _prism(rod, 0)))
        bodies.append(Particle(f"ball_{side}", ball, m_b))
        seat = locate(f"seat_{side}", slider, sign * b * shaft.x, shaft, r)
        arm = centre.pos_from(seat)
        stretching = dot(arm, centre.vel(r) - seat.vel(r)) / sqrt(dot(arm, arm))
        loads += spring(centre, seat, k, l_0, bodies[-2], c * stretching)
        points += [hinge, centre, ball, seat]
    loads += [weight(body, origin, g, r.z) for body in bodies]

    return Mechanism(
        name="flyball_governor",
        title="Flyball governor",
        frame=r,
        origin=origin,
        coordinates=(
            *coordinates(q[:1], "rad", "angle of the shaft"),
            *coordinates(q[1:2], "m", "height of the slider"),
            *coordinates(q[2:], "rad", "rod 1 below the horizontal", "rod 2 below the horizontal"),
        ),
        speeds=(
            *speeds(u[:1], "rad/s", "rate of the shaft"),
            *speeds(u[1:2], "m/s", "velocity of the slider"),
            *speeds(u[2:], "rad/s", "rate of rod 1", "rate of rod 2"),
        ),
        kinematics=tuple(u),
        parameters=_parameters(),
        bodies=tuple(bodies),
        loads=tuple(loads),
        points=tuple(points),
        drawing=Drawing(
            links=(
                ("shaft", ("O", "top")),
                *((f"rod {i}", ("top", f"hinge_{i}", f"ball_{i}")) for i in (1, 2)),
                *((f"spring {i}", (f"centre_{i}", f"seat_{i}", "slider")) for i in (1, 2)),
            ),
            ground=("O",),
            traced=("ball_1", "ball_2"),
            view=("x", "z"),
        ),
        start={"s": 0.5, "alpha_1": pi / 6, "alpha_2": pi / 6, "omega": 2 * pi},
    )


def _body(name: str, centre: Point, frame: ReferenceFrame, mass: Expr, about: Expr) -> RigidBody:
    return RigidBody(name, centre, frame, mass, (about, centre))


def _prism(frame: ReferenceFrame, axis: int) -> Expr:
    """Central inertia of the rod l x a x a that lies along one axis of its frame."""
    moments = [m * (l**2 + a**2) / 12] * 3
    moments[axis] = m * a**2 / 6
    return inertia(frame, *moments)


def _parameters() -> tuple[Parameter, ...]:
    return (
        parameter(l, 1.0, "m", "length of the shaft and of the rods", positive=True),
        parameter(a, 0.01, "m", "width of the shaft and of the rods", positive=True),
        parameter(b, 0.05, "m", "distance of the hinges from the shaft's axis", positive=True),
        parameter(h, 0.1, "m", "edge of the slider", positive=True),
        parameter(m, 0.3, "kg", "mass of the shaft and of each rod", positive=True),
        parameter(m_s, 3.0, "kg", "mass of the slider", positive=True),
        parameter(m_b, 5.0, "kg", "mass at each rod's end", positive=True),
        parameter(k, 8e5, "N/m", "stiffness", positive=True),
        parameter(c, 4e4, "N s/m", "damping"),
        parameter(l_0, 0.5, "m", "rest length of the springs", positive=True),
        parameter(g, 9.81, "m/s^2", "acceleration of free fall, along -z"),
    )
