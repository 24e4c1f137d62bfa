"""What flies: drones, satellites, tethers, and a cat."""

from __future__ import annotations

import sympy as sm
import sympy.physics.mechanics as me

from .script import Script, published

t = me.dynamicsymbols._t


@published(
    "J. Hauser, S. Sastry, G. Meyer, Nonlinear control design for slightly non-minimum (1992)"
)
def planar_aircraft() -> Script:
    x, y, theta, vx, vy, w, u1, u2 = me.dynamicsymbols("x y theta v_x v_y omega u_1 u_2")
    m, J, eps, g = sm.symbols("m J epsilon g")
    N = me.ReferenceFrame("N")
    B = N.orientnew("B", "Axis", (theta, N.z))
    B.set_ang_vel(N, w * N.z)
    O = me.Point("O")
    O.set_vel(N, 0)
    G = O.locatenew("G", x * N.x + y * N.y)
    G.set_vel(N, vx * N.x + vy * N.y)
    body = me.RigidBody("aircraft", G, B, m, (me.inertia(B, 0, 0, J), G))
    kd = [x.diff() - vx, y.diff() - vy, theta.diff() - w]
    kane = me.KanesMethod(N, [x, y, theta], [vx, vy, w], kd)
    force = u1 * B.y + eps * u2 * B.x - m * g * N.y
    kane.kanes_equations([body], [(G, force), (B, u2 * N.z)])
    start = {x: 0, y: 1, theta: 0.2, vx: 0.5, vy: 0, w: 0.1}
    thrust = {u1: 9.0, u2: 0.02}
    return Script(kane, {m: 1.0, J: 0.2, eps: 0.1, g: 9.81}, start, 3.0, thrust)


@published("S. Bouabdallah, Design and control of quadrotors (2007): Euler angles")
def quadrotor_by_euler_angles() -> Script:
    x, y, z, phi, theta, psi = q = me.dynamicsymbols("x y z phi theta psi")
    u = me.dynamicsymbols("v_x v_y v_z p q_r r")
    Om = me.dynamicsymbols("Omega_1:5")
    m, Ix, Iy, Iz, l, b, d, kd, g = sm.symbols("m I_x I_y I_z l b d k_d g")
    N = me.ReferenceFrame("N")
    B = N.orientnew("B", "Body", [psi, theta, phi], "321")
    B_qd = B.ang_vel_in(N)
    B.set_ang_vel(N, u[3] * B.x + u[4] * B.y + u[5] * B.z)
    O = me.Point("O")
    O.set_vel(N, 0)
    G = O.locatenew("G", x * N.x + y * N.y + z * N.z)
    G.set_vel(N, u[0] * N.x + u[1] * N.y + u[2] * N.z)
    kdes = [(B_qd - B.ang_vel_in(N)).dot(axis) for axis in B]
    kdes = [q[k].diff(t) - u[k] for k in range(3)] + kdes
    drone = me.RigidBody("drone", G, B, m, (me.inertia(B, Ix, Iy, Iz), G))
    squares = [w**2 for w in Om]
    thrust = b * sum(squares)
    roll, pitch = l * b * (squares[3] - squares[1]), l * b * (squares[2] - squares[0])
    yaw = d * (squares[0] - squares[1] + squares[2] - squares[3])
    loads = [
        (G, thrust * B.z - m * g * N.z - kd * G.vel(N)),
        (B, roll * B.x + pitch * B.y + yaw * B.z),
    ]
    kane = me.KanesMethod(N, q, u, kdes)
    kane.kanes_equations([drone], loads)
    constants = {
        m: 0.65,
        Ix: 7.5e-3,
        Iy: 7.5e-3,
        Iz: 1.3e-2,
        l: 0.23,
        b: 3.13e-5,
        d: 7.5e-7,
        kd: 0.05,
        g: 9.81,
    }
    start = dict.fromkeys([*q, *u], 0.0) | {z: 1.0, phi: 0.1, theta: -0.1, u[3]: 0.2, u[5]: 0.3}
    speeds = dict(zip(Om, (226.0, 226.5, 226.2, 226.0), strict=True))
    return Script(kane, constants, start, 2.0, speeds)


