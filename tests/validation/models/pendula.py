"""Pendula: hung from springs, carts and moving supports, in the plane and in space."""

from __future__ import annotations

from math import sin

import sympy as sm
import sympy.physics.mechanics as me

from .script import Script, published

t = me.dynamicsymbols._t


@published("C. Huygens, Horologium Oscillatorium (1673), as a compound pendulum with a torque")
def compound_pendulum() -> Script:
    q, u, T = me.dynamicsymbols("q u T")
    m, a, I, g, c = sm.symbols("m a I g c")
    N, A = me.ReferenceFrame("N"), me.ReferenceFrame("A")
    A.orient_axis(N, q, N.z)
    A.set_ang_vel(N, u * N.z)
    O = me.Point("O")
    O.set_vel(N, 0)
    G = O.locatenew("G", -a * A.y)
    G.v2pt_theory(O, N, A)
    # people give all three moments of inertia; two of them fall out of the equations
    Ixx, Iyy = sm.symbols("Ixx Iyy")
    body = me.RigidBody("body", G, A, m, (me.inertia(A, Ixx, Iyy, I), G))
    kane = me.KanesMethod(N, q_ind=[q], u_ind=[u], kd_eqs=[q.diff(t) - u])
    kane.kanes_equations([body], [(G, -m * g * N.y), (A, (T - c * u) * N.z)])
    constants = {m: 1.2, a: 0.35, I: 0.06, Ixx: 0.06, Iyy: 0.001, g: 9.81, c: 0.02}
    return Script(kane, constants, {q: 1.1, u: 0.0}, 5.0, {T: 0.3})


@published("L. D. Landau, E. M. Lifshitz, Mechanics (1976), section 5, problem 1")
def double_pendulum() -> Script:
    phi1, phi2 = me.dynamicsymbols("phi1 phi2")
    m1, m2, l1, l2, g = sm.symbols("m1 m2 l1 l2 g", positive=True)
    w1, w2 = phi1.diff(t), phi2.diff(t)
    T = (
        (m1 + m2) * l1**2 * w1**2 / 2
        + m2 * l2**2 * w2**2 / 2
        + m2 * l1 * l2 * w1 * w2 * sm.cos(phi1 - phi2)
    )
    V = -(m1 + m2) * g * l1 * sm.cos(phi1) - m2 * g * l2 * sm.cos(phi2)
    lagrange = me.LagrangesMethod(T - V, [phi1, phi2])
    lagrange.form_lagranges_equations()
    constants = {m1: 1.0, m2: 0.7, l1: 0.8, l2: 0.5, g: 9.81}
    return Script(lagrange, constants, {phi1: 0.9, phi2: 0.4, w1: 0.0, w2: -0.5}, 3.0)


@published("L. D. Landau, E. M. Lifshitz, Mechanics (1976), section 5, problem 2")
def pendulum_on_cart() -> Script:
    x, theta, v, omega, F = me.dynamicsymbols("x theta v omega F")
    M, m, l, g, b = sm.symbols("M m l g b")
    N, B = me.ReferenceFrame("N"), me.ReferenceFrame("B")
    B.orient(N, "Axis", [theta, N.z])
    B.set_ang_vel(N, omega * N.z)
    O = me.Point("O")
    C = O.locatenew("C", x * N.x)
    P = C.locatenew("P", l * sm.sin(theta) * N.x - l * sm.cos(theta) * N.y)
    O.set_vel(N, 0)
    C.set_vel(N, v * N.x)
    P.v2pt_theory(C, N, B)
    bodies = [me.Particle("cart", C, M), me.Particle("bob", P, m)]
    loads = [(C, (F - b * v) * N.x), (P, -m * g * N.y)]
    kane = me.KanesMethod(N, [x, theta], [v, omega], [v - x.diff(), omega - theta.diff()])
    kane.kanes_equations(bodies, loads)
    constants = {M: 2.0, m: 0.5, l: 0.6, g: 9.81, b: 0.1}
    start = {x: 0.0, theta: 0.5, v: 0.2, omega: 0.0}
    return Script(kane, constants, start, 5.0, {F: lambda time: 0.8 * sin(2.0 * time)})


