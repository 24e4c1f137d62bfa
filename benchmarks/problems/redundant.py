"""The planar four-bar again, with more constraints than it needs.

``spatial``: in space, about axes tilted by two angles; the last hinge is one in space, closed by
three rows for its place and two for its axis.  ``two_rockers``: planar, the rocker doubled, so
that its rows are redundant on closed configurations only.  Both move as ``mechc.load("four_bar")``
does; of two rockers, each has half of the rocker's mass.
"""

from __future__ import annotations

from collections.abc import Callable

from mechc_codegen.description.mechanism import Constraint, Drawing, Mechanism
from mechc_codegen.library.parts import (
    fixed_point,
    joint_angles,
    locate,
    parameter,
    turn_frame,
    weight,
)
from sympy import Expr, Symbol, symbols
from sympy.physics.mechanics import ReferenceFrame, RigidBody, dot, dynamicsymbols, inertia
from sympy.physics.vector import Vector

Rows = list[tuple[str, Expr]]  # what a row measures, and the gap
Closing = Callable[[Vector, ReferenceFrame, ReferenceFrame], Rows]
LINKS = ("crank", "coupler", "rocker", "other rocker")
l, m, g = symbols("l_0:4"), symbols("m_0:3"), Symbol("g")
tilt = symbols("tilt_0:2")


def spatial() -> Mechanism:
    """The four-bar in space, closed by five rows of which two would suffice."""
    return _linkage("spatial", _hinge, tilted=True)


def two_rockers() -> Mechanism:
    """The planar four-bar with two rockers, and one redundant row on closed configurations."""
    return _linkage("two_rockers", _once, rockers=2)


def _once(gap: Vector, ground: ReferenceFrame, frame: ReferenceFrame) -> Rows:
    return [("along x", dot(gap, ground.x)), ("along y", dot(gap, ground.y))]


def _hinge(gap: Vector, ground: ReferenceFrame, frame: ReferenceFrame) -> Rows:
    """A hinge: its place by rows along general axes, and its axis by two rows."""
    a = ground.orientnew("a", "Axis", (0.4, ground.y)).orientnew("b", "Axis", (0.9, ground.x))
    place = [(f"of place along {n}", dot(gap, v)) for n, v in zip("abc", a, strict=True)]
    axis = [(f"of axis with {n}", dot(frame.z, v)) for n, v in zip("xy", ground, strict=False)]
    return [*place, *axis]


def _linkage(
    name: str, closure_of: Closing, *, rockers: int = 1, tilted: bool = False
) -> Mechanism:
    size = 2 + rockers
    theta, omega = dynamicsymbols(f"theta_0:{size}"), dynamicsymbols(f"omega_0:{size}")
    r = ReferenceFrame("r")
    ground = r
    if tilted:
        ground = r.orientnew("tilted", "Axis", (tilt[0], r.x)).orientnew(
            "ground", "Axis", (tilt[1], r.y)
        )
    origin = fixed_point("O", r)

    # Links turn about the ground's z; every rocker starts where the coupler ends.
    bodies, ends, frames = [], [origin], []
    for k in range(size):
        link = min(k, 2)
        frame = turn_frame(f"e_{k}", ground, theta[k], omega[k], ground.z)
        start = ends[link]
        mass = m[link] / (rockers if link == 2 else 1)
        centre = locate(f"g_{k}", start, l[link] / 2 * frame.x, frame, r)
        about = (inertia(frame, 0, 0, mass * l[link] ** 2 / 12), centre)
        bodies.append(RigidBody(LINKS[k], centre, frame, mass, about))
        ends.append(locate(f"p_{k + 1}", start, l[link] * frame.x, frame, r))
        frames.append(frame)

    closure: Rows = []
    for k in range(2, size):
        gap = ends[k + 1].pos_from(origin) - l[3] * ground.x
        closure += [
            (f"closure of the {LINKS[k]} {which}", row)
            for which, row in closure_of(gap, ground, frames[k])
        ]

    return Mechanism(
        name=name,
        title=f"Four-bar with redundant constraints: {name}",
        frame=r,
        origin=origin,
        **joint_angles(theta, omega, [f"of the {LINKS[k]}" for k in range(size)]),
        parameters=(
            *(parameter(l[k], k + 1.0, "m", f"length {k}", positive=True) for k in range(4)),
            *(parameter(m[k], k + 1.0, "kg", f"mass {k}", positive=True) for k in range(3)),
            parameter(g, 9.81, "m/s^2", "acceleration of free fall, along the ground's -y"),
            *((parameter(a, 0.0, "rad", "tilt of the axes") for a in tilt) if tilted else ()),
        ),
        bodies=tuple(bodies),
        loads=tuple(weight(body, origin, g, ground.y) for body in bodies),
        configuration_constraints=tuple(Constraint(n, e, "m") for n, e in closure),
        points=tuple(ends),
        drawing=Drawing(links=(("links", tuple(p.name for p in ends[:4])),), ground=("O",)),
    )