@published(
    "E. Fresk, G. Nikolakopoulos, Full quaternion based attitude control for a quadrotor (2013)"
)
def quadrotor_by_quaternions() -> Script:
    x, y, z = me.dynamicsymbols("x y z")
    e = me.dynamicsymbols("q0:4")
    vx, vy, vz, wx, wy, wz = me.dynamicsymbols("v_x v_y v_z w_x w_y w_z")
    T, tx, ty, tz = me.dynamicsymbols("T tau_x tau_y tau_z")
    m, Ix, Iy, Iz, g = sm.symbols("m I_x I_y I_z g", positive=True)
    N, B = me.ReferenceFrame("N"), me.ReferenceFrame("B")
    B.orient(N, "Quaternion", e)
    B.set_ang_vel(N, wx * B.x + wy * B.y + wz * B.z)
    O, G = me.Point("O"), me.Point("G")
    O.set_vel(N, 0)
    G.set_pos(O, x * N.x + y * N.y + z * N.z)
    G.set_vel(N, vx * N.x + vy * N.y + vz * N.z)
    drone = me.RigidBody("drone", G, B, m, (me.inertia(B, Ix, Iy, Iz), G))
    kd = [x.diff(t) - vx, y.diff(t) - vy, z.diff(t) - vz]
    kd += me.kinematic_equations([wx, wy, wz], e, "Quaternion")
    kane = me.KanesMethod(N, [x, y, z, *e], [vx, vy, vz, wx, wy, wz], kd)
    loads = [(G, T * B.z - m * g * N.z), (B, tx * B.x + ty * B.y + tz * B.z)]
    kane.kanes_equations([drone], loads)
    constants = {m: 1.2, Ix: 0.014, Iy: 0.015, Iz: 0.026, g: 9.81}
    start = dict.fromkeys([x, y, z, *e, vx, vy, vz], 0.0)
    start |= {e[0]: 1.0, wx: 0.4, wy: -0.2, wz: 1.0}
    inputs = {T: 11.9, tx: 0.001, ty: 0.0, tz: 0.002}
    return Script(kane, constants, start, 3.0, inputs)


@published(
    "E. Fresk, G. Nikolakopoulos (2013), the same with the quaternion's norm as a constraint"
)
def quadrotor_with_its_norm_as_a_constraint() -> Script:
    """q0 and its rate u0 are dependent; solved for the rates, the equations divide by q0."""
    x, y, z = me.dynamicsymbols("x y z")
    e = me.dynamicsymbols("q0:4")
    vx, vy, vz, wx, wy, wz, u0 = me.dynamicsymbols("v_x v_y v_z w_x w_y w_z u_0")
    m, Ix, Iy, Iz, g, T, d, tx, ty, tz = sm.symbols("m I_x I_y I_z g T d tau_x tau_y tau_z")
    N, B = me.ReferenceFrame("N"), me.ReferenceFrame("B")
    B.orient_quaternion(N, e)
    turning = [w - B.ang_vel_in(N).dot(axis) for w, axis in zip((wx, wy, wz), B, strict=True)]
    turning.append(e[0].diff(t) - u0)
    B.set_ang_vel(N, wx * B.x + wy * B.y + wz * B.z)
    O, G = me.Point("O"), me.Point("G")
    O.set_vel(N, 0)
    G.set_pos(O, x * N.x + y * N.y + z * N.z)
    G.set_vel(N, vx * N.x + vy * N.y + vz * N.z)
    norm = sum(k**2 for k in e) - 1
    rates = sm.solve(turning, [k.diff(t) for k in e])
    kane = me.KanesMethod(
        N, [x, y, z, *e[1:]], [vx, vy, vz, wx, wy, wz],
        [x.diff(t) - vx, y.diff(t) - vy, z.diff(t) - vz, *turning],
        q_dependent=[e[0]], configuration_constraints=[norm],
        u_dependent=[u0], velocity_constraints=[norm.diff(t).subs(rates)],
    )  # fmt: skip
    drone = me.RigidBody("drone", G, B, m, (me.inertia(B, Ix, Iy, Iz), G))
    loads = [(G, T * B.z - m * g * N.z - d * G.vel(N)), (B, tx * B.x + ty * B.y + tz * B.z)]
    kane.kanes_equations([drone], loads)
    constants = {m: 1.2, Ix: 0.014, Iy: 0.015, Iz: 0.026, g: 9.81, T: 11.9, d: 0.1}
    constants |= {tx: 0.001, ty: 0.0, tz: 0.002}
    start = dict.fromkeys([x, y, z, *e[1:], vx, vy, vz, wx, wy, wz], 0.0)
    start |= {wx: 1.4, wy: -0.2, wz: 1.0}
    return Script(kane, constants, start, 1.0, guess={e[0]: 1.0})