@published("L. D. Landau, E. M. Lifshitz, Mechanics (1976), section 30, problem 1 (P. L. Kapitza)")
def kapitza_pendulum() -> Script:
    phi = me.dynamicsymbols("phi")
    m, l, g, a, gamma = sm.symbols("m l g a gamma", positive=True)
    N = me.ReferenceFrame("N")
    O = me.Point("O")
    O.set_vel(N, 0)
    support = O.locatenew("S", a * sm.cos(gamma * t) * N.y)
    bob = support.locatenew("P", l * sm.sin(phi) * N.x - l * sm.cos(phi) * N.y)
    bob.set_vel(N, bob.pos_from(O).dt(N))
    P = me.Particle("P", bob, m)
    P.potential_energy = m * g * bob.pos_from(O).dot(N.y)
    lagrange = me.LagrangesMethod(me.Lagrangian(N, P), [phi], bodies=[P], frame=N)
    lagrange.form_lagranges_equations()
    constants = {m: 0.2, l: 0.3, g: 9.81, a: 0.03, gamma: 150.0}
    return Script(lagrange, constants, {phi: 2.9, phi.diff(t): 0.0}, 1.0)


@published("L. D. Landau, E. M. Lifshitz, Mechanics (1976), section 14, problem 1")
def spherical_pendulum() -> Script:
    theta, phi = me.dynamicsymbols("theta phi")
    m, l, g = sm.symbols("m l g")
    thetad, phid = me.dynamicsymbols("theta phi", 1)
    L = m * l**2 / 2 * (thetad**2 + phid**2 * sm.sin(theta) ** 2) + m * g * l * sm.cos(theta)
    lagrange = me.LagrangesMethod(L, [theta, phi])
    lagrange.form_lagranges_equations()
    constants = {m: 0.4, l: 1.5, g: 9.81}
    return Script(lagrange, constants, {theta: 0.8, phi: 0.0, thetad: 0.0, phid: 1.7}, 5.0)


@published("L. D. Landau, E. M. Lifshitz, Mechanics (1976), section 39, problem 3")
def foucault_pendulum() -> Script:
    x, y, vx, vy = me.dynamicsymbols("x y v_x v_y")
    m, l, g, Omega, lam = sm.symbols("m l g Omega lambda")
    # the Earth turns about its axis; E.x south, E.y east, E.z up at the latitude lambda
    N, E = me.ReferenceFrame("N"), me.ReferenceFrame("E")
    E.orient_body_fixed(N, (Omega * t, sm.pi / 2 - lam, 0), "ZYX")
    O = me.Point("O")
    O.set_vel(N, 0)
    height = l - sm.sqrt(l**2 - x**2 - y**2)
    P = O.locatenew("P", x * E.x + y * E.y + height * E.z)
    O.set_vel(E, 0)
    P.set_vel(E, (x.diff(t) * E.x + y.diff(t) * E.y + height.diff(t) * E.z))
    P.v1pt_theory(O, N, E)
    speeds = {x.diff(t): vx, y.diff(t): vy}
    P.set_vel(N, P.vel(N).subs(speeds))
    bob = me.Particle("bob", P, m)
    kane = me.KanesMethod(N, [x, y], [vx, vy], [x.diff(t) - vx, y.diff(t) - vy])
    kane.kanes_equations([bob], [(P, -m * g * E.z)])
    constants = {m: 28.0, l: 67.0, g: 9.81, Omega: 7.292e-5, lam: 0.853}
    return Script(kane, constants, {x: 3.0, y: 0.0, vx: 0.0, vy: 0.0}, 60.0)


@published("A. Vitt, G. Gorelik, Oscillations of an elastic pendulum, J. Tech. Phys. 3 (1933)")
def elastic_pendulum() -> Script:
    r, theta, vr, omega = me.dynamicsymbols("r theta v_r omega")
    m, k, l0, g = sm.symbols("m k l0 g")
    N, A = me.ReferenceFrame("N"), me.ReferenceFrame("A")
    A.orient_axis(N, N.z, theta)
    A.set_ang_vel(N, omega * N.z)
    O, P = me.Point("O"), me.Point("P")
    P.set_pos(O, -r * A.y)
    O.set_vel(N, 0)
    P.set_vel(A, -vr * A.y)
    P.v1pt_theory(O, N, A)
    spring = me.LinearSpring(k, me.LinearPathway(O, P), l0)
    kane = me.KanesMethod(N, [r, theta], [vr, omega], [r.diff() - vr, theta.diff() - omega])
    kane.kanes_equations([me.Particle("bob", P, m)], [*spring.to_loads(), (P, -m * g * N.y)])
    constants = {m: 0.5, k: 40.0, l0: 0.5, g: 9.81}
    return Script(kane, constants, {r: 0.7, theta: 0.4, vr: 0.0, omega: 0.3}, 5.0)


