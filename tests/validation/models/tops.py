"""Tops and gyroscopes, and what rattles and turns over on a table."""

from __future__ import annotations

import sympy as sm
import sympy.physics.mechanics as me

from .script import Script, published

t = me.dynamicsymbols._t


@published("L. D. Landau, E. M. Lifshitz, Mechanics (1976), section 35, problem 1 (J. L. Lagrange)")
def lagrange_top() -> Script:
    phi, theta, psi = me.dynamicsymbols("phi theta psi")
    I1, I3, mu, g, l = sm.symbols("I_1 I_3 mu g l")
    phid, thetad, psid = me.dynamicsymbols("phi theta psi", 1)
    L = (I1 + mu * l**2) / 2 * (thetad**2 + phid**2 * sm.sin(theta) ** 2)
    L += I3 / 2 * (psid + phid * sm.cos(theta)) ** 2 - mu * g * l * sm.cos(theta)
    lagrange = me.LagrangesMethod(L, [phi, theta, psi])
    lagrange.form_lagranges_equations()
    constants = {I1: 2e-4, I3: 1e-4, mu: 0.2, g: 9.81, l: 0.04}
    start = {phi: 0.0, theta: 0.4, psi: 0.0, phid: 0.0, thetad: 0.0, psid: 180.0}
    return Script(lagrange, constants, start, 1.0)


@published("J. B. Scarborough, The Gyroscope (1958): a gyroscope in gimbals")
def gyroscope_in_gimbals() -> Script:
    q1, q2, q3, u1, u2, u3, T1, T2 = me.dynamicsymbols("q1 q2 q3 u1 u2 u3 T1 T2")
    Ko, Ai, Bi, Ci, A, C, c = sm.symbols("K_o A_i B_i C_i A C c")
    N = me.ReferenceFrame("N")
    outer, inner, rotor = (me.ReferenceFrame(n) for n in ("outer", "inner", "rotor"))
    outer.orient_axis(N, q1, N.z)
    inner.orient_axis(outer, q2, outer.x)
    rotor.orient_axis(inner, q3, inner.y)
    outer.set_ang_vel(N, u1 * N.z)
    inner.set_ang_vel(outer, u2 * outer.x)
    rotor.set_ang_vel(inner, u3 * inner.y)
    O = me.Point("O")
    O.set_vel(N, 0)
    one = sm.S.One
    bodies = [
        me.RigidBody("outer", O, outer, one, (me.inertia(outer, 0, 0, Ko), O)),
        me.RigidBody("inner", O, inner, one, (me.inertia(inner, Ai, Bi, Ci), O)),
        me.RigidBody("rotor", O, rotor, one, (me.inertia(inner, A, C, A), O)),
    ]
    kd = [q1.diff(t) - u1, q2.diff(t) - u2, q3.diff(t) - u3]
    kane = me.KanesMethod(N, [q1, q2, q3], [u1, u2, u3], kd)
    loads = [(outer, (T1 - c * u1) * N.z), (inner, T2 * outer.x), (outer, -T2 * outer.x)]
    kane.kanes_equations(bodies, loads)
    constants = {Ko: 2e-3, Ai: 1e-3, Bi: 1e-3, Ci: 1e-3, A: 8e-4, C: 1.4e-3, c: 1e-3}
    start = {q1: 0.0, q2: 0.3, q3: 0.0, u1: 0.0, u2: 0.0, u3: 120.0}
    return Script(kane, constants, start, 2.0, {T1: 0.01, T2: 0.02})


@published("L. Foucault (1852); R. N. Arnold, L. Maunder, Gyrodynamics (1961): the gyrocompass")
def gyrocompass() -> Script:
    alpha, psi, w, s = me.dynamicsymbols("alpha psi omega s")
    Omega, lam, A, C, c = sm.symbols("Omega lambda A C c")
    N = me.ReferenceFrame("N")
    E = N.orientnew("E", "Axis", (Omega * t, N.z))
    # H.x north, H.y west, H.z up at the latitude lambda
    H = E.orientnew("H", "Axis", (lam - sm.pi / 2, E.y))
    G = H.orientnew("G", "Axis", (alpha, H.z))
    R = G.orientnew("R", "Axis", (psi, G.x))
    G.set_ang_vel(H, w * H.z)
    R.set_ang_vel(G, s * G.x)
    O = me.Point("O")
    O.set_vel(N, 0)
    rotor = me.RigidBody("rotor", O, R, 1, (me.inertia(G, C, A, A), O))
    kane = me.KanesMethod(N, [alpha, psi], [w, s], [alpha.diff() - w, psi.diff() - s])
    kane.kanes_equations([rotor], [(G, -c * w * H.z)])
    constants = {Omega: 7.292e-5, lam: 0.9, A: 2e-3, C: 3e-3, c: 1e-5}
    return Script(kane, constants, {alpha: 0.5, psi: 0.0, w: 0.0, s: 2000.0}, 10.0)