@published("K. Sreenath, T. Lee, V. Kumar, ... quadrotor with a cable-suspended load (2013), plane")
def drone_with_a_slung_load() -> Script:
    yl, zl, phi_l, phi_q, f, M = me.dynamicsymbols("y_L z_L phi_L phi_Q f M")
    mq, ml, J, l, g = sm.symbols("m_Q m_L J l g")
    yq, zq = yl - l * sm.sin(phi_l), zl + l * sm.cos(phi_l)
    T = ml / 2 * (yl.diff(t) ** 2 + zl.diff(t) ** 2)
    T += mq / 2 * (yq.diff(t) ** 2 + zq.diff(t) ** 2) + J / 2 * phi_q.diff(t) ** 2
    L = T - g * (ml * zl + mq * zq)
    N = me.ReferenceFrame("N")
    drone = N.orientnew("Q", "Axis", (phi_q, N.x))
    O, Q = me.Point("O"), me.Point("Q")
    O.set_vel(N, 0)
    Q.set_pos(O, yq * N.y + zq * N.z)
    Q.set_vel(N, Q.pos_from(O).dt(N))
    q = [yl, zl, phi_l, phi_q]
    loads = [(Q, f * drone.z), (drone, M * N.x)]
    lagrange = me.LagrangesMethod(L, q, forcelist=loads, frame=N)
    lagrange.form_lagranges_equations()
    constants = {mq: 0.5, ml: 0.087, J: 2.32e-3, l: 1.0, g: 9.81}
    start = {s: 0.0 for c in q for s in (c, c.diff(t))} | {phi_l: 0.4, phi_q: 0.05}
    return Script(lagrange, constants, start, 2.0, {f: 5.76, M: 1e-4})


@published("L. D. Landau, E. M. Lifshitz, Mechanics (1976), section 37 (L. Euler)")
def torque_free_body() -> Script:
    q1, q2, q3, u1, u2, u3 = me.dynamicsymbols("q1 q2 q3 u1 u2 u3")
    I1, I2, I3 = sm.symbols("I1 I2 I3")
    N, B = me.ReferenceFrame("N"), me.ReferenceFrame("B")
    B.orient_body_fixed(N, (q1, q2, q3), "xyz")
    B.set_ang_vel(N, u1 * B.x + u2 * B.y + u3 * B.z)
    G = me.Point("G")
    G.set_vel(N, 0)
    body = me.RigidBody("body", G, B, sm.Symbol("m"), (me.inertia(B, I1, I2, I3), G))
    kd = me.kinematic_equations([u1, u2, u3], [q1, q2, q3], "body", "123")
    kane = me.KanesMethod(N, [q1, q2, q3], [u1, u2, u3], kd)
    kane.kanes_equations([body], None)
    constants = {I1: 1.0, I2: 2.0, I3: 3.0, sm.Symbol("m"): 4.0}
    return Script(kane, constants, {q1: 0, q2: 0.1, q3: 0, u1: 0.01, u2: 1.0, u3: 0.0}, 4.0)


@published("P. W. Likins, Attitude stability criteria for dual spin spacecraft (1967)")
def dual_spin_satellite() -> Script:
    e = me.dynamicsymbols("e0:4")
    sigma, s = me.dynamicsymbols("sigma s")
    w = me.dynamicsymbols("w1:4")
    A, B, C, Js, Jt, motor, c = sm.symbols("A B C J_s J_t T_m c")
    N, P, R = (me.ReferenceFrame(name) for name in ("N", "platform", "rotor"))
    P.orient_quaternion(N, e)
    R.orient_axis(P, sigma, P.z)
    P.set_ang_vel(N, sum((wk * axis for wk, axis in zip(w, P, strict=True)), 0 * P.x))
    R.set_ang_vel(P, s * P.z)
    G = me.Point("G")
    G.set_vel(N, 0)
    m_p, m_r = sm.symbols("m_p m_r")
    platform = me.RigidBody("platform", G, P, m_p, (me.inertia(P, A, B, C), G))
    rotor = me.RigidBody("rotor", G, R, m_r, (me.inertia(R, Jt, Jt, Js), G))
    kd = [*me.kinematic_equations(w, e, "quaternion"), sigma.diff(t) - s]
    kane = me.KanesMethod(N, [*e, sigma], [*w, s], kd)
    torque = (motor - c * s) * P.z
    kane.kanes_equations([platform, rotor], [(R, torque), (P, -torque)])
    constants = {A: 40.0, B: 46.0, C: 30.0, Js: 12.0, Jt: 7.0, motor: 2.0, c: 0.1}
    constants |= {m_p: 100.0, m_r: 50.0}
    start = dict(zip([*e, sigma, *w, s], [1.0, 0, 0, 0, 0, 0.02, -0.01, 0.03, 15.0], strict=True))
    return Script(kane, constants, start, 10.0)


