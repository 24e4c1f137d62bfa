"""Open chains of N links on a fixed pivot: in a plane, and with axes that alternate."""

from __future__ import annotations

from sympy import Symbol
from sympy.physics.mechanics import Point, ReferenceFrame, RigidBody, dynamicsymbols, inertia

from mechc_codegen.description.mechanism import Drawing, Mechanism
from mechc_codegen.library.parts import fixed_point, joint_angles, parameter, turn_frame

l, m, g = Symbol("l"), Symbol("m"), Symbol("g")


BENT = 0.5  # rad, out of the plane in which gravity and the first hinge would keep the bars


def planar_chain(links: int = 3) -> Mechanism:
    """Uniform rods in one plane, each hinged to the end of the previous one; they start level."""
    return _chain(links, spatial=False)


def spatial_chain(links: int = 3) -> Mechanism:
    """Uniform bars of square section; hinge axes alternately across and along.

    They start level, the second bar bent sideways.
    """
    return _chain(links, spatial=True)


def _chain(count: int, *, spatial: bool) -> Mechanism:
    q, u = dynamicsymbols(f"q_0:{count}"), dynamicsymbols(f"u_0:{count}")
    r = ReferenceFrame("r")
    origin = end = fixed_point("O", r)
    on, bodies, ends = r, list[RigidBody](), list[Point]()
    for k in range(count):
        axis = on.y if spatial and k % 2 else on.z
        frame = turn_frame(f"link_{k}", on, q[k], u[k], axis)
        centre = end.locatenew(f"centre_{k}", l / 2 * frame.x)
        across = m * l**2 / 12
        along = m * l**2 / 600 if spatial else 0
        about = inertia(frame, along, across if spatial else 0, across)
        bodies.append(RigidBody(f"link_{k}", centre, frame, m, (about, centre)))
        end = end.locatenew(f"E_{k}", l * frame.x)
        ends.append(end)
        on = frame
    return Mechanism(
        name="spatial_chain" if spatial else "planar_chain",
        title=f"Chain of {count} {'bar' if spatial else 'rod'}{'s' if count > 1 else ''}",
        frame=r,
        origin=origin,
        **joint_angles(q, u, [f"at hinge {k}" for k in range(count)]),
        parameters=(
            parameter(l, 1.0, "m", "length of every link", positive=True),
            parameter(m, 1.0, "kg", "mass of every link", positive=True),
            parameter(g, 9.81, "m/s^2", "acceleration of free fall, along -y"),
        ),
        bodies=tuple(bodies),
        gravity=-g * r.y,
        points=(origin, *ends),
        drawing=Drawing(
            links=(("links", (origin.name, *(end.name for end in ends))),),
            ground=(origin.name,),
            traced=(ends[-1].name,),
        ),
        start={f"q_{k}": BENT if spatial and k == 1 else 0.0 for k in range(count)},
    )
