"""N four-bar windows in a row, problem A02 of the IFToMM library, in relative angles.

N + 1 uprights on ground pivots one rod apart, N couplers between their tops, all rods equal.
Every angle but the first is that of a rod relative to its parent, and the whole scene, gravity
included, can be turned by an angle: then no coupler's angle is exactly zero.
Rods and cuts are described from one to the next and never expanded across the row.
"""

from __future__ import annotations

from math import pi

from sympy import Symbol
from sympy.physics.mechanics import Point, ReferenceFrame, RigidBody, dynamicsymbols, inertia

from mechc_codegen.description.mechanism import Closure, Drawing, Mechanism
from mechc_codegen.library.parts import coordinates, fixed_point, parameter, speeds, turn_frame

l, m, g, tilt = Symbol("l"), Symbol("m"), Symbol("g"), Symbol("tilt")


def windows(count: int = 2) -> Mechanism:
    """``count`` windows; coordinates: the first upright, then coupler and upright of each.

    One degree of freedom, ``count + 1`` where all rods lie flat: there as many branches cross.
    The start is upright, its top moving with 1 m/s for rods of 1 m: it swings through.
    """
    size = 2 * count + 1
    q, u = dynamicsymbols(f"q_0:{size}"), dynamicsymbols(f"u_0:{size}")
    r = ReferenceFrame("r")
    origin = fixed_point("A_0", r)
    ground = r.orientnew("ground", "Axis", (tilt, r.z))
    bodies: list[RigidBody] = []

    def rod(name: str, start: Point, end: str, on: ReferenceFrame) -> tuple[Point, ReferenceFrame]:
        """A uniform rod from ``start``, turned against ``on`` by the next angle; its far end."""
        k = len(bodies)
        frame = turn_frame(name, on, q[k], u[k], on.z)
        centre = start.locatenew(f"{name}_centre", l / 2 * frame.x)
        about = (inertia(frame, 0, 0, m * l**2 / 12), centre)
        bodies.append(RigidBody(name, centre, frame, m, about))
        return start.locatenew(end, l * frame.x), frame

    # Up the first upright, along the couplers, and down an upright from each coupler's end.
    top, carrier = rod("upright_0", origin, "B_0", ground)
    tops, feet = [top], [origin]
    for i in range(1, count + 1):
        top, carrier = rod(f"coupler_{i}", top, f"B_{i}", carrier)
        foot, _ = rod(f"upright_{i}", top, f"A_{i}", carrier)
        tops.append(top)
        feet.append(foot)
    pivots = [origin.locatenew(f"pivot_{i}", i * l * ground.x) for i in range(1, count + 1)]

    # The start: upright, coupler, upright; each further coupler goes straight on.
    square = [pi / 2, *[-pi / 2, -pi / 2], *[0.0, -pi / 2] * (count - 1)]
    return Mechanism(
        name="windows",
        title=f"{count} four-bar window{'s' if count > 1 else ''} in a row",
        frame=r,
        origin=origin,
        coordinates=coordinates(q, "rad", *[f"relative angle of {body.name}" for body in bodies]),
        speeds=speeds(u, "rad/s", *[f"relative rate of {body.name}" for body in bodies]),
        kinematics=tuple(u),
        parameters=(
            parameter(l, 1.0, "m", "length of every rod", positive=True),
            parameter(m, 1.0, "kg", "mass of every rod", positive=True),
            parameter(g, 9.81, "m/s^2", "acceleration of free fall, along the ground's -y"),
            parameter(tilt, 0.0, "rad", "angle by which the whole scene is turned"),
        ),
        bodies=tuple(bodies),
        gravity=-g * ground.y,
        closures=tuple(
            Closure(f"foot {i}", foot, pivot, (r.x, r.y))
            for i, (foot, pivot) in enumerate(zip(feet[1:], pivots, strict=True), start=1)
        ),
        points=(*feet, *tops),
        drawing=Drawing(
            links=(
                ("couplers", tuple(p.name for p in tops)),
                *((f"upright {i}", (f"A_{i}", f"B_{i}")) for i in range(count + 1)),
            ),
            ground=tuple(p.name for p in feet),
            traced=("B_0",),
        ),
        start={f"q_{k}": angle for k, angle in enumerate(square)} | {"u_0": -1.0},
    )