@published("P. C. Hughes, Spacecraft Attitude Dynamics (1986): three reaction wheels")
def satellite_with_reaction_wheels() -> Script:
    e = me.dynamicsymbols("epsilon_1:4 eta")
    w = me.dynamicsymbols("omega_x omega_y omega_z")
    angles, rates = me.dynamicsymbols("alpha_1:4"), me.dynamicsymbols("Omega_1:4")
    torques = me.dynamicsymbols("h_1:4")
    m, mw, Ix, Iy, Iz, Is, It, a = sm.symbols("m m_w I_x I_y I_z I_s I_t a")
    N, B = me.ReferenceFrame("N"), me.ReferenceFrame("B")
    B.orient_quaternion(N, (e[3], e[0], e[1], e[2]))
    B.set_ang_vel(N, w[0] * B.x + w[1] * B.y + w[2] * B.z)
    G = me.Point("G")
    G.set_vel(N, 0)
    bodies = [me.RigidBody("bus", G, B, m, (me.inertia(B, Ix, Iy, Iz), G))]
    loads = []
    for k, axis in enumerate((B.x, B.y, B.z)):
        W = B.orientnew(f"W{k}", "Axis", (angles[k], axis))
        W.set_ang_vel(B, rates[k] * axis)
        hub = G.locatenew(f"hub{k}", a * axis)
        hub.v2pt_theory(G, N, B)
        spin = [It, It, It]
        spin[k] = Is
        bodies.append(me.RigidBody(f"wheel{k}", hub, W, mw, (me.inertia(W, *spin), hub)))
        loads += [(W, torques[k] * axis), (B, -torques[k] * axis)]
    kd = me.kinematic_equations(list(w), [e[3], e[0], e[1], e[2]], "quaternion")
    kd += [p.diff(t) - r for p, r in zip(angles, rates, strict=True)]
    kane = me.KanesMethod(N, [*e, *angles], [*w, *rates], kd)
    kane.kanes_equations(bodies, loads)
    constants = {m: 60.0, mw: 2.0, Ix: 6.0, Iy: 7.0, Iz: 4.5, Is: 0.01, It: 0.006, a: 0.2}
    start = dict.fromkeys([*e, *angles, *w, *rates], 0.0)
    start |= {e[3]: 1.0, w[0]: 0.05, w[1]: -0.03, rates[2]: 100.0}
    inputs = dict(zip(torques, (0.01, -0.02, 0.005), strict=True))
    return Script(kane, constants, start, 10.0, inputs)


@published("T. R. Kane, M. P. Scher, A dynamical explanation of the falling cat phenomenon (1969)")
def falling_cat() -> Script:
    q1, q2, q3, bend, twist = me.dynamicsymbols("q1 q2 q3 beta gamma")
    u1, u2, u3, u4, u5 = me.dynamicsymbols("u1:6")
    Tb, Tt = me.dynamicsymbols("T_b T_t")
    m, I, J, d = sm.symbols("m I J d")
    N = me.ReferenceFrame("N")
    A = N.orientnew("A", "Body", (q1, q2, q3), "123")
    C = A.orientnew("C", "Axis", (bend, A.y))
    B = C.orientnew("B", "Axis", (twist, C.x))
    qd_form = A.ang_vel_in(N)
    A.set_ang_vel(N, u1 * A.x + u2 * A.y + u3 * A.z)
    C.set_ang_vel(A, u4 * A.y)
    B.set_ang_vel(C, u5 * C.x)
    # about the mass centre of both halves, which falls as a stone does
    spine = me.Point("spine")
    front, back = spine.locatenew("front", d * A.x), spine.locatenew("back", -d * C.x)
    centre = me.Point("centre")
    centre.set_vel(N, 0)
    spine.set_pos(centre, -(d * A.x - d * C.x) / 2)
    spine.set_vel(N, -d / 2 * (A.ang_vel_in(N) ^ A.x) + d / 2 * (C.ang_vel_in(N) ^ C.x))
    front.v2pt_theory(spine, N, A)
    back.v2pt_theory(spine, N, C)
    bodies = [
        me.RigidBody("front", front, A, m, (me.inertia(A, J, I, I), front)),
        me.RigidBody("back", back, B, m, (me.inertia(B, J, I, I), back)),
    ]
    kd = [(qd_form - A.ang_vel_in(N)) & axis for axis in A]
    kd += [bend.diff(t) - u4, twist.diff(t) - u5]
    kane = me.KanesMethod(N, [q1, q2, q3, bend, twist], [u1, u2, u3, u4, u5], kd)
    loads = [(C, Tb * A.y), (A, -Tb * A.y), (B, Tt * C.x), (C, -Tt * C.x)]
    kane.kanes_equations(bodies, loads)
    start = dict.fromkeys([q1, q2, q3, u1, u2, u3, u4, u5], 0.0) | {bend: 1.0, twist: 0.0}
    return Script(kane, {m: 1.5, I: 0.01, J: 0.004, d: 0.12}, start, 0.8, {Tb: 0.02, Tt: 0.03})


