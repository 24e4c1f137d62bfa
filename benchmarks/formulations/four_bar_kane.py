"""The four-bar as a notebook has it: absolute angles, KanesMethod, nothing of mechc's."""

from __future__ import annotations

from sympy import Symbol, symbols
from sympy.physics.mechanics import (
    KanesMethod,
    Point,
    ReferenceFrame,
    RigidBody,
    dynamicsymbols,
    inertia,
)


def by_hand() -> KanesMethod:
    """Three uniform rods between pivots l_3 apart, under gravity; its equations are formed."""
    t = dynamicsymbols._t
    q, u = dynamicsymbols("q_0:3"), dynamicsymbols("u_0:3")
    l, m, g = symbols("l_0:4"), symbols("m_0:3"), Symbol("g")
    N, start = ReferenceFrame("N"), Point("O")
    start.set_vel(N, 0)
    origin, bodies, loads = start, [], []
    for k in range(3):
        A = N.orientnew(f"A_{k}", "Axis", (q[k], N.z))
        A.set_ang_vel(N, u[k] * N.z)
        centre = start.locatenew(f"G_{k}", l[k] / 2 * A.x)
        end = start.locatenew(f"P_{k}", l[k] * A.x)
        for point in (centre, end):
            point.v2pt_theory(start, N, A)
        central = (inertia(A, 0, 0, m[k] * l[k] ** 2 / 12), centre)
        bodies.append(RigidBody(f"rod_{k}", centre, A, m[k], central))
        loads.append((centre, -m[k] * g * N.y))
        start = end
    gap = start.pos_from(origin) - l[3] * N.x
    closure = [gap.dot(N.x), gap.dot(N.y)]
    rates = {x.diff(t): speed for x, speed in zip(q, u, strict=True)}
    method = KanesMethod(
        N, [q[0]], [u[0]], kd_eqs=[x.diff(t) - speed for x, speed in zip(q, u, strict=True)],
        q_dependent=q[1:], u_dependent=u[1:], configuration_constraints=closure,
        velocity_constraints=[row.diff(t).xreplace(rates) for row in closure],
    )  # fmt: skip
    method.kanes_equations(bodies, loads)
    return method
