"""A chain of point masses on massless links that swings in a plane: one link is problem A01."""

from __future__ import annotations

from math import pi

from sympy import Symbol, symbols
from sympy.physics.mechanics import Particle, ReferenceFrame, dynamicsymbols

from mechc_codegen.description.mechanism import Drawing, Mechanism
from mechc_codegen.library.parts import (
    fixed_point,
    joint_angles,
    locate,
    parameter,
    turn_frame,
    weight,
)

TITLES = {1: "Simple pendulum", 2: "Double pendulum"}


def pendulum(links: int = 1) -> Mechanism:
    """A chain whose angles are measured from the downward vertical; it starts level, at rest."""
    theta, omega = dynamicsymbols(f"theta_0:{links}"), dynamicsymbols(f"omega_0:{links}")
    m, l, g = symbols(f"m_0:{links}"), symbols(f"l_0:{links}"), Symbol("g")
    r = ReferenceFrame("r")
    origin = fixed_point("O", r)

    # Link k is hinged to the end of link k-1; its mass is at its other end.
    joints, bobs, loads = [origin], [], []
    for k in range(links):
        link = turn_frame(f"link_{k}", r, theta[k], omega[k], r.z)
        joints.append(locate(f"p_{k + 1}", joints[k], -l[k] * link.y, link, r))
        bobs.append(Particle(f"bob_{k}", joints[k + 1], m[k]))
        loads.append(weight(bobs[k], origin, g, r.y))

    return Mechanism(
        name="pendulum",
        title=TITLES.get(links, f"Pendulum of {links} links"),
        frame=r,
        origin=origin,
        **joint_angles(theta, omega, [f"of link {k}" for k in range(links)], "angular velocity"),
        parameters=(
            *[parameter(m[k], 1.0, "kg", f"mass {k}", positive=True) for k in range(links)],
            *[parameter(l[k], 1.0, "m", f"length {k}", positive=True) for k in range(links)],
            parameter(g, 9.81, "m/s^2", "acceleration of free fall, along -y"),
        ),
        bodies=tuple(bobs),
        loads=tuple(loads),
        points=tuple(joints),
        drawing=Drawing(
            links=(("links", tuple(p.name for p in joints)),),
            ground=("O",),
            traced=(joints[-1].name,),
        ),
        start={f"theta_{k}": pi / 2 for k in range(links)},
    )
