"""What rolls and skates: discs, spheres, sleighs and boards."""

from __future__ import annotations

import sympy as sm
import sympy.physics.mechanics as me

from .script import Script, published

t = me.dynamicsymbols._t


@published("T. R. Kane, D. A. Levinson, Dynamics: Theory and Applications (1985): rolling disc")
def rolling_disc() -> Script:
    q1, q2, q3, u1, u2, u3 = me.dynamicsymbols("q1 q2 q3 u1 u2 u3")
    r, m, g = sm.symbols("r m g")
    N = me.ReferenceFrame("N")
    Y = N.orientnew("Y", "Axis", [q1, N.z])
    L = Y.orientnew("L", "Axis", [q2, Y.x])
    R = L.orientnew("R", "Axis", [q3, L.y])
    w_R_N_qd = R.ang_vel_in(N)
    R.set_ang_vel(N, u1 * L.x + u2 * L.y + u3 * L.z)
    C = me.Point("C")
    C.set_vel(N, 0)
    Dmc = C.locatenew("Dmc", r * L.z)
    Dmc.v2pt_theory(C, N, R)
    inertia = me.inertia(L, m / 4 * r**2, m / 2 * r**2, m / 4 * r**2)
    kd = [me.dot(R.ang_vel_in(N) - w_R_N_qd, uv) for uv in L]
    disc = me.RigidBody("BodyD", Dmc, R, m, (inertia, Dmc))
    kane = me.KanesMethod(N, q_ind=[q1, q2, q3], u_ind=[u1, u2, u3], kd_eqs=kd)
    kane.kanes_equations(bodies=[disc], loads=[(Dmc, -m * g * Y.z)])
    start = {q1: 0.0, q2: 0.15, q3: 0.0, u1: 0.0, u2: 9.0, u3: 0.4}
    return Script(kane, {r: 0.3, m: 2.0, g: 9.81}, start, 3.0)


@published(
    "J. I. Neimark, N. A. Fufaev, Dynamics of Nonholonomic Systems (1972): disc, multipliers"
)
def rolling_disc_by_lagrange() -> Script:
    x, y, psi, theta, phi = q = me.dynamicsymbols("x y psi theta phi")
    m, R, A, C, g = sm.symbols("m R A C g")
    xd, yd, psid, thetad, phid = (c.diff(t) for c in q)
    # the centre stands R cos(theta) above the plane, x and y are those of the point of contact
    xc = x - R * sm.sin(theta) * sm.sin(psi)
    yc = y + R * sm.sin(theta) * sm.cos(psi)
    zc = R * sm.cos(theta)
    T = m / 2 * (xc.diff(t) ** 2 + yc.diff(t) ** 2 + zc.diff(t) ** 2)
    T += A / 2 * (thetad**2 + psid**2 * sm.cos(theta) ** 2)
    T += C / 2 * (phid + psid * sm.sin(theta)) ** 2
    nonholonomic = [xd - R * phid * sm.cos(psi), yd - R * phid * sm.sin(psi)]
    lagrange = me.LagrangesMethod(T - m * g * zc, list(q), nonhol_coneqs=nonholonomic)
    lagrange.form_lagranges_equations()
    constants = {m: 2.0, R: 0.3, A: 0.045, C: 0.09, g: 9.81}
    start = {x: 0, y: 0, psi: 0.2, theta: 0.1, phi: 0.0, psid: 0.6, thetad: 0.1, phid: 8.0}
    return Script(lagrange, constants, start, 3.0)


