"""Cranes, Atwood's machines, a trebuchet, beads on hoops and wires, bodies in fluids."""

from __future__ import annotations

from math import cos

import sympy as sm
import sympy.physics.mechanics as me

from .script import Script, published

t = me.dynamicsymbols._t


@published("H.-H. Lee, Modeling and control of a three-dimensional overhead crane (1998)")
def gantry_crane_with_hoisting() -> Script:
    x, y, l, th_x, th_y = q = me.dynamicsymbols("x y l theta_x theta_y")
    u = me.dynamicsymbols("u_x u_y u_l omega_x omega_y")
    fx, fy, fl = me.dynamicsymbols("f_x f_y f_l")
    mx, my, ml, m, Dx, Dy, Dl, g = sm.symbols("m_x m_y m_l m D_x D_y D_l g")
    N = me.ReferenceFrame("N")
    A = N.orientnew("A", "Axis", (th_x, -N.y))
    B = A.orientnew("B", "Axis", (th_y, A.x))
    O = me.Point("O")
    O.set_vel(N, 0)
    girder, trolley = O.locatenew("girder", y * N.y), O.locatenew("trolley", x * N.x + y * N.y)
    girder.set_vel(N, u[1] * N.y)
    trolley.set_vel(N, u[0] * N.x + u[1] * N.y)
    A.set_ang_vel(N, -u[3] * N.y)
    B.set_ang_vel(A, u[4] * A.x)
    load = trolley.locatenew("load", -l * B.z)
    load.set_vel(B, -u[2] * B.z)
    trolley.set_vel(B, 0)
    load.v1pt_theory(trolley, N, B)
    bodies = [
        me.Particle("girder", girder, my),
        me.Particle("trolley", trolley, mx),
        me.Particle("load", load, m),
    ]
    loads = [
        (trolley, (fx - Dx * u[0]) * N.x + (fy - Dy * u[1]) * N.y + (fl - Dl * u[2]) * B.z),
        (load, -(fl - Dl * u[2]) * B.z - m * g * N.z),
    ]
    kane = me.KanesMethod(N, q, u, [c.diff(t) - s for c, s in zip(q, u, strict=True)])
    kane.kanes_equations(bodies, loads)
    constants = {mx: 5.0, my: 7.0, ml: 2.0, m: 3.0, Dx: 2.0, Dy: 3.0, Dl: 1.0, g: 9.81}
    start = dict.fromkeys([*q, *u], 0.0) | {l: 1.0, th_x: 0.2, th_y: -0.1}
    inputs = {fx: 2.0, fy: 1.5, fl: -28.5}
    return Script(kane, constants, start, 2.0, inputs)


@published("H. M. Omar, A. H. Nayfeh, Gain scheduling feedback control for tower cranes (2003)")
def tower_crane() -> Script:
    gamma, r, phi, theta = me.dynamicsymbols("gamma r phi theta")
    T, F = me.dynamicsymbols("T F")
    M, m, J, L, g = sm.symbols("M m J_0 L g")
    N = me.ReferenceFrame("N")
    jib = N.orientnew("jib", "Axis", (gamma, N.z))
    O = me.Point("O")
    O.set_vel(N, 0)
    trolley = O.locatenew("trolley", r * jib.x)
    swing = sm.cos(theta) * sm.sin(phi) * jib.x + sm.sin(theta) * jib.y
    load = trolley.locatenew("load", L * (swing - sm.cos(theta) * sm.cos(phi) * jib.z))
    tower = me.RigidBody("tower", O, jib, 1, (me.inertia(jib, 0, 0, J), O))
    parts = [tower]
    for point, mass in ((trolley, M), (load, m)):
        point.set_vel(N, point.pos_from(O).dt(N))
        parts.append(me.Particle(point.name, point, mass))
    parts[-1].potential_energy = m * g * load.pos_from(O).dot(N.z)
    q = [gamma, r, phi, theta]
    lagrange = me.LagrangesMethod(
        me.Lagrangian(N, *parts), q, forcelist=[(jib, T * N.z), (trolley, F * jib.x)],
        frame=N,
    )  # fmt: skip
    lagrange.form_lagranges_equations()
    constants = {M: 0.8, m: 0.5, J: 1.2, L: 1.0, g: 9.81}
    start = {s: 0.0 for c in q for s in (c, c.diff(t))}
    start |= {r: 0.7, phi: 0.2, gamma.diff(t): 0.5}
    return Script(lagrange, constants, start, 2.0, {T: 0.1, F: -0.2})


