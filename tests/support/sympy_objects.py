"""Small mechanisms as SymPy's own objects, for the tests of their conversion."""

from __future__ import annotations

from typing import Any

from sympy import Expr, Symbol, exp, symbols
from sympy.physics.mechanics import (
    KanesMethod,
    Particle,
    PinJoint,
    Point,
    ReferenceFrame,
    RigidBody,
    System,
    dynamicsymbols,
    inertia,
)

t = dynamicsymbols._t


def four_bar_system(*, redundant: bool = False) -> System:
    """A four-bar of SymPy's joints in relative angles, hanging; its equations are not formed."""
    lengths, density, g = symbols("l_0:4"), Symbol("rho"), Symbol("g")
    q, u = dynamicsymbols("q_0:3"), dynamicsymbols("u_0:3")
    ground = RigidBody("ground")
    system = System.from_newtonian(ground)
    before, start = ground, ground.masscenter
    for k, length in enumerate(lengths[:3]):
        rod = RigidBody(f"rod_{k}", mass=density * length)
        rod.central_inertia = inertia(rod.frame, 0, 0, density * length**3 / 12)
        near = -length / 2 * rod.x
        joint = PinJoint(
            f"joint_{k}", before, rod, q[k], u[k], parent_point=start, child_point=near,
            joint_axis=ground.z,
        )  # fmt: skip
        system.add_joints(joint)
        before, start = rod, length / 2 * rod.x
    end = before.masscenter.locatenew("end", start)
    gap = end.pos_from(ground.masscenter) - lengths[3] * ground.x
    rows = [gap.dot(ground.x), gap.dot(ground.y)]
    system.add_holonomic_constraints(*rows, *([rows[0] + 2 * rows[1]] if redundant else ()))
    system.q_ind, system.q_dep = [q[0]], q[1:]
    system.u_ind, system.u_dep = [u[0]], u[1:]
    system.apply_uniform_gravity(-g * ground.y)
    return system


def four_bar_kane() -> KanesMethod:
    """The same by Kane's method."""
    system = four_bar_system()
    system.form_eoms()
    return system.eom_method


def windows_kane(count: int) -> KanesMethod:
    """Four-bar windows in a row, of rods all alike: closed at any length, and at none."""
    size = 2 * count + 1
    q, u = dynamicsymbols(f"q_0:{size}"), dynamicsymbols(f"u_0:{size}")
    frame, origin, l, m = ReferenceFrame("N"), Point("O"), Symbol("l"), Symbol("m")
    origin.set_vel(frame, 0)
    bodies: list[RigidBody] = []

    def rod(start: Point, on: ReferenceFrame) -> tuple[Point, ReferenceFrame]:
        k = len(bodies)
        turned = on.orientnew(f"L{k}", "Axis", (q[k], on.z))
        turned.set_ang_vel(on, u[k] * on.z)
        centre, end = (start.locatenew(f"P{k}{j}", l / j * turned.x) for j in (2, 1))
        for point in (centre, end):
            point.v2pt_theory(start, frame, turned)
        about = (inertia(turned, 0, 0, m * l**2 / 12), centre)
        bodies.append(RigidBody(f"B{k}", centre, turned, m, about))
        return end, turned

    (top, on), gaps = rod(origin, frame), list[Expr]()
    for i in range(1, count + 1):
        top, on = rod(top, on)
        gap = rod(top, on)[0].pos_from(origin) - i * l * frame.x
        gaps += [gap.dot(frame.x), gap.dot(frame.y)]
    rates = {a.diff(t): b for a, b in zip(q, u, strict=True)}
    method = KanesMethod(
        frame, q[:1], u[:1], [a - b for a, b in rates.items()],
        q_dependent=q[1:], u_dependent=u[1:], configuration_constraints=gaps,
        velocity_constraints=[gap.diff(t).xreplace(rates) for gap in gaps],
    )  # fmt: skip
    method.kanes_equations(bodies, [])
    return method


def ball_on_disc(*, with_positions: bool) -> KanesMethod:
    """A ball with a particle on a disc that spins up, as an example of opty has it.

    Its configuration constraints x = r q2 and y = -r q1 are no integrals of its velocity
    constraints ux = r u2 and uy = -r u1: speeds are components of the angular velocity.
    """
    q, u = dynamicsymbols("q1:4"), dynamicsymbols("u1:4")
    (x, y), (ux, uy) = dynamicsymbols("x y"), dynamicsymbols("ux uy")
    mb, mo, g, r, rate, alpha = symbols("mb mo g r Omega alpha")
    N, ball, disc = map(ReferenceFrame, ("N", "A1", "A2"))
    origin, contact, centre, observer = map(Point, ("O", "CP", "Ao", "observer"))
    origin.set_vel(N, 0)
    disc.orient_axis(N, rate * t + rate * exp(-alpha * t) / alpha - rate / alpha, N.z)
    disc.set_ang_vel(N, rate * (1 - exp(-alpha * t)) * N.z)
    ball.orient_body_fixed(disc, q, "123")
    by_angles = ball.ang_vel_in(N)
    ball.set_ang_vel(disc, u[0] * ball.x + u[1] * ball.y + u[2] * ball.z)
    contact.set_pos(origin, x * disc.x + y * disc.y)
    contact.set_vel(disc, ux * disc.x + uy * disc.y)
    centre.set_pos(contact, r * N.z)
    centre.set_vel(N, centre.pos_from(origin).diff(t, N))
    observer.set_pos(centre, r * ball.x)
    observer.v2pt_theory(centre, N, ball)
    rates = [ux - x.diff(t), uy - y.diff(t)]
    rates += [(by_angles - ball.ang_vel_in(N)).dot(axis) for axis in N]
    positions = {"q_ind": q, "q_dependent": [x, y]} if with_positions else {"q_ind": [*q, x, y]}
    if with_positions:
        positions["configuration_constraints"] = [x - r * q[1], y + r * q[0]]
    method = KanesMethod(
        N, u_ind=u, u_dependent=[ux, uy], kd_eqs=rates,
        velocity_constraints=[ux - r * u[1], uy + r * u[0]], **positions,
    )  # fmt: skip
    moment = 2 * mb * r**2 / 5
    about = (inertia(ball, moment, moment, moment), centre)
    bodies = [RigidBody("ball", centre, ball, mb, about), Particle("observer", observer, mo)]
    method.kanes_equations(bodies, [(centre, -mb * g * N.z), (observer, -mo * g * N.z)])
    return method


def slider(
    force: Any = None, *, mass: Expr | None = None, formed: bool = True, **kane: Any
) -> KanesMethod:
    """A particle on two axes; ``force(q, u, frame)`` acts on it."""
    q, u = dynamicsymbols("x y"), dynamicsymbols("v w")
    frame, origin = ReferenceFrame("N"), Point("O")
    origin.set_vel(frame, 0)
    point = origin.locatenew("P", q[0] * frame.x + q[1] * frame.y)
    point.set_vel(frame, u[0] * frame.x + u[1] * frame.y)
    body = Particle("B", point, Symbol("m") if mass is None else mass)
    rates = [a.diff(t) - b for a, b in zip(q, u, strict=True)]
    kane = {"q_ind": q, "u_ind": u, **kane}
    method = KanesMethod(frame, kd_eqs=rates, **kane)
    if formed:
        method.kanes_equations([body], [(point, force(q, u, frame))] if force else None)
    return method