@published(
    "A. K. Misra, V. J. Modi, A survey on the dynamics and control of tethered satellites (1986)"
)
def elastic_tether_in_orbit() -> Script:
    R, nu, L, phi = me.dynamicsymbols("R nu L phi")
    m1, m2, k, L0, mu = sm.symbols("m_1 m_2 k L_0 mu", positive=True)
    N = me.ReferenceFrame("N")
    H, D = N.orientnew("H", "Axis", (nu, N.z)), N.orientnew("D", "Axis", (nu + phi, N.z))
    O = me.Point("O")
    O.set_vel(N, 0)
    centre = O.locatenew("c", R * H.x)
    ends = [
        centre.locatenew("a", -m2 / (m1 + m2) * L * D.x),
        centre.locatenew("b", m1 / (m1 + m2) * L * D.x),
    ]
    particles = []
    for end, mass in zip(ends, (m1, m2), strict=True):
        end.set_vel(N, end.pos_from(O).dt(N))
        particle = me.Particle(end.name, end, mass)
        particle.potential_energy = -mu * mass / end.pos_from(O).magnitude()
        particles.append(particle)
    particles[0].potential_energy += k * (L - L0) ** 2 / 2
    lagrange = me.LagrangesMethod(
        me.Lagrangian(N, *particles), [R, nu, L, phi], bodies=particles, frame=N
    )
    lagrange.form_lagranges_equations()
    constants = {m1: 3.0, m2: 1.0, k: 60.0, L0: 0.2, mu: 1.0}
    start = {R: 1.0, nu: 0.0, L: 0.22, phi: 0.3}
    start |= {R.diff(t): 0.0, nu.diff(t): 1.0, L.diff(t): 0.1, phi.diff(t): 0.2}
    return Script(lagrange, constants, start, 5.0)


@published("T. R. Kane, P. W. Likins, D. A. Levinson, Spacecraft Dynamics (1983): gravity gradient")
def gravity_gradient_satellite() -> Script:
    q = me.dynamicsymbols("theta_1:4")
    u = me.dynamicsymbols("u_1:4")
    n, I1, I2, I3 = sm.symbols("n I_1 I_2 I_3")
    N = me.ReferenceFrame("N")
    A = N.orientnew("A", "Axis", (n * t, N.z))  # turns with the orbit; A.x points up
    B = A.orientnew("B", "Body", q, "312")
    turning = B.ang_vel_in(N)
    B.set_ang_vel(N, u[0] * B.x + u[1] * B.y + u[2] * B.z)
    G = me.Point("G")
    G.set_vel(N, 0)
    J = me.inertia(B, I1, I2, I3)
    satellite = me.RigidBody("satellite", G, B, 1, (J, G))
    kane = me.KanesMethod(N, q, u, [(turning - B.ang_vel_in(N)) & axis for axis in B])
    kane.kanes_equations([satellite], [(B, 3 * n**2 * A.x.cross(J.dot(A.x)))])
    start = dict(zip([*q, *u], [0.1, 0.05, -0.1, 0.0, 0.01, 0.11], strict=True))
    return Script(kane, {n: 0.1, I1: 1.0, I2: 2.2, I3: 3.0}, start, 30.0)