@published("W. Weckesser, A ball rolling on a freely spinning turntable, Am. J. Phys. 65 (1997)")
def ball_on_a_turntable() -> Script:
    x, y, phi = me.dynamicsymbols("x y phi")
    vx, vy, w1, w2, w3, Omega = me.dynamicsymbols("v_x v_y w1 w2 w3 Omega")
    e0, e1, e2, e3 = me.dynamicsymbols("e0:4")
    m, a, k, I_t = sm.symbols("m a k I_t")
    N, B, T = (me.ReferenceFrame(name) for name in "NBT")
    B.orient_quaternion(N, (e0, e1, e2, e3))
    T.orient_axis(N, phi, N.z)
    kd = me.kinematic_equations([w1, w2, w3], [e0, e1, e2, e3], "quaternion")
    B.set_ang_vel(N, w1 * B.x + w2 * B.y + w3 * B.z)
    T.set_ang_vel(N, Omega * N.z)
    O, G = me.Point("O"), me.Point("G")
    O.set_vel(N, 0)
    G.set_pos(O, x * N.x + y * N.y + a * N.z)
    G.set_vel(N, vx * N.x + vy * N.y)
    contact = G.vel(N) + B.ang_vel_in(N).cross(-a * N.z)
    slip = contact - T.ang_vel_in(N).cross(x * N.x + y * N.y)
    ball = me.RigidBody("ball", G, B, m, (me.inertia(B, *[k * m * a**2] * 3), G))
    table = me.RigidBody("table", O, T, 1, (me.inertia(T, 0, 0, I_t), O))
    kane = me.KanesMethod(
        N,
        q_ind=[x, y, phi, e0, e1, e2, e3],
        u_ind=[vx, vy, w3, Omega],
        kd_eqs=[x.diff(t) - vx, y.diff(t) - vy, phi.diff(t) - Omega, *kd],
        u_dependent=[w1, w2],
        velocity_constraints=[slip.dot(N.x), slip.dot(N.y)],
    )
    kane.kanes_equations([ball, table], [])
    # Not the identity: there SymPy's dependent speeds are 0/0.
    start = {x: 0.2, y: 0.0, phi: 0.0, e0: 0.7, e1: 0.1, e2: 0.5, e3: 0.5}
    start |= {vx: 0.0, vy: 0.1, w3: 0.0, Omega: 3.0}
    return Script(kane, {m: 0.1, a: 0.02, k: 0.4, I_t: 0.05}, start, 4.0)


@published("A. M. Bloch, Nonholonomic Mechanics and Control (2003): the Chaplygin sleigh")
def chaplygin_sleigh() -> Script:
    x, y, theta = me.dynamicsymbols("x y theta")
    v, w, omega = me.dynamicsymbols("v w omega")
    m, I, a = sm.symbols("m I a")
    N, B = me.ReferenceFrame("N"), me.ReferenceFrame("B")
    B.orient_axis(N, theta, N.z)
    B.set_ang_vel(N, omega * N.z)
    O, A = me.Point("O"), me.Point("A")
    O.set_vel(N, 0)
    A.set_pos(O, x * N.x + y * N.y)
    A.set_vel(N, v * B.x + w * B.y)  # speeds along the blade and across it
    G = A.locatenew("G", a * B.x)
    G.v2pt_theory(A, N, B)
    way = A.pos_from(O).dt(N) - A.vel(N)
    kd = [way.dot(B.x), way.dot(B.y), theta.diff(t) - omega]
    sleigh = me.RigidBody("sleigh", G, B, m, (me.inertia(B, 0, 0, I), G))
    kane = me.KanesMethod(
        N, [x, y, theta], [v, omega], kd, u_dependent=[w], velocity_constraints=[w]
    )
    kane.kanes_equations([sleigh])
    start = {x: 0.0, y: 0.0, theta: 0.3, v: 1.0, omega: 2.0}
    return Script(kane, {m: 1.5, I: 0.2, a: 0.3}, start, 6.0)


@published("J. Ostrowski et al., Nonholonomic mechanics and locomotion: the snakeboard (1994)")
def snakeboard() -> Script:
    x, y, theta, psi, phi = q = me.dynamicsymbols("x y theta psi phi")
    m, J, Jr, Jw, l = sm.symbols("m J J_r J_w l")
    tpsi, tphi = me.dynamicsymbols("tau_psi tau_phi")
    qd = [c.diff(t) for c in q]
    T = m / 2 * (qd[0] ** 2 + qd[1] ** 2) + J / 2 * qd[2] ** 2
    T += Jr / 2 * (qd[2] + qd[3]) ** 2
    T += Jw / 2 * ((qd[2] + qd[4]) ** 2 + (qd[2] - qd[4]) ** 2)
    s, c = sm.sin, sm.cos
    wheels = [
        -s(theta + phi) * qd[0] + c(theta + phi) * qd[1] + l * c(phi) * qd[2],
        -s(theta - phi) * qd[0] + c(theta - phi) * qd[1] - l * c(phi) * qd[2],
    ]
    N = me.ReferenceFrame("N")
    rotor, trucks = N.orientnew("R", "Axis", (psi, N.z)), N.orientnew("F", "Axis", (phi, N.z))
    lagrange = me.LagrangesMethod(
        T, list(q), nonhol_coneqs=wheels, frame=N,
        forcelist=[(rotor, tpsi * N.z), (trucks, tphi * N.z)],
    )  # fmt: skip
    lagrange.form_lagranges_equations()
    constants = {m: 6.0, J: 0.08, Jr: 0.06, Jw: 0.01, l: 0.2}
    start = {x: 0, y: 0, theta: 0, psi: 0, phi: 0.3, qd[2]: 0.5, qd[3]: 0.4, qd[4]: 0.1}
    pushes = {tpsi: 0.1, tphi: -0.005}
    return Script(lagrange, constants, start, 3.0, pushes)


