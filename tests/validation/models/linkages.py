"""Closed loops: slider-crank, scotch yoke, six-bars, a governor, a toggle."""

from __future__ import annotations

import sympy as sm
import sympy.physics.mechanics as me

from .script import Script, published

t = me.dynamicsymbols._t


@published("E. J. Haug, Computer Aided Kinematics and Dynamics (1989): slider-crank, multipliers")
def slider_crank() -> Script:
    phi, psi, x = me.dynamicsymbols("phi psi x")
    r, l, m1, m2, m3, I1, I2, g = sm.symbols("r l m1 m2 m3 I1 I2 g")
    N = me.ReferenceFrame("N")
    crank, rod = N.orientnew("A", "Axis", (phi, N.z)), N.orientnew("B", "Axis", (psi, N.z))
    O = me.Point("O")
    O.set_vel(N, 0)
    pin = O.locatenew("pin", r * crank.x)
    C1, C2 = O.locatenew("C1", r / 2 * crank.x), pin.locatenew("C2", l / 2 * rod.x)
    slider = O.locatenew("slider", x * N.x)
    for point in (C1, C2, slider):
        point.set_vel(N, point.pos_from(O).dt(N))
    bodies = [
        me.RigidBody("crank", C1, crank, m1, (me.inertia(crank, 0, 0, I1), C1)),
        me.RigidBody("rod", C2, rod, m2, (me.inertia(rod, 0, 0, I2), C2)),
        me.Particle("piston", slider, m3),
    ]
    for body in bodies:
        body.potential_energy = body.mass * g * body.masscenter.pos_from(O).dot(N.y)
    end = r * crank.x + l * rod.x - x * N.x
    T, F = me.dynamicsymbols("T F")
    lagrange = me.LagrangesMethod(
        me.Lagrangian(N, *bodies), [phi, psi, x], hol_coneqs=[end.dot(N.x), end.dot(N.y)],
        forcelist=[(crank, T * N.z), (slider, -F * N.x)], frame=N,
    )  # fmt: skip
    lagrange.form_lagranges_equations()
    constants = {r: 0.1, l: 0.3, m1: 0.4, m2: 0.6, m3: 0.8, I1: 4e-4, I2: 5e-3, g: 9.81}
    start, guess = {phi: 0.6, phi.diff(t): 12.0}, {psi: -0.2, x: 0.4}
    return Script(lagrange, constants, start, 1.0, {T: 0.2, F: 3.0}, guess)


@published("J. E. Shigley, J. J. Uicker, Theory of Machines and Mechanisms (1980): scotch yoke")
def scotch_yoke() -> Script:
    theta, x, omega, v, T = me.dynamicsymbols("theta x omega v T")
    R, J, m, k, c = sm.symbols("R J m k c")
    N = me.ReferenceFrame("N")
    crank = N.orientnew("crank", "Axis", (theta, N.z))
    crank.set_ang_vel(N, omega * N.z)
    O = me.Point("O")
    O.set_vel(N, 0)
    yoke = O.locatenew("yoke", x * N.x)
    yoke.set_vel(N, v * N.x)
    bodies = [
        me.RigidBody("crank", O, crank, 1, (me.inertia(crank, 0, 0, J), O)),
        me.Particle("yoke", yoke, m),
    ]
    slot = x - R * sm.cos(theta)
    kane = me.KanesMethod(
        N,
        q_ind=[theta],
        q_dependent=[x],
        u_ind=[omega],
        u_dependent=[v],
        kd_eqs=[theta.diff(t) - omega, x.diff(t) - v],
        configuration_constraints=[slot],
        velocity_constraints=[v + R * sm.sin(theta) * omega],
    )
    kane.kanes_equations(bodies, [(crank, T * N.z), (yoke, -(k * x + c * v) * N.x)])
    constants = {R: 0.05, J: 2e-3, m: 0.7, k: 200.0, c: 0.8}
    return Script(kane, constants, {theta: 0.3, omega: 20.0}, 1.0, {T: 0.05}, {x: 0.05})


@published("R. L. Norton, Design of Machinery (1992): Watt's six-bar chain")
def watt_six_bar() -> Script:
    return _six_bar(stephenson=False)


@published("R. L. Norton, Design of Machinery (1992): Stephenson's six-bar chain")
def stephenson_six_bar() -> Script:
    return _six_bar(stephenson=True)


