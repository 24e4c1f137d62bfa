"""Rows of four-bar windows, problem A02 of the IFToMM library, turned by 0.3 rad.

Every second all rods come in line and the configuration curve crosses itself.  mechc has relative
angles, of which none stays zero by luck; tools that take equations are given angles against the
inertial axes with every upright on its own pivot, whose equations are far shorter.
"""

from __future__ import annotations

from functools import partial

import numpy as np
from mechc_codegen.description.mechanism import Constraint, Mechanism
from mechc_codegen.library.parts import fixed_point, joint_angles, locate, parameter
from sympy import Symbol
from sympy.physics.mechanics import ReferenceFrame, RigidBody, dot, dynamicsymbols, inertia

from .problem import Array, Formulation, Problem
from .windows_motion import first_upright_motion, upright_start

T_END = 2.0  # a period; rounding, magnified at every crossing, stays near 1e-12
TILT = 0.3
l, m, g, tilt = Symbol("l"), Symbol("m"), Symbol("g"), Symbol("tilt")


def row(count: int) -> Problem:
    """Compared in place and velocity of the first upright's end, on the ground's axes."""
    from mechc_codegen.library.chains.windows import windows

    rods = "one window" if count == 1 else f"{count} windows"
    return Problem(
        name=f"windows_{count}",
        title=f"Four-bar windows, N = {count}",
        mechanism=partial(windows, count),
        start=upright_start(count),
        t_end=T_END,
        quantities=("x", "y", "vx", "vy"),
        exact=first_upright_motion(count, T_END),
        observe=lambda y: end_of_the_upright(y[0], y[2 * count + 1]),
        formulation=Formulation(
            partial(apart, count),
            start_apart(count),
            lambda y: end_of_the_upright(y[0] - TILT, y[2 * count + 1]),
        ),
        params={"tilt": TILT},
        note=f"{rods}; twice through a crossing of the configuration curve",
    )


def end_of_the_upright(angle: float, rate: float) -> Array:
    """Place (m) and velocity (m/s) of the end of a rod of 1 m at an angle against the ground."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([c, s, -s * rate, c * rate])


def start_apart(count: int) -> Array:
    """Uprights square to the ground, the first one's end moving at +1 m/s; couplers along it."""
    angles = [np.pi / 2 + TILT] * (count + 1) + [TILT] * count
    return np.array([*angles, *[-1.0] * (count + 1), *[0.0] * count])


def apart(count: int) -> Mechanism:
    """The same row: uprights on their pivots, then couplers, all angles from the inertial x."""
    size = 2 * count + 1
    q, u = dynamicsymbols(f"q_0:{size}"), dynamicsymbols(f"u_0:{size}")
    r = ReferenceFrame("r")
    ground = r.orientnew("ground", "Axis", (tilt, r.z))
    origin = fixed_point("A_0", r)
    frames = [r.orientnew(f"f_{k}", "Axis", (q[k], r.z)) for k in range(size)]
    for frame, rate in zip(frames, u, strict=True):
        frame.set_ang_vel(r, rate * r.z)
    pivots = [origin, *(origin.locatenew(f"A_{i}", i * l * ground.x) for i in range(1, count + 1))]
    for pivot in pivots[1:]:
        pivot.set_vel(r, 0)

    # Uprights, and couplers from the end of one to the end of the next.
    uprights, couplers = frames[: count + 1], frames[count + 1 :]
    tops = [locate(f"B_{i}", pivots[i], l * frame.x, frame, r) for i, frame in enumerate(uprights)]
    ends = [locate(f"C_{i}", tops[i], l * frame.x, frame, r) for i, frame in enumerate(couplers)]
    starts = [*pivots, *tops[:-1]]
    bodies = []
    for k, (start, frame) in enumerate(zip(starts, frames, strict=True)):
        centre = locate(f"g_{k}", start, l / 2 * frame.x, frame, r)
        about = (inertia(frame, 0, 0, m * l**2 / 12), centre)
        bodies.append(RigidBody(f"rod_{k}", centre, frame, m, about))
    closure = [
        Constraint(f"window {i} along {axis}", dot(end.pos_from(top), axis), "m")
        for i, (end, top) in enumerate(zip(ends, tops[1:], strict=True), start=1)
        for axis in (r.x, r.y)
    ]
    return Mechanism(
        name=f"windows_apart_{count}",
        title=f"{count} four-bar windows, uprights on their pivots",
        frame=r,
        origin=origin,
        **joint_angles(q, u, [f"of rod {k}" for k in range(size)]),
        parameters=(
            parameter(l, 1.0, "m", "length of every rod", positive=True),
            parameter(m, 1.0, "kg", "mass of every rod", positive=True),
            parameter(g, 9.81, "m/s^2", "acceleration of free fall, along the ground's -y"),
            parameter(tilt, 0.0, "rad", "angle by which the whole scene is turned"),
        ),
        bodies=tuple(bodies),
        gravity=-g * ground.y,
        configuration_constraints=tuple(closure),
    )
