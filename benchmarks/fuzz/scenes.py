"""Cranks on arbitrary axes, joined by rods: one compiled scene for each number of cranks and rods.

Whether such a linkage is planar, spherical or spatial, and whether a rod is redundant, its
parameters decide: axes that are parallel, that meet in a point, or neither.  Rods are massless, so
two cranks and a rod are a planar four-bar, a spherical one, or the spatial linkage with two ball
joints (RSSR).
"""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

from mechc_codegen.description.mechanism import Constraint, Mechanism
from mechc_codegen.library.parts import fixed_point, joint_angles, parameter, weight
from sympy import Expr, symbols
from sympy.physics.mechanics import Particle, Point, ReferenceFrame, dynamicsymbols
from sympy.physics.vector import Vector

import mechc

CRANK = {"x": "m", "y": "m", "z": "m", "a": "rad", "b": "rad", "r": "m", "h": "m", "m": "kg"}


class Topology(NamedTuple):
    """The number of cranks, and which of them rods join."""

    cranks: int
    rods: tuple[tuple[int, int], ...]


TOPOLOGIES = {
    "one loop": Topology(2, ((0, 1),)),
    "one loop, two freedoms": Topology(3, ((0, 1),)),
    "two loops": Topology(3, ((0, 1), (1, 2))),
    "three loops": Topology(4, ((0, 1), (1, 2), (2, 3))),
    "two loops, one rod redundant": Topology(3, ((0, 1), (1, 2), (0, 2))),
}


@cache
def compiled(name: str) -> mechc.Model:
    """The scene of a topology; q_k and u_k are the angle and the speed of crank k."""
    return mechc.compile(mechanism(name, *TOPOLOGIES[name]), outputs=("energy",))


def mechanism(name: str, cranks: int, rods: tuple[tuple[int, int], ...]) -> Mechanism:
    """Cranks under gravity, and rods, each a constraint."""
    q, u = dynamicsymbols(f"q_0:{cranks}"), dynamicsymbols(f"u_0:{cranks}")
    N, g = ReferenceFrame("N"), symbols("g")
    origin, up = fixed_point("O", N), 0.8 * N.y + 0.6 * N.z
    made = [_crank(k, q[k], u[k], N, origin) for k in range(cranks)]
    ends, bodies = [end for end, _ in made], [body for _, body in made]
    named = [(f"{kind}_{k}", unit) for k in range(cranks) for kind, unit in CRANK.items()]
    named += [(f"L_{i}{j}", "m") for i, j in rods]
    return Mechanism(
        name=name.replace(" ", "_").replace(",", ""),
        title=f"Cranks and rods: {name}",
        frame=N,
        origin=origin,
        **joint_angles(q, u, [f"of crank {k}" for k in range(cranks)]),
        parameters=(
            *(parameter(symbols(each), 1.0, unit, each) for each, unit in named),
            parameter(g, 9.81, "m/s^2", "acceleration of free fall"),
        ),
        bodies=tuple(bodies),
        loads=tuple(weight(body, origin, g, up) for body in bodies),
        configuration_constraints=tuple(
            Constraint(f"rod {i}{j}", _gap(ends[j].pos_from(ends[i]), symbols(f"L_{i}{j}")), "m")
            for i, j in rods
        ),
        points=tuple(ends),
    )


def _crank(k: int, q: Expr, u: Expr, N: ReferenceFrame, origin: Point) -> tuple[Point, Particle]:
    """The end of a crank about a tilted axis through its pivot, and the mass there."""
    x, y, z, a, b, r, h, m = (symbols(f"{kind}_{k}") for kind in CRANK)
    once = N.orientnew(f"once_{k}", "Axis", (a, N.x))
    axis = once.orientnew(f"axis_{k}", "Axis", (b, once.y))
    crank = axis.orientnew(f"crank_{k}", "Axis", (q, axis.z))
    crank.set_ang_vel(axis, u * axis.z)
    end = origin.locatenew(f"end_{k}", x * N.x + y * N.y + z * N.z + r * crank.x + h * axis.z)
    end.set_vel(N, r * u * crank.y)
    return end, Particle(f"mass_{k}", end, m)


def _gap(apart: Vector, length: Expr) -> Expr:
    return (apart.dot(apart) - length**2) / (2 * length)
