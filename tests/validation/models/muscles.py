"""Walkers, runners and arms: torques of muscles with activation, springs for legs."""

from __future__ import annotations

import sympy as sm
import sympy.physics.mechanics as me

from .script import Script, published

t = me.dynamicsymbols._t


@published("E. R. Westervelt et al., Feedback Control of Dynamic Bipedal Robot Locomotion (2007)")
def five_link_walker() -> Script:
    q = me.dynamicsymbols("q1:6")  # absolute: stance shank, thigh, torso, swing thigh, shank
    u = me.dynamicsymbols("u1:6")
    tau = me.dynamicsymbols("tau1:5")
    m, l, c, I = (sm.symbols(f"{x}1:6") for x in ("m", "l", "c", "I"))
    g = sm.symbols("g")
    N, O = me.ReferenceFrame("N"), me.Point("O")
    O.set_vel(N, 0)
    frames = []
    for k in range(5):
        frames.append(N.orientnew(f"A{k + 1}", "Axis", (q[k], N.z)))
        frames[k].set_ang_vel(N, u[k] * N.z)
    knee = O.locatenew("knee", l[0] * frames[0].y)
    hip = knee.locatenew("hip", l[1] * frames[1].y)
    swing_knee = hip.locatenew("swing_knee", -l[3] * frames[3].y)
    knee.v2pt_theory(O, N, frames[0])
    hip.v2pt_theory(knee, N, frames[1])
    swing_knee.v2pt_theory(hip, N, frames[3])
    roots, signs = [O, knee, hip, hip, swing_knee], [1, 1, 1, -1, -1]
    bodies, loads = [], []
    for k in range(5):
        G = roots[k].locatenew(f"G{k + 1}", signs[k] * c[k] * frames[k].y)
        G.v2pt_theory(roots[k], N, frames[k])
        bodies.append(me.RigidBody(f"B{k + 1}", G, frames[k], m[k], (me.inertia(N, 0, 0, I[k]), G)))
        loads.append((G, -m[k] * g * N.y))
    for k, (i, j) in enumerate(((0, 1), (1, 2), (2, 3), (3, 4))):
        loads += [(frames[i], -tau[k] * N.z), (frames[j], tau[k] * N.z)]
    kane = me.KanesMethod(N, q, u, [a.diff(t) - b for a, b in zip(q, u, strict=True)])
    kane.kanes_equations(bodies, loads)
    values = [[3.2, 6.8, 20.0, 6.8, 3.2], [0.4, 0.4, 0.63, 0.4, 0.4]]
    values += [[0.24, 0.11, 0.24, 0.11, 0.24], [0.93, 1.08, 2.22, 1.08, 0.93]]
    constants = {g: 9.81}
    for symbols, numbers in zip((m, l, c, I), values, strict=True):
        constants |= dict(zip(symbols, numbers, strict=True))
    start = dict(
        zip([*q, *u], [0.1, -0.05, -0.1, 0.4, 0.1, -1.0, -0.8, 0.1, 1.0, 0.5], strict=True)
    )
    torques = dict(zip(tau, (5.0, 20.0, -4.0, 1.0), strict=True))
    return Script(kane, constants, start, 0.5, torques)


@published(
    "A. Goswami, B. Espiau, A. Keramane, Limit cycles in a passive compass gait biped (1997)"
)
def compass_gait() -> Script:
    ns, s = me.dynamicsymbols("theta_ns theta_s")
    m, mH, a, b, g = sm.symbols("m m_H a b g")
    l = a + b
    nsd, sd = ns.diff(t), s.diff(t)
    hip = sm.Matrix([-l * sm.sin(s), l * sm.cos(s)])
    stance = sm.Matrix([-a * sm.sin(s), a * sm.cos(s)])
    swing = hip + sm.Matrix([b * sm.sin(ns), -b * sm.cos(ns)])
    T = sum(k * (p.diff(t).T * p.diff(t))[0] / 2 for k, p in ((m, stance), (mH, hip), (m, swing)))
    V = g * (m * stance[1] + mH * hip[1] + m * swing[1])
    lagrange = me.LagrangesMethod(T - V, [ns, s])
    lagrange.form_lagranges_equations()
    constants = {m: 5.0, mH: 10.0, a: 0.5, b: 0.5, g: 9.81}
    return Script(lagrange, constants, {ns: -0.3, s: 0.2, nsd: -0.4, sd: -1.1}, 0.7)