@published("P. S. Krishnaprasad, D. P. Tsakiris, ... a study of the Roller Racer (2001)")
def roller_racer() -> Script:
    x, y, theta, phi = me.dynamicsymbols("x y theta phi")
    u1, u2, u3, u4, tau = me.dynamicsymbols("u1 u2 u3 u4 tau")
    m1, I1, I2, d1, d2 = sm.symbols("m1 I1 I2 d1 d2")
    N = me.ReferenceFrame("N")
    A = N.orientnew("A", "Axis", [theta, N.z])
    B = A.orientnew("B", "Axis", [phi, A.z])
    A.set_ang_vel(N, u3 * N.z)
    B.set_ang_vel(A, u4 * A.z)
    O = me.Point("O")
    O.set_vel(N, 0)
    P1 = O.locatenew("P1", x * N.x + y * N.y)  # middle of the rear axle
    P1.set_vel(N, u1 * N.x + u2 * N.y)
    pivot = P1.locatenew("J", d1 * A.x)
    pivot.v2pt_theory(P1, N, A)
    P2 = pivot.locatenew("P2", -d2 * B.x)
    P2.v2pt_theory(pivot, N, B)
    bodies = [
        me.RigidBody("seat", P1, A, m1, (me.inertia(A, 0, 0, I1), P1)),
        me.RigidBody("handle", P2, B, sm.S.Zero, (me.inertia(B, 0, 0, I2), P2)),
    ]
    kane = me.KanesMethod(
        N,
        [x, y, theta, phi],
        [u3, u4],
        kd_eqs=[x.diff(t) - u1, y.diff(t) - u2, theta.diff(t) - u3, phi.diff(t) - u4],
        u_dependent=[u1, u2],
        velocity_constraints=[P1.vel(N).dot(A.y), P2.vel(N).dot(B.y)],
    )
    kane.kanes_equations(bodies, [(B, tau * N.z), (A, -tau * N.z)])
    constants = {m1: 20.0, I1: 1.0, I2: 0.1, d1: 0.6, d2: 0.2}
    # Not theta = 0: there SymPy's dependent speeds are 0/0.
    start = {x: 0.0, y: 0.0, theta: 0.3, phi: 1.0, u3: 0.6, u4: 0.5}
    return Script(kane, constants, start, 1.5, {tau: 0.05})


@published("D. V. Zenkov, A. M. Bloch, J. E. Marsden, ... the unicycle with rider (2002)")
def unicycle_with_rider() -> Script:
    q1, q2, q3, q4 = me.dynamicsymbols("q1:5")  # heading, lean, roll, rider's swing across
    u1, u2, u3, u4 = me.dynamicsymbols("u1:5")
    r, m, M, l, g, k = sm.symbols("r m M l g k")
    N = me.ReferenceFrame("N")
    A = N.orientnew("A", "Axis", [q1, N.z])
    B = A.orientnew("B", "Axis", [q2, A.x])
    W = B.orientnew("W", "Axis", [q3, B.y])
    R = B.orientnew("R", "Axis", [q4, B.x])
    A.set_ang_vel(N, u1 * A.z)
    B.set_ang_vel(A, u2 * A.x)
    W.set_ang_vel(B, u3 * B.y)
    R.set_ang_vel(B, u4 * B.x)
    contact = me.Point("contact")
    contact.set_vel(N, 0)
    centre = contact.locatenew("centre", r * B.z)
    centre.v2pt_theory(contact, N, W)
    rider = centre.locatenew("rider", l * R.z)
    rider.v2pt_theory(centre, N, R)
    wheel_inertia = me.inertia(B, m * r**2 / 4, m * r**2 / 2, m * r**2 / 4)
    wheel = me.RigidBody("wheel", centre, W, m, (wheel_inertia, centre))
    body = me.Particle("rider", rider, M)
    kd = [q.diff(t) - u for q, u in zip([q1, q2, q3, q4], [u1, u2, u3, u4], strict=True)]
    kane = me.KanesMethod(N, [q1, q2, q3, q4], [u1, u2, u3, u4], kd)
    loads = [(centre, -m * g * N.z), (rider, -M * g * N.z)]
    loads += [(R, -k * q4 * B.x), (B, k * q4 * B.x)]
    kane.kanes_equations([wheel, body], loads)
    constants = {r: 0.3, m: 5.0, M: 10.0, l: 0.4, g: 9.81, k: 60.0}
    start = {q1: 0, q2: 0.02, q3: 0, q4: 0.05, u1: 0.1, u2: 0.0, u3: 12.0, u4: 0.0}
    return Script(kane, constants, start, 1.0)


