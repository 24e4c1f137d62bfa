"""A heavy top: a rigid body about one fixed point, its mass centre off it along the body's y.

Orientation by three angles: precession about the vertical, nutation about the turned x axis,
spin about the body's y; regular while the mass centre is not straight above or below.  The
speeds are the body's angular velocity in its own axes, not rates of the angles.
"""

from __future__ import annotations

from sympy import cos, sin, symbols
from sympy.physics.mechanics import ReferenceFrame, RigidBody, dynamicsymbols, inertia

from mechc_codegen.description.mechanism import Drawing, Mechanism
from mechc_codegen.library.parts import coordinates, fixed_point, locate, parameter, speeds, weight


def heavy_top() -> Mechanism:
    """The top, which starts level with 150 rad/s of spin: it precesses and nods without loss."""
    psi, theta, phi = q = dynamicsymbols("psi theta phi")
    w_x, w_y, w_z = u = dynamicsymbols("w_x w_y w_z")
    m, d, I_s, I_t, g = symbols("m d I_s I_t g")
    r = ReferenceFrame("r")
    origin = fixed_point("O", r)
    turned = r.orientnew("turned", "Axis", (psi, r.z))
    tilted = turned.orientnew("tilted", "Axis", (theta, turned.x))
    body = tilted.orientnew("body", "Axis", (phi, tilted.y))
    body.set_ang_vel(r, w_x * body.x + w_y * body.y + w_z * body.z)

    # In the tilted axes the angular velocity is (theta', phi' + psi' sin theta, psi' cos theta).
    across, up = w_x * cos(phi) + w_z * sin(phi), w_z * cos(phi) - w_x * sin(phi)
    precession = up / cos(theta)
    kinematics = (precession, across, w_y - precession * sin(theta))

    centre = locate("g", origin, d * body.y, body, r)
    top = RigidBody("top", centre, body, m, (inertia(body, I_t, I_s, I_t), centre))
    return Mechanism(
        name="heavy_top",
        title="Heavy top",
        frame=r,
        origin=origin,
        coordinates=coordinates(q, "rad", "precession", "nutation", "spin"),
        speeds=speeds(u, "rad/s", *[f"angular velocity along the body's {x}" for x in "xyz"]),
        kinematics=kinematics,
        parameters=(
            parameter(m, 15.0, "kg", "mass", positive=True),
            parameter(d, 1.0, "m", "distance of the mass centre", positive=True),
            parameter(I_s, 0.46875, "kg m^2", "moment of inertia of the spin", positive=True),
            parameter(I_t, 0.234375, "kg m^2", "transverse moment of inertia", positive=True),
            parameter(g, 9.81, "m/s^2", "acceleration of free fall, along -z"),
        ),
        bodies=(top,),
        loads=(weight(top, origin, g, r.z),),
        points=(origin, centre),
        drawing=Drawing(
            links=(("axis", ("O", "g")),), ground=("O",), traced=("g",), view=("y", "z")
        ),
        start={"w_y": 150.0, "w_z": -4.61538},
    )