@published(
    "K. Furuta et al. (1992); B. Cazzolato, Z. Prime, On the Dynamics of the Furuta Pendulum"
)
def furuta_pendulum() -> Script:
    q1, q2, u1, u2, tau = me.dynamicsymbols("theta_1 theta_2 omega_1 omega_2 tau")
    m1, m2, l1, l2, L1, J1, J2, b1, b2, g = sm.symbols("m_1 m_2 l_1 l_2 L_1 J_1 J_2 b_1 b_2 g")
    N, A, B = (me.ReferenceFrame(name) for name in "NAB")
    A.orient_axis(N, q1, N.z)
    B.orient_axis(A, q2, A.x)
    A.set_ang_vel(N, u1 * N.z)
    B.set_ang_vel(A, u2 * A.x)
    O = me.Point("O")
    O.set_vel(N, 0)
    G1, E = O.locatenew("G1", l1 * A.x), O.locatenew("E", L1 * A.x)
    G2 = E.locatenew("G2", -l2 * B.z)
    G1.v2pt_theory(O, N, A)
    E.v2pt_theory(O, N, A)
    G2.v2pt_theory(E, N, B)
    arm = me.RigidBody("arm", G1, A, m1, (me.inertia(A, 0, J1, J1), G1))
    rod = me.RigidBody("rod", G2, B, m2, (me.inertia(B, J2, J2, 0), G2))
    loads = [
        (G2, -m2 * g * N.z),
        (A, (tau - b1 * u1) * N.z + b2 * u2 * A.x),
        (B, -b2 * u2 * A.x),
    ]
    kane = me.KanesMethod(N, [q1, q2], [u1, u2], [q1.diff() - u1, q2.diff() - u2])
    kane.kanes_equations([arm, rod], loads)
    constants = {
        m1: 0.3,
        m2: 0.075,
        l1: 0.15,
        l2: 0.148,
        L1: 0.278,
        J1: 2.5e-2,
        J2: 1.0e-3,
        b1: 1e-4,
        b2: 2.8e-4,
        g: 9.81,
    }
    start = {q1: 0.0, q2: 2.8, u1: 0.5, u2: 0.0}
    return Script(kane, constants, start, 3.0, {tau: 0.01})


@published("G. Gede et al., Constrained Multibody Dynamics with Python (2013): n links on a cart")
def links_on_a_cart() -> Script:
    n = 4
    q = me.dynamicsymbols(f"q:{n + 1}")
    u = me.dynamicsymbols(f"u:{n + 1}")
    f = me.dynamicsymbols("f")
    m, l, g = sm.symbols(f"m:{n + 1}"), sm.symbols(f"l:{n}"), sm.symbols("g")
    I, O = me.ReferenceFrame("I"), me.Point("O")
    O.set_vel(I, 0)
    P0 = me.Point("P0")
    P0.set_pos(O, q[0] * I.x)
    P0.set_vel(I, u[0] * I.x)
    points, particles = [P0], [me.Particle("Pa0", P0, m[0])]
    forces, kindiffs = [(P0, f * I.x - m[0] * g * I.y)], [q[0].diff(t) - u[0]]
    for i in range(n):
        Bi = I.orientnew(f"B{i}", "Axis", [q[i + 1], I.z])
        Bi.set_ang_vel(I, u[i + 1] * I.z)
        Pi = points[-1].locatenew(f"P{i + 1}", l[i] * Bi.x)
        Pi.v2pt_theory(points[-1], I, Bi)
        points.append(Pi)
        particles.append(me.Particle(f"Pa{i + 1}", Pi, m[i + 1]))
        forces.append((Pi, -m[i + 1] * g * I.y))
        kindiffs.append(q[i + 1].diff(t) - u[i + 1])
    kane = me.KanesMethod(I, q_ind=q, u_ind=u, kd_eqs=kindiffs)
    kane.kanes_equations(particles, forces)
    constants = dict(zip([g, *m, *l], [9.81] + [0.4] * (n + 1) + [0.3] * n, strict=True))
    start = dict(zip([*q, *u], [0.0] + [-1.2] * n + [1e-3] * (n + 1), strict=True))
    return Script(kane, constants, start, 1.5, {f: 0.5})