@published("D. Kim, W. Singhose, Performance ... driving double-pendulum bridge cranes (2010)")
def double_pendulum_crane() -> Script:
    th, ph, w1, w2 = me.dynamicsymbols("theta phi omega_1 omega_2")
    mh, mp, L1, L2, g = sm.symbols("m_h m_p L_1 L_2 g")
    a = me.dynamicsymbols("a")  # the trolley's acceleration is what the driver commands
    N = me.ReferenceFrame("N")
    A, B = N.orientnew("A", "Axis", (th, N.z)), N.orientnew("B", "Axis", (ph, N.z))
    A.set_ang_vel(N, w1 * N.z)
    B.set_ang_vel(N, w2 * N.z)
    T = me.Point("T")
    T.set_vel(N, 0)
    hook = T.locatenew("hook", -L1 * A.y)
    load = hook.locatenew("load", -L2 * B.y)
    hook.v2pt_theory(T, N, A)
    load.v2pt_theory(hook, N, B)
    bodies = [me.Particle("hook", hook, mh), me.Particle("load", load, mp)]
    loads = [(hook, -mh * (g * N.y + a * N.x)), (load, -mp * (g * N.y + a * N.x))]
    kane = me.KanesMethod(N, [th, ph], [w1, w2], [th.diff(t) - w1, ph.diff(t) - w2])
    kane.kanes_equations(bodies, loads)
    constants = {mh: 0.6, mp: 1.0, L1: 1.5, L2: 0.4, g: 9.81}
    return Script(
        kane,
        constants,
        {th: 0.1, ph: 0.2, w1: 0.0, w2: 0.0},
        3.0,
        {a: lambda time: 0.4 * cos(time)},
    )


@published("N. B. Tufillaro et al., Swinging Atwood's machine, Am. J. Phys. 52 (1984)")
def swinging_atwood_machine() -> Script:
    r, theta = me.dynamicsymbols("r theta")
    M, m, g = sm.symbols("M m g")
    rd, thetad = r.diff(t), theta.diff(t)
    L = (M + m) * rd**2 / 2 + m * r**2 * thetad**2 / 2 - g * r * (M - m * sm.cos(theta))
    lagrange = me.LagrangesMethod(L, [r, theta])
    lagrange.form_lagranges_equations()
    start = {r: 1.0, theta: 1.5, rd: 0.0, thetad: 0.0}
    return Script(lagrange, {M: 3.0, m: 1.0, g: 9.81}, start, 3.0)


@published("M. Denny, Siege engine dynamics, Eur. J. Phys. 26 (2005): trebuchet with a sling")
def trebuchet() -> Script:
    theta, phi, psi = me.dynamicsymbols("theta phi psi")
    w1, w2, w3 = me.dynamicsymbols("omega_1:4")
    M, m, mb, L1, L2, Lc, Ls, g = sm.symbols("M m m_b L_1 L_2 L_c L_s g")
    N = me.ReferenceFrame("N")
    beam, box, sling = (me.ReferenceFrame(n) for n in ("beam", "box", "sling"))
    for frame, angle, rate in ((beam, theta, w1), (box, phi, w2), (sling, psi, w3)):
        frame.orient_axis(N, angle, N.z)
        frame.set_ang_vel(N, rate * N.z)
    axle = me.Point("axle")
    axle.set_vel(N, 0)
    short, long = axle.locatenew("short", L1 * beam.x), axle.locatenew("long", -L2 * beam.x)
    G = axle.locatenew("G", (L1 - L2) / 2 * beam.x)
    for point in (short, long, G):
        point.v2pt_theory(axle, N, beam)
    counterweight = short.locatenew("counterweight", -Lc * box.y)
    counterweight.v2pt_theory(short, N, box)
    stone = long.locatenew("stone", Ls * sling.x)
    stone.v2pt_theory(long, N, sling)
    Ib = mb * (L1 + L2) ** 2 / 12
    bodies = [
        me.RigidBody("beam", G, beam, mb, (me.inertia(beam, 0, 0, Ib), G)),
        me.Particle("counterweight", counterweight, M),
        me.Particle("stone", stone, m),
    ]
    loads = [(b.masscenter, -b.mass * g * N.y) for b in bodies]
    q, u = [theta, phi, psi], [w1, w2, w3]
    kane = me.KanesMethod(N, q, u, [c.diff(t) - s for c, s in zip(q, u, strict=True)])
    kane.kanes_equations(bodies, loads)
    constants = {M: 1000.0, m: 10.0, mb: 60.0, L1: 1.0, L2: 4.0, Lc: 0.8, Ls: 3.0, g: 9.81}
    start = {theta: 0.8, phi: 0.0, psi: 0.1, w1: 0.0, w2: 0.0, w3: 0.0}
    return Script(kane, constants, start, 0.8)


