"""A free rigid body, problem B5 of DETEST: Euler's equations, with the body's attitude.

Of a body with the moments of inertia A < B, C < B the angular velocities are c_k y_k, where the
c_k scale Euler's equations to y_1' = y_2 y_3, y_2' = -y_1 y_3, y_3' = -0.51 y_1 y_2.  The
attitude is a quaternion, so there are four coordinates to three speeds.
"""

from __future__ import annotations

from sympy import Rational, sqrt, symbols
from sympy.physics.mechanics import ReferenceFrame, RigidBody, dynamicsymbols, inertia

from mechc_codegen.description.mechanism import Drawing, Mechanism
from mechc_codegen.library.parts import coordinates, fixed_point, locate, parameter, speeds

MODULUS = Rational(51, 100)


def rigid_body() -> Mechanism:
    """The body about its axis of least inertia, which tumbles; speeds y_k as in problem B5."""
    e = dynamicsymbols("e_0:4")
    y = dynamicsymbols("y_1:4")
    A, B, C, d = symbols("A B C d")
    r = ReferenceFrame("r")
    origin = fixed_point("O", r)

    # Euler: A w_1' = (B - C) w_2 w_3, B w_2' = (C - A) w_3 w_1, C w_3' = (A - B) w_1 w_2.
    alpha, beta, gamma = (B - C) / A, (A - C) / B, (B - A) / C
    w_1 = sqrt(MODULUS / (beta * gamma)) * y[0]
    w_2 = sqrt(MODULUS / (alpha * gamma)) * y[1]
    w_3 = sqrt(1 / (alpha * beta)) * y[2]

    body = r.orientnew("body", "Quaternion", e)
    body.set_ang_vel(r, w_1 * body.x + w_2 * body.y + w_3 * body.z)
    kinematics = (
        (-e[1] * w_1 - e[2] * w_2 - e[3] * w_3) / 2,
        (e[0] * w_1 - e[3] * w_2 + e[2] * w_3) / 2,
        (e[3] * w_1 + e[0] * w_2 - e[1] * w_3) / 2,
        (-e[2] * w_1 + e[1] * w_2 + e[0] * w_3) / 2,
    )
    moments = inertia(body, A, B, C)
    mark = locate("mark", origin, d * body.x, body, r)
    return Mechanism(
        name="rigid_body",
        title="Free rigid body",
        frame=r,
        origin=origin,
        coordinates=coordinates(e, "1", *[f"quaternion component {k}" for k in range(4)]),
        speeds=speeds(y, "rad/s", *[f"scaled angular velocity {k}" for k in (1, 2, 3)]),
        kinematics=kinematics,
        parameters=(
            parameter(A, 2.0, "kg m^2", "moment of inertia about x", positive=True),
            parameter(B, 3.0, "kg m^2", "moment of inertia about y, the largest", positive=True),
            parameter(C, 1.0, "kg m^2", "moment of inertia about z", positive=True),
            parameter(d, 1.0, "m", "distance of a mark along the body's x", positive=True),
        ),
        bodies=(RigidBody("body", origin, body, 1, (moments, origin)),),
        points=(origin, mark),
        drawing=Drawing(links=(("body", ("O", "mark")),), traced=("mark",)),
        start={"e_0": 1.0, "y_2": 1.0, "y_3": 1.0},
    )