@published("T. McGeer, Passive walking with knees, IEEE Robotics and Automation (1990)")
def kneed_walker_in_swing() -> Script:
    q1, q2, q3 = me.dynamicsymbols("q1 q2 q3")
    mH, mt, ms, a1, b1, a2, b2, g = sm.symbols("m_H m_t m_s a_1 b_1 a_2 b_2 g", positive=True)
    gamma = sm.symbols("gamma")
    ls, lt = a1 + b1, a2 + b2
    L = ls + lt
    N = me.ReferenceFrame("N")
    st, th, sh = (N.orientnew(n, "Axis", (q, N.z)) for n, q in (("st", q1), ("th", q2), ("sh", q3)))
    O = me.Point("O")
    O.set_vel(N, 0)
    places = {"shank": a1 * st.y, "thigh": (ls + a2) * st.y, "hip": L * st.y}
    places["swing_thigh"] = L * st.y - b2 * th.y
    places["swing_shank"] = L * st.y - lt * th.y - b1 * sh.y
    masses = {"shank": ms, "thigh": mt, "hip": mH, "swing_thigh": mt, "swing_shank": ms}
    down = -g * (sm.cos(gamma) * N.y - sm.sin(gamma) * N.x)
    particles, loads = [], []
    for name, place in places.items():
        P = O.locatenew(name, place)
        P.set_vel(N, place.dt(N))
        particles.append(me.Particle(name, P, masses[name]))
        loads.append((P, masses[name] * down))
    T = sum(particle.kinetic_energy(N) for particle in particles)
    lagrange = me.LagrangesMethod(T, [q1, q2, q3], forcelist=loads, frame=N)
    lagrange.form_lagranges_equations()
    constants = {mH: 0.5, mt: 0.5, ms: 0.05, a1: 0.375, b1: 0.125, a2: 0.175, b2: 0.325}
    constants |= {g: 9.81, gamma: 0.05}
    start = {q1: 0.19, q2: -0.29, q3: -0.29}
    start |= {q1.diff(t): -1.1, q2.diff(t): 0.0, q3.diff(t): 0.0}
    return Script(lagrange, constants, start, 0.3)


@published("R. Blickhan, The spring-mass model for running and hopping, J. Biomech. 22 (1989)")
def spring_mass_runner() -> Script:
    x, y, vx, vy = me.dynamicsymbols("x y v_x v_y")
    m, k, L0, g = sm.symbols("m k L_0 g")
    N = me.ReferenceFrame("N")
    foot, P = me.Point("foot"), me.Point("P")
    foot.set_vel(N, 0)
    P.set_pos(foot, x * N.x + y * N.y)
    P.set_vel(N, vx * N.x + vy * N.y)
    leg = P.pos_from(foot)
    force = k * (L0 - leg.magnitude()) * leg.normalize()
    kane = me.KanesMethod(N, [x, y], [vx, vy], [x.diff(t) - vx, y.diff(t) - vy])
    kane.kanes_equations([me.Particle("body", P, m)], [(P, force - m * g * N.y)])
    constants = {m: 80.0, k: 20e3, L0: 1.0, g: 9.81}
    return Script(kane, constants, {x: -0.35, y: 0.93, vx: 5.0, vy: -0.8}, 0.14)


