"""Slider-crank driven by a torque on the crank, no gravity (EXUDYN's example).

It starts stretched, at the dead point where the slider cannot be the independent coordinate.
"""

from __future__ import annotations

from sympy import Symbol, cos, symbols
from sympy.physics.mechanics import (
    Particle,
    ReferenceFrame,
    RigidBody,
    dot,
    dynamicsymbols,
    inertia,
)

from mechc_codegen.description.mechanism import Constraint, Drawing, Mechanism
from mechc_codegen.description.solid import Solid
from mechc_codegen.library.parts import (
    coordinates,
    fixed_point,
    locate,
    parameter,
    speeds,
    turn_frame,
)


def slider_crank() -> Mechanism:
    """Crank and rod by their angles from the slideway, the slider by its position on it.

    Of the two ways to close the loop the one with the slider ahead of the pin is preferred.
    """
    theta, phi, x = dynamicsymbols("theta phi x")
    omega, nu, v = dynamicsymbols("omega nu v")
    l, m, T = symbols("l_0:2"), symbols("m_0:3"), Symbol("T")
    r = ReferenceFrame("r")
    origin = fixed_point("O", r)

    # Crank and rod turn by their angles from the slideway, which is r.x.
    crank, rod = turn_frame("crank", r, theta, omega, r.z), turn_frame("rod", r, phi, nu, r.z)
    pin = locate("p", origin, l[0] * crank.x, crank, r)
    end = locate("e", pin, l[1] * rod.x, rod, r)
    slider = origin.locatenew("s", x * r.x)
    slider.set_vel(r, v * r.x)

    # Closure: the rod's end is the slider.
    gap = end.pos_from(slider)
    closure = (
        Constraint("closure along x", dot(gap, r.x), "m"),
        Constraint("closure along y", dot(gap, r.y), "m"),
    )

    # Uniform links, mass centres in their middle.
    centres = (
        locate("g_0", origin, l[0] / 2 * crank.x, crank, r),
        locate("g_1", pin, l[1] / 2 * rod.x, rod, r),
    )
    about = [inertia(f, 0, 0, m[k] * l[k] ** 2 / 12) for k, f in enumerate((crank, rod))]
    return Mechanism(
        name="slider_crank",
        title="Slider-crank",
        frame=r,
        origin=origin,
        coordinates=(
            *coordinates((theta, phi), "rad", "angle of the crank", "angle of the rod"),
            *coordinates((x,), "m", "place of the slider"),
        ),
        speeds=(
            *speeds((omega, nu), "rad/s", "rate of the crank", "rate of the rod"),
            *speeds((v,), "m/s", "velocity of the slider"),
        ),
        kinematics=(omega, nu, v),
        parameters=(
            parameter(l[0], 0.5, "m", "length of the crank", positive=True),
            parameter(l[1], 1.0, "m", "length of the rod", positive=True),
            parameter(m[0], 2.0, "kg", "mass of the crank", positive=True),
            parameter(m[1], 4.0, "kg", "mass of the rod", positive=True),
            parameter(m[2], 1.0, "kg", "mass of the slider", positive=True),
            parameter(T, 10.0, "N m", "torque on the crank"),
        ),
        bodies=(
            RigidBody("crank", centres[0], crank, m[0], (about[0], centres[0])),
            RigidBody("rod", centres[1], rod, m[1], (about[1], centres[1])),
            Particle("slider", slider, m[2]),
        ),
        loads=((crank, T * r.z),),
        configuration_constraints=closure,
        points=(origin, pin, slider),
        drawing=Drawing(
            links=(("links", ("O", "p", "s")),),
            ground=("O",),
            traced=("p", "s"),
            solids=(Solid.box("slider", slider, r, (l[0] / 3, l[0] / 5, l[0] / 5)),),
        ),
        start={"theta": 0.0, "omega": 0.0},
        preference=cos(phi),
    )