@published("K. Pathak, J. Franch, S. K. Agrawal, ... wheeled inverted pendulum (2005)")
def wheeled_inverted_pendulum() -> Script:
    x, y, th, al, p1, p2 = me.dynamicsymbols("x_0 y_0 theta alpha phi_r phi_l")
    vx, vy, w, a, w1, w2 = me.dynamicsymbols("v_x v_y omega alphad omega_r omega_l")
    T1, T2 = me.dynamicsymbols("tau_r tau_l")
    Mb, Mw, R, b, cz, Ixx, Iyy, Izz, Iw, Id, g = sm.symbols("M_b M_w R b c_z I_x I_y I_z I_w I_d g")
    N = me.ReferenceFrame("N")
    H = N.orientnew("H", "Axis", [th, N.z])
    B = H.orientnew("B", "Axis", [al, H.y])
    H.set_ang_vel(N, w * N.z)
    B.set_ang_vel(H, a * H.y)
    O = me.Point("O")
    O.set_vel(N, 0)
    axle = O.locatenew("axle", x * N.x + y * N.y + R * N.z)
    axle.set_vel(N, vx * N.x + vy * N.y)
    G = axle.locatenew("G", cz * B.z)
    G.v2pt_theory(axle, N, B)
    bodies = [me.RigidBody("body", G, B, Mb, (me.inertia(B, Ixx, Iyy, Izz), G))]
    loads, slips = [(G, -Mb * g * N.z)], [axle.vel(N).dot(H.y)]
    for side, angle, rate, torque in ((-1, p1, w1, T1), (1, p2, w2, T2)):
        W = H.orientnew(f"W{side}", "Axis", [angle, H.y])
        W.set_ang_vel(H, rate * H.y)
        C = axle.locatenew(f"C{side}", side * b * H.y)
        C.v2pt_theory(axle, N, H)
        bodies.append(me.RigidBody(f"wheel{side}", C, W, Mw, (me.inertia(H, Id, Iw, Id), C)))
        loads += [(W, torque * H.y), (B, -torque * H.y)]
        slips.append(C.vel(N).dot(H.x) - R * rate)
    q, u = [x, y, th, al, p1, p2], [vx, vy, w, a, w1, w2]
    kane = me.KanesMethod(
        N, q, [a, w1, w2], [c.diff(t) - s for c, s in zip(q, u, strict=True)],
        u_dependent=[vx, vy, w], velocity_constraints=slips,
    )  # fmt: skip
    kane.kanes_equations(bodies, loads)
    constants = {
        Mb: 35.0,
        Mw: 5.0,
        R: 0.25,
        b: 0.2,
        cz: 0.3,
        Ixx: 2.1,
        Iyy: 1.9,
        Izz: 1.6,
        Iw: 0.16,
        Id: 0.08,
        g: 9.81,
    }
    start = {x: 0, y: 0, th: 0.1, al: 0.05, p1: 0, p2: 0, a: 0.0, w1: 2.0, w2: 2.4}
    return Script(kane, constants, start, 1.0, {T1: 0.8, T2: 0.7})


@published("J. Hauser, S. Sastry, P. Kokotovic, ... the ball and beam example (1992)")
def ball_and_beam() -> Script:
    r, theta, rdot, omega, tau = me.dynamicsymbols("r theta v omega tau")
    M, R, Jb, J, G = sm.symbols("M R J_b J G")
    N = me.ReferenceFrame("N")
    A = N.orientnew("A", "Axis", (theta, N.z))
    A.set_ang_vel(N, omega * N.z)
    O = me.Point("O")
    O.set_vel(N, 0)
    P = O.locatenew("P", r * A.x)
    P.set_vel(A, rdot * A.x)
    P.v1pt_theory(O, N, A)
    ball_frame = me.ReferenceFrame("S")
    ball_frame.orient_axis(A, -r / R, A.z)
    ball_frame.set_ang_vel(A, -rdot / R * A.z)
    beam = me.RigidBody("beam", O, A, 1, (me.inertia(A, 0, 0, J), O))
    ball = me.RigidBody("ball", P, ball_frame, M, (me.inertia(ball_frame, Jb, Jb, Jb), P))
    kane = me.KanesMethod(N, [r, theta], [rdot, omega], [r.diff() - rdot, theta.diff() - omega])
    kane.kanes_equations([beam, ball], [(P, -M * G * N.y), (A, tau * N.z)])
    constants = {M: 0.05, R: 0.01, Jb: 2e-6, J: 0.02, G: 9.81}
    start = {r: 0.1, theta: 0.05, rdot: 0.0, omega: 0.0}
    return Script(kane, constants, start, 1.0, {tau: 0.05})