@published("A. Pecori, G. Torzo, The Maxwell wheel investigated with MBL, Phys. Teach. 36 (1998)")
def maxwell_wheel() -> Script:
    y, theta, v, omega, T = me.dynamicsymbols("y theta v omega T")
    m, I, r, g = sm.symbols("m I r g")
    N = me.ReferenceFrame("N")
    W = N.orientnew("W", "Axis", (theta, N.z))
    W.set_ang_vel(N, omega * N.z)
    O = me.Point("O")
    O.set_vel(N, 0)
    G = O.locatenew("G", -y * N.y)
    G.set_vel(N, -v * N.y)
    wheel = me.RigidBody("wheel", G, W, m, (me.inertia(W, 0, 0, I), G))
    # y = r theta: the string unwinds; given by its rate, and the positions with it
    kane = me.KanesMethod(
        N, [theta], [omega], [y.diff() - v, theta.diff() - omega], q_dependent=[y], u_dependent=[v],
        configuration_constraints=[y - r * theta], velocity_constraints=[v - r * omega],
    )  # fmt: skip
    kane.kanes_equations([wheel], [(G, -m * g * N.y), (W, T * N.z)])
    constants = {m: 0.5, I: 1.1e-3, r: 3e-3, g: 9.81}
    return Script(kane, constants, {theta: 0.0, omega: 0.0}, 2.0, {T: -1e-4})


@published("S. H. Strogatz, Nonlinear Dynamics and Chaos (1994), section 3.5: bead on a hoop")
def bead_on_a_rotating_hoop() -> Script:
    phi, u = me.dynamicsymbols("phi u")
    m, r, b, omega, g = sm.symbols("m r b omega g")
    N = me.ReferenceFrame("N")
    hoop = N.orientnew("H", "Axis", (omega * t, N.z))
    arm = hoop.orientnew("A", "Axis", (phi, -hoop.y))
    arm.set_ang_vel(hoop, -u * hoop.y)
    O = me.Point("O")
    O.set_vel(N, 0)
    P = O.locatenew("P", -r * arm.z)
    P.v2pt_theory(O, N, arm)
    O.set_vel(hoop, 0)
    P.v2pt_theory(O, hoop, arm)
    kane = me.KanesMethod(N, [phi], [u], [phi.diff(t) - u])
    kane.kanes_equations([me.Particle("bead", P, m)], [(P, -m * g * N.z - b * P.vel(hoop))])
    constants = {m: 0.02, r: 0.3, b: 0.01, omega: 8.0, g: 9.81}
    return Script(kane, constants, {phi: 0.05, u: 0.0}, 5.0)


@published("S. W. Shaw, A. G. Haddow, On 'roller-coaster' experiments, Nonlinear Dynamics 3 (1992)")
def bead_on_a_wire() -> Script:
    x, u, F = me.dynamicsymbols("x u F")
    m, alpha, beta, g, c = sm.symbols("m alpha beta g c")
    N, O, P = me.ReferenceFrame("N"), me.Point("O"), me.Point("P")
    O.set_vel(N, 0)
    profile = beta * x**4 - alpha * x**2
    P.set_pos(O, x * N.x + profile * N.y)
    P.set_vel(N, u * N.x + profile.diff(x) * u * N.y)
    kane = me.KanesMethod(N, [x], [u], [x.diff(t) - u])
    kane.kanes_equations([me.Particle("bead", P, m)], [(P, -m * g * N.y + (F - c * u) * N.x)])
    constants = {m: 0.1, alpha: 0.5, beta: 0.6, g: 9.81, c: 0.02}
    return Script(kane, constants, {x: 0.2, u: 0.5}, 3.0, {F: 0.05})