@published(
    "F. E. Zajac, Muscle and tendon, Crit. Rev. Biomed. Eng. 17 (1989): activation of an arm"
)
def arm_with_activation_dynamics() -> Script:
    q1, q2, u1, u2 = me.dynamicsymbols("q1 q2 u1 u2")
    a = me.dynamicsymbols("a1:5")
    e = me.dynamicsymbols("e1:5")
    m1, m2, l1, c1, c2, I1, I2, g = sm.symbols("m1 m2 l1 c1 c2 I1 I2 g")
    T0, tau_act, beta, umax = sm.symbols("T0 tau_act beta u_max", positive=True)
    N = me.ReferenceFrame("N")
    A = N.orientnew("A", "Axis", [q1, N.z])
    B = A.orientnew("B", "Axis", [q2, N.z])
    A.set_ang_vel(N, u1 * N.z)
    B.set_ang_vel(A, u2 * N.z)
    shoulder = me.Point("shoulder")
    shoulder.set_vel(N, 0)
    elbow = shoulder.locatenew("elbow", l1 * A.x)
    G1, G2 = shoulder.locatenew("G1", c1 * A.x), elbow.locatenew("G2", c2 * B.x)
    G1.v2pt_theory(shoulder, N, A)
    elbow.v2pt_theory(shoulder, N, A)
    G2.v2pt_theory(elbow, N, B)

    def torque(flexor, extensor, angle, rate):  # Hill: torque, angle and torque, speed
        curve = sm.exp(-((angle - 1) ** 2))
        return T0 * curve * (flexor * (1 - rate / umax) - extensor * (1 + rate / umax))

    t1, t2 = torque(a[0], a[1], q1, u1), torque(a[2], a[3], q2, u2)
    upper = me.RigidBody("upper", G1, A, m1, (me.inertia(A, 0, 0, I1), G1))
    lower = me.RigidBody("lower", G2, B, m2, (me.inertia(B, 0, 0, I2), G2))
    loads = [(G1, -m1 * g * N.y), (G2, -m2 * g * N.y), (A, (t1 - t2) * N.z), (B, t2 * N.z)]
    kane = me.KanesMethod(N, [q1, q2], [u1, u2], [q1.diff() - u1, q2.diff() - u2])
    kane.kanes_equations([upper, lower], loads)
    rates = {
        ai: (ei - (beta + (1 - beta) * ei) * ai) / tau_act for ai, ei in zip(a, e, strict=True)
    }
    constants = {
        m1: 2.1,
        m2: 1.6,
        l1: 0.3,
        c1: 0.14,
        c2: 0.17,
        I1: 0.02,
        I2: 0.03,
        g: 9.81,
        T0: 40.0,
        tau_act: 0.015,
        beta: 0.3,
        umax: 20.0,
    }
    start = {q1: -0.5, q2: 0.8, u1: 0.0, u2: 0.0} | dict.fromkeys(a, 0.05)
    excitations = dict(zip(e, (0.3, 0.05, 0.25, 0.02), strict=True))
    return Script(kane, constants, start, 0.6, excitations, rates=rates)


@published("M. W. Spong, The swing up control problem for the acrobot, IEEE Control Systems (1995)")
def acrobot() -> Script:
    q1, q2, tau = me.dynamicsymbols("q1 q2 tau")
    m1, m2, l1, lc1, lc2, I1, I2, g = sm.symbols("m1 m2 l1 lc1 lc2 I1 I2 g")
    upper, lower = me.RigidBody("upper", mass=m1), me.RigidBody("lower", mass=m2)
    world = me.RigidBody("world")
    upper.central_inertia = me.inertia(upper.frame, 0, 0, I1)
    lower.central_inertia = me.inertia(lower.frame, 0, 0, I2)
    u1, u2 = me.dynamicsymbols("u1 u2")
    shoulder = me.PinJoint(
        "shoulder", world, upper, q1, u1, joint_axis=world.frame.z,
        child_point=-lc1 * upper.frame.x,
    )  # fmt: skip
    hip = me.PinJoint(
        "hip", upper, lower, q2, u2, joint_axis=upper.frame.z,
        parent_point=(l1 - lc1) * upper.frame.x, child_point=-lc2 * lower.frame.x,
    )  # fmt: skip
    system = me.System.from_newtonian(world)
    system.add_joints(shoulder, hip)
    system.apply_uniform_gravity(-g * world.frame.y)
    system.add_actuators(me.TorqueActuator(tau, upper.frame.z, lower, upper))
    system.form_eoms()
    constants = {m1: 1.0, m2: 1.0, l1: 1.0, lc1: 0.5, lc2: 0.5, I1: 0.2, I2: 1.0, g: 9.8}
    return Script(system, constants, {q1: -1.4, q2: 0.2, u1: 0.0, u2: 0.0}, 4.0, {tau: 0.3})