@published("T. R. Kane, D. A. Levinson, Dynamics: Theory and Applications (1985), conical motions")
def conical_pendulum_of_three_links() -> Script:
    beta = me.dynamicsymbols("beta_1:4")
    omega = me.dynamicsymbols("omega_1:4")
    Omega, g = sm.symbols("Omega g")
    m, l, I = sm.symbols("m_1:4"), sm.symbols("l_1:4"), sm.symbols("I_1:4")
    N, A = me.ReferenceFrame("N"), me.ReferenceFrame("A")
    A.orient_axis(N, Omega * t, N.z)  # the plane of the links is driven round
    O = me.Point("O")
    O.set_vel(N, 0)
    joint, bodies, loads = O, [], []
    for k in range(3):
        B = A.orientnew(f"B{k + 1}", "Axis", [beta[k], A.y])
        B.set_ang_vel(A, omega[k] * A.y)
        G = joint.locatenew(f"G{k + 1}", -l[k] / 2 * B.z)
        G.v2pt_theory(joint, N, B)
        end = joint.locatenew(f"P{k + 1}", -l[k] * B.z)
        end.v2pt_theory(joint, N, B)
        bodies.append(me.RigidBody(f"L{k + 1}", G, B, m[k], (me.inertia(B, I[k], I[k], 0), G)))
        loads.append((G, -m[k] * g * N.z))
        joint = end
    kindiffs = [b.diff(t) - w for b, w in zip(beta, omega, strict=True)]
    kane = me.KanesMethod(N, beta, omega, kindiffs)
    kane.kanes_equations(bodies, loads)
    constants = {Omega: 4.0, g: 9.81}
    constants |= dict(zip([*m, *l, *I], [0.5] * 3 + [0.4] * 3 + [0.007] * 3, strict=True))
    start = dict(zip([*beta, *omega], [0.2, 0.3, -0.1, 0.0, 0.0, 0.0], strict=True))
    return Script(kane, constants, start, 3.0)


@published("R. E. Berg, T. S. Marshall, Wilberforce pendulum oscillations, Am. J. Phys. 59 (1991)")
def wilberforce_pendulum() -> Script:
    z, theta = me.dynamicsymbols("z theta")
    m, I, k, delta, eps = sm.symbols("m I k delta epsilon", real=True)
    zd, thetad = z.diff(t), theta.diff(t)
    T = m * zd**2 / 2 + I * thetad**2 / 2
    V = k * z**2 / 2 + delta * theta**2 / 2 + eps * z * theta / 2
    lagrange = me.LagrangesMethod(T - V, sm.Matrix([z, theta]))
    lagrange.form_lagranges_equations()
    constants = {m: 0.4905, I: 1.39e-4, k: 2.8, delta: 7.86e-4, eps: 9.27e-3}
    return Script(lagrange, constants, {z: 0.1, theta: 0.0, zd: 0.0, thetad: 0.0}, 20.0)


@published(
    "M. W. Spong, P. Corke, R. Lozano, Nonlinear control of the Reaction Wheel Pendulum (2001)"
)
def reaction_wheel_pendulum() -> Script:
    q1, q2, tau = me.dynamicsymbols("q1 q2 tau")
    m1, m2, lc, l1, I1, I2, g = sm.symbols("m1 m2 lc l1 I1 I2 g")
    N = me.ReferenceFrame("N")
    link, wheel = N.orientnew("A", "Axis", (q1, N.z)), N.orientnew("W", "Axis", (q1 + q2, N.z))
    O = me.Point("O")
    O.set_vel(N, 0)
    C, P = O.locatenew("C", lc * link.x), O.locatenew("P", l1 * link.x)
    C.v2pt_theory(O, N, link)
    P.v2pt_theory(O, N, link)
    bodies = [
        me.RigidBody("link", C, link, m1, (me.inertia(link, 0, 0, I1), C)),
        me.RigidBody("wheel", P, wheel, m2, (me.inertia(wheel, 0, 0, I2), P)),
    ]
    for body in bodies:
        body.potential_energy = body.mass * g * body.masscenter.pos_from(O).dot(N.y)
    lagrange = me.LagrangesMethod(
        me.Lagrangian(N, *bodies), [q1, q2], forcelist=[(wheel, tau * N.z), (link, -tau * N.z)],
        frame=N,
    )  # fmt: skip
    lagrange.form_lagranges_equations()
    constants = {m1: 0.2, m2: 0.26, lc: 0.06, l1: 0.12, I1: 8e-4, I2: 2.2e-4, g: 9.81}
    start = {q1: -0.8, q2: 0.0, q1.diff(t): 0.0, q2.diff(t): 0.0}
    return Script(lagrange, constants, start, 3.0, {tau: 0.02})