@published("G. W. Parker, Projectile motion with air resistance quadratic in the speed (1977)")
def projectile_with_drag() -> Script:
    x, y, vx, vy = me.dynamicsymbols("x y v_x v_y")
    m, k, g = sm.symbols("m k g")
    N, O, P = me.ReferenceFrame("N"), me.Point("O"), me.Point("P")
    O.set_vel(N, 0)
    P.set_pos(O, x * N.x + y * N.y)
    P.set_vel(N, vx * N.x + vy * N.y)
    drag = -k * P.vel(N).magnitude() * P.vel(N)
    kane = me.KanesMethod(N, [x, y], [vx, vy], [x.diff() - vx, y.diff() - vy])
    kane.kanes_equations([me.Particle("shell", P, m)], [(P, drag - m * g * N.y)])
    return Script(kane, {m: 5.0, k: 4e-3, g: 9.81}, {x: 0, y: 0, vx: 60.0, vy: 70.0}, 6.0)


@published(
    "Z. Farkas et al., Frictional coupling between sliding and spinning motion (2003): a puck"
)
def puck_with_dry_friction() -> Script:
    x, y, vx, vy = me.dynamicsymbols("x y v_x v_y")
    m, mu, g, k = sm.symbols("m mu g k", positive=True)
    N, O, P = me.ReferenceFrame("N"), me.Point("O"), me.Point("P")
    O.set_vel(N, 0)
    P.set_pos(O, x * N.x + y * N.y)
    P.set_vel(N, vx * N.x + vy * N.y)
    friction = -mu * m * g * P.vel(N).normalize()
    kane = me.KanesMethod(N, [x, y], [vx, vy], [x.diff() - vx, y.diff() - vy])
    kane.kanes_equations([me.Particle("puck", P, m)], [(P, friction - k * P.pos_from(O))])
    constants = {m: 0.2, mu: 0.1, g: 9.81, k: 1.0}
    return Script(kane, constants, {x: 0.5, y: 0.0, vx: 0.3, vy: 1.5}, 1.0)


@published("R. T. Bupp, D. S. Bernstein, V. T. Coppola, A benchmark problem ... (TORA, 1998)")
def rotational_translational_actuator() -> Script:
    q, theta, N_, F = me.dynamicsymbols("q theta N_m F")
    M, m, k, e, I = sm.symbols("M m k e I")
    qd, thetad = q.diff(t), theta.diff(t)
    T = (M + m) * qd**2 / 2 + m * e * qd * thetad * sm.cos(theta) + (I + m * e**2) * thetad**2 / 2
    frame, O = me.ReferenceFrame("R"), me.Point("O")
    O.set_vel(frame, 0)
    arm = frame.orientnew("arm", "Axis", (theta, frame.z))
    cart = O.locatenew("cart", q * frame.x)
    cart.set_vel(frame, qd * frame.x)
    loads = [(cart, F * frame.x), (arm, N_ * frame.z)]
    lagrange = me.LagrangesMethod(T - k * q**2 / 2, [q, theta], forcelist=loads, frame=frame)
    lagrange.form_lagranges_equations()
    constants = {M: 1.36, m: 0.096, k: 186.3, e: 0.059, I: 2.175e-4}
    start = {q: 0.025, theta: 0.1, qd: 0.0, thetad: 0.0}
    return Script(lagrange, constants, start, 2.0, {N_: 0.002, F: 0.0})


@published("M. W. Spong, Modeling and control of elastic joint robots, ASME J. DSMC 109 (1987)")
def arm_with_an_elastic_joint() -> Script:
    q1, q2, u1, u2, tau = me.dynamicsymbols("q_1 q_2 u_1 u_2 tau")
    I, J, M, L, k, g = sm.symbols("I J M L k g")
    link, motor, base = (me.RigidBody(n) for n in ("link", "motor", "base"))
    link.mass, link.central_inertia = M, me.inertia(link.frame, 0, 0, I)
    motor.mass, motor.central_inertia = 1, me.inertia(motor.frame, 0, 0, J)
    joints = [
        me.PinJoint(
            "arm", base, link, q1, u1, joint_axis=base.frame.z, child_point=-L * link.frame.x
        ),
        me.PinJoint("shaft", base, motor, q2, u2, joint_axis=base.frame.z),
    ]
    system = me.System.from_newtonian(base)
    system.add_joints(*joints)
    system.add_loads(me.Force(link.masscenter, -M * g * base.frame.y))
    spring = k * (q2 - q1) * base.frame.z
    system.add_loads(
        me.Torque(link.frame, spring), me.Torque(motor.frame, tau * base.frame.z - spring)
    )
    system.form_eoms()
    constants = {I: 0.03, J: 0.004, M: 1.0, L: 0.3, k: 31.0, g: 9.81}
    return Script(system, constants, {q1: -1.0, q2: -0.9, u1: 0.0, u2: 0.0}, 2.0, {tau: 0.4})