def _six_bar(*, stephenson: bool) -> Script:
    """A four-bar O1 A B O2 and a dyad C D: from its rocker (Watt) or its coupler (Stephenson)."""
    q, u = me.dynamicsymbols("q1:6"), me.dynamicsymbols("u1:6")
    l = sm.symbols("l1:6")
    rho = sm.symbols("rho")  # kg/m of all links
    d, p, e, f, g = sm.symbols("d p e f g")
    torque = me.dynamicsymbols("T")
    N, O = me.ReferenceFrame("N"), me.Point("O")
    O.set_vel(N, 0)
    frames = [N.orientnew(f"L{k + 1}", "Axis", (q[k], N.z)) for k in range(5)]
    for frame, rate in zip(frames, u, strict=True):
        frame.set_ang_vel(N, rate * N.z)
    O2, O3 = O.locatenew("O2", d * N.x), O.locatenew("O3", e * N.x + f * N.y)
    O2.set_vel(N, 0)
    O3.set_vel(N, 0)
    A = O.locatenew("A", l[0] * frames[0].x)
    A.v2pt_theory(O, N, frames[0])
    B = A.locatenew("B", l[1] * frames[1].x)
    rocker = O2.locatenew("B2", l[2] * frames[2].x)
    carrier, start_point = (frames[1], A) if stephenson else (frames[2], O2)
    C = start_point.locatenew("C", p * carrier.x + p * carrier.y)
    C.v2pt_theory(start_point, N, carrier)
    D = C.locatenew("D", l[3] * frames[3].x)
    D2 = O3.locatenew("D2", l[4] * frames[4].x)
    B.v2pt_theory(A, N, frames[1])
    rocker.v2pt_theory(O2, N, frames[2])
    D.v2pt_theory(C, N, frames[3])
    D2.v2pt_theory(O3, N, frames[4])
    bodies, loads = [], [(frames[0], torque * N.z)]
    for k, root in enumerate((O, A, O2, C, O3)):
        G = root.locatenew(f"G{k + 1}", l[k] / 2 * frames[k].x)
        G.v2pt_theory(root, N, frames[k])
        central = me.inertia(frames[k], 0, 0, rho * l[k] ** 3 / 12)
        bodies.append(me.RigidBody(f"link{k + 1}", G, frames[k], rho * l[k], (central, G)))
        loads.append((G, -rho * l[k] * g * N.y))
    gaps = [B.pos_from(O) - rocker.pos_from(O), D.pos_from(O) - D2.pos_from(O)]
    rates = [B.vel(N) - rocker.vel(N), D.vel(N) - D2.vel(N)]
    kane = me.KanesMethod(
        N,
        q_ind=[q[0]],
        u_ind=[u[0]],
        kd_eqs=[a.diff(t) - b for a, b in zip(q, u, strict=True)],
        q_dependent=q[1:],
        u_dependent=u[1:],
        configuration_constraints=[gap.dot(axis) for gap in gaps for axis in (N.x, N.y)],
        velocity_constraints=[rate.dot(axis) for rate in rates for axis in (N.x, N.y)],
    )
    kane.kanes_equations(bodies, loads)
    constants = dict(zip(l, (0.1, 0.35, 0.25, 0.4, 0.3), strict=True))
    constants |= {rho: 2.0, d: 0.4, p: 0.12, e: 0.8 if not stephenson else 0.7, f: 0.05, g: 9.81}
    guess = dict(zip(q[1:], (0.5, 1.3, 0.2, 1.5), strict=True))
    return Script(kane, constants, {q[0]: 0.7, u[0]: 6.0}, 1.0, {torque: 0.1}, guess)


@published("L. D. Landau, E. M. Lifshitz, Mechanics (1976), section 5, problem 4: a governor")
def centrifugal_governor() -> Script:
    theta = me.dynamicsymbols("theta")
    m1, m2, a, g, Omega = sm.symbols("m_1 m_2 a g Omega", positive=True)
    thetad = theta.diff(t)
    L = m1 * a**2 * (thetad**2 + Omega**2 * sm.sin(theta) ** 2)
    L += 2 * m2 * a**2 * thetad**2 * sm.sin(theta) ** 2 + 2 * (m1 + m2) * g * a * sm.cos(theta)
    lagrange = me.LagrangesMethod(L, [theta])
    lagrange.form_lagranges_equations()
    constants = {m1: 0.5, m2: 1.0, a: 0.2, g: 9.81, Omega: 14.0}
    return Script(lagrange, constants, {theta: 0.7, thetad: 0.1}, 3.0)


@published("A. A. Shabana, Dynamics of Multibody Systems (1989): two slides and a rod (trammel)")
def elliptical_trammel() -> Script:
    x, y, theta, vx, vy, w = me.dynamicsymbols("x y theta v_x v_y omega")
    m, mx, my, L, I, g = sm.symbols("m m_x m_y L I g")
    N = me.ReferenceFrame("N")
    rod = N.orientnew("rod", "Axis", (theta, N.z))
    rod.set_ang_vel(N, w * N.z)
    O = me.Point("O")
    O.set_vel(N, 0)
    X, Y = O.locatenew("X", x * N.x), O.locatenew("Y", y * N.y)
    X.set_vel(N, vx * N.x)
    Y.set_vel(N, vy * N.y)
    G = X.locatenew("G", L / 2 * rod.x)
    G.v2pt_theory(X, N, rod)
    system = me.System(N, O)
    system.add_bodies(
        me.RigidBody("rod", G, rod, m, (me.inertia(rod, 0, 0, I), G)),
        me.Particle("slide_x", X, mx),
        me.Particle("slide_y", Y, my),
    )
    system.add_coordinates(theta)
    system.add_coordinates(x, y, independent=False)
    system.add_speeds(w)
    system.add_speeds(vx, vy, independent=False)
    system.add_kdes(theta.diff(t) - w, x.diff(t) - vx, y.diff(t) - vy)
    gap = X.pos_from(O) + L * rod.x - Y.pos_from(O)
    system.add_holonomic_constraints(gap.dot(N.x), gap.dot(N.y))
    system.apply_uniform_gravity(-g * N.y)
    system.form_eoms()
    constants = {m: 1.0, mx: 0.4, my: 0.3, L: 0.8, I: 0.06, g: 9.81}
    return Script(system, constants, {theta: 2.2, w: 0.5}, 1.5, {}, {x: 0.5, y: 0.6})