@published("T. R. Kane, D. A. Levinson, Realistic mathematical modeling of the rattleback (1982)")
def rattleback() -> Script:
    alpha, beta, gamma = me.dynamicsymbols("alpha beta gamma")
    w1, w2, w3 = me.dynamicsymbols("omega_1:4")
    a, b, c, h, M, g, s = sm.symbols("a b c h M g sigma")
    A, B, C, D = sm.symbols("A B C D")
    N = me.ReferenceFrame("N")
    Y = N.orientnew("Y", "Axis", (gamma, N.z))
    L = Y.orientnew("L", "Axis", (alpha, Y.x))
    R = L.orientnew("R", "Axis", (beta, L.y))
    from_angles = R.ang_vel_in(N)
    R.set_ang_vel(N, w1 * R.x + w2 * R.y + w3 * R.z)
    # the normal of the table in the body says which point of the ellipsoid touches it
    mu = [N.z.dot(axis) for axis in R]
    eps = sm.sqrt((a * mu[0]) ** 2 + (b * mu[1]) ** 2 + (c * mu[2]) ** 2)
    P, O, S = me.Point("P"), me.Point("O"), me.Point("S")
    O.set_pos(
        P, sum((k**2 * x / eps * e for k, x, e in zip((a, b, c), mu, R, strict=True)), 0 * R.x)
    )
    S.set_pos(O, -h * R.z)
    P.set_vel(N, 0)
    O.v2pt_theory(P, N, R)
    S.v2pt_theory(P, N, R)
    stone = me.RigidBody("stone", S, R, M, (me.inertia(R, A, B, C, D), S))
    kd = [(from_angles - R.ang_vel_in(N)).dot(axis) for axis in R]
    kane = me.KanesMethod(N, [alpha, beta, gamma], [w1, w2, w3], kd)
    kane.kanes_equations([stone], [(S, -M * g * N.z), (R, -s * R.ang_vel_in(N))])
    constants = {
        a: 0.2,
        b: 0.03,
        c: 0.02,
        h: 0.01,
        M: 1.0,
        g: 9.81,
        s: 0.0,
        A: 2e-4,
        B: 1.6e-3,
        C: 1.7e-3,
        D: -2e-5,
    }
    start = dict(zip([alpha, beta, gamma, w1, w2, w3], [0.0087, 0.0087, 0, 0, 0, -5], strict=True))
    return Script(kane, constants, start, 0.6)


@published("R. J. Cohen, The tippe top revisited, Am. J. Phys. 45 (1977), friction made smooth")
def tippe_top() -> Script:
    x, y, phi, theta, psi = q = me.dynamicsymbols("x y phi theta psi")
    u = me.dynamicsymbols("u1:6")
    m, R, a, I1, I3, g, mu, v0 = sm.symbols("m R a I_1 I_3 g mu v_0", positive=True)
    N = me.ReferenceFrame("N")
    A = N.orientnew("A", "Axis", (phi, N.z))
    B = A.orientnew("B", "Axis", (theta, A.x))
    T = B.orientnew("T", "Axis", (psi, B.z))
    A.set_ang_vel(N, u[2] * N.z)
    B.set_ang_vel(A, u[3] * A.x)
    T.set_ang_vel(B, u[4] * B.z)
    O = me.Point("O")
    O.set_vel(N, 0)
    centre = O.locatenew("centre", x * N.x + y * N.y + R * N.z)  # of the sphere
    centre.set_vel(N, u[0] * N.x + u[1] * N.y)
    G = centre.locatenew("G", -a * B.z)
    G.v2pt_theory(centre, N, T)
    contact = centre.locatenew("contact", -R * N.z)
    contact.v2pt_theory(centre, N, T)
    slip = contact.vel(N)
    friction = -mu * m * g * slip / sm.sqrt(slip.dot(slip) + v0**2)
    top = me.RigidBody("top", G, T, m, (me.inertia(B, I1, I1, I3), G))
    kane = me.KanesMethod(N, q, u, [c.diff(t) - s for c, s in zip(q, u, strict=True)])
    kane.kanes_equations([top], [(G, -m * g * N.z), (contact, friction)])
    constants = {m: 6e-3, R: 0.015, a: 0.003, I1: 8e-7, I3: 7e-7, g: 9.81, mu: 0.3, v0: 0.01}
    start = dict.fromkeys([*q, *u], 0.0) | {theta: 0.1, u[4]: 150.0}
    return Script(kane, constants, start, 0.3)


@published("A. G. Greenhill, Gyroscope and Gyrostat, Encyclopaedia Britannica (1911): a pendulum")
def gyropendulum() -> Script:
    alpha, beta, spin = me.dynamicsymbols("alpha beta phi")
    m, l, A, C, g = sm.symbols("m l A C g", positive=True)
    ground, frame, stem, rotor = (
        me.RigidBody(name) for name in ("ground", "ring", "stem", "rotor")
    )
    for light in (frame, stem):
        light.mass, light.central_inertia = 0, me.inertia(light.frame, 0, 0, 0)
    rotor.mass, rotor.central_inertia = m, me.inertia(rotor.frame, A, A, C)
    first = me.PinJoint("outer", ground, frame, alpha, joint_axis=ground.frame.x)
    second = me.PinJoint("inner", frame, stem, beta, joint_axis=frame.frame.y)
    third = me.PinJoint(
        "spin", stem, rotor, spin, joint_axis=stem.frame.z, parent_point=-l * stem.frame.z
    )
    system = me.System.from_newtonian(ground)
    system.add_joints(first, second, third)
    system.apply_uniform_gravity(-g * ground.frame.z)
    system.form_eoms()
    u = list(system.u)
    constants = {m: 0.5, l: 0.2, A: 4e-4, C: 7e-4, g: 9.81}
    start = dict(zip([alpha, beta, spin, *u], [0.2, 0.1, 0.0, 0.0, 0.0, 300.0], strict=True))
    return Script(system, constants, start, 2.0)
