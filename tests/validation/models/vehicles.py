"""Vehicles: cars with trailers, tricycles, skateboards, a monorail car that a gyroscope holds."""

from __future__ import annotations

from math import sin

import sympy as sm
import sympy.physics.mechanics as me

from .script import Script, published

t = me.dynamicsymbols._t


@published("P. Rouchon et al., Flatness and motion planning: the car with n trailers (1993)")
def car_with_a_trailer() -> Script:
    x, y, th0, phi, th1 = q = me.dynamicsymbols("x y theta_0 phi theta_1")
    u = me.dynamicsymbols("u_x u_y omega_0 nu omega_1")
    F, S = me.dynamicsymbols("F S")
    m0, m1, I0, I1, If, l, d1, c = sm.symbols("m_0 m_1 I_0 I_1 I_f l d_1 c")
    N = me.ReferenceFrame("N")
    car = N.orientnew("C", "Axis", (th0, N.z))
    fork = car.orientnew("F", "Axis", (phi, car.z))
    trailer = N.orientnew("T", "Axis", (th1, N.z))
    car.set_ang_vel(N, u[2] * N.z)
    fork.set_ang_vel(car, u[3] * car.z)
    trailer.set_ang_vel(N, u[4] * N.z)
    O = me.Point("O")
    O.set_vel(N, 0)
    rear = O.locatenew("rear", x * N.x + y * N.y)
    rear.set_vel(N, u[0] * N.x + u[1] * N.y)
    front = rear.locatenew("front", l * car.x)
    axle = rear.locatenew("axle", -d1 * trailer.x)
    front.v2pt_theory(rear, N, car)
    axle.v2pt_theory(rear, N, trailer)
    nonholonomic = [
        rear.vel(N).dot(car.y),
        front.vel(N).dot(fork.y),
        axle.vel(N).dot(trailer.y),
    ]
    bodies = [
        me.RigidBody("car", rear, car, m0, (me.inertia(car, 0, 0, I0), rear)),
        me.RigidBody("fork", front, fork, 1, (me.inertia(fork, 0, 0, If), front)),
        me.RigidBody("trailer", axle, trailer, m1, (me.inertia(trailer, 0, 0, I1), axle)),
    ]
    drive = F * car.x - c * rear.vel(N)
    kane = me.KanesMethod(
        N, q, u_ind=[u[0], u[3]], kd_eqs=[a.diff(t) - b for a, b in zip(q, u, strict=True)],
        u_dependent=[u[1], u[2], u[4]], velocity_constraints=nonholonomic,
    )  # fmt: skip
    kane.kanes_equations(bodies, [(rear, drive), (fork, S * N.z), (car, -S * N.z)])
    constants = {m0: 900.0, m1: 300.0, I0: 700.0, I1: 150.0, If: 1.0, l: 2.5, d1: 3.0, c: 20.0}
    start = {x: 0, y: 0, th0: 0.2, phi: 0.1, th1: 0.5, u[0]: 4.0, u[3]: 0.0}
    return Script(kane, constants, start, 5.0, {F: 300.0, S: 0.05})


@published(
    "G. Campion, G. Bastin, B. d'Andrea-Novel, Structural properties ... mobile robots (1996)"
)
def tricycle() -> Script:
    x, y, theta, beta, p1, p2, p3 = me.dynamicsymbols("x y theta beta phi_1:4")
    xd, yd, thetad, betad, w1, w2, w3 = me.dynamicsymbols("x y theta beta phi_1:4", 1)
    T3, S = me.dynamicsymbols("tau_3 sigma")
    m, I, Ib, Iw, L, r = sm.symbols("m I I_b I_w L r", positive=True)
    T = m / 2 * (xd**2 + yd**2) + I / 2 * thetad**2 + Ib / 2 * (thetad + betad) ** 2
    T += Iw / 2 * (w1**2 + w2**2 + w3**2)
    along = xd * sm.cos(theta) + yd * sm.sin(theta)
    across = -xd * sm.sin(theta) + yd * sm.cos(theta)
    # fixed wheels at (0, +-L), the steered and driven one at (2 L, 0)
    front = (along, across + 2 * L * thetad)
    c, s = sm.cos(beta), sm.sin(beta)
    nonholonomic = [
        across,
        along - L * thetad - r * w1,
        along + L * thetad - r * w2,
        front[0] * c + front[1] * s - r * w3,
        -front[0] * s + front[1] * c,
    ]
    N = me.ReferenceFrame("N")
    fork, wheel = N.orientnew("B", "Axis", (beta, N.z)), N.orientnew("W", "Axis", (p3, N.y))
    lagrange = me.LagrangesMethod(
        T, [x, y, theta, beta, p1, p2, p3], nonhol_coneqs=nonholonomic, frame=N,
        forcelist=[(fork, S * N.z), (wheel, T3 * N.y)],
    )  # fmt: skip
    lagrange.form_lagranges_equations()
    constants = {m: 40.0, I: 3.0, Ib: 0.05, Iw: 0.02, L: 0.3, r: 0.1}
    start = {x: 0, y: 0, theta: 0.1, beta: 0.3, p1: 0, p2: 0, p3: 0, w3: 6.0, betad: 0.1}
    return Script(lagrange, constants, start, 3.0, {T3: 0.2, S: -0.005})


@published("M. Hubbard, Lateral Dynamics and Stability of the Skateboard, J. Appl. Mech. 46 (1979)")
def skateboard() -> Script:
    x, y, psi, gamma = me.dynamicsymbols("x y psi gamma")
    v, w, omega, p = me.dynamicsymbols("v w omega p")
    m, I_x, I_z, h, a, lam, k, c, g = sm.symbols("m I_x I_z h a lambda k c g")
    N = me.ReferenceFrame("N")
    A = N.orientnew("A", "Axis", (psi, N.z))  # along the board
    B = A.orientnew("B", "Axis", (gamma, A.x))  # board and rider lean
    A.set_ang_vel(N, omega * N.z)
    B.set_ang_vel(A, p * A.x)
    O = me.Point("O")
    O.set_vel(N, 0)
    P = O.locatenew("P", x * N.x + y * N.y)
    P.set_vel(N, v * A.x + w * A.y)
    front, rear = P.locatenew("front", a * A.x), P.locatenew("rear", -a * A.x)
    front.v2pt_theory(P, N, A)
    rear.v2pt_theory(P, N, A)
    G = P.locatenew("G", h * B.z)
    G.v2pt_theory(P, N, B)
    # trucks steer against each other: tan(delta) = tan(lambda) sin(gamma)
    steer = sm.tan(lam) * sm.sin(gamma)
    rows = [
        front.vel(N).dot(A.y) + steer * front.vel(N).dot(A.x),
        rear.vel(N).dot(A.y) - steer * rear.vel(N).dot(A.x),
    ]
    way = P.pos_from(O).dt(N) - P.vel(N)
    kd = [way.dot(A.x), way.dot(A.y), psi.diff(t) - omega, gamma.diff(t) - p]
    rider = me.RigidBody("rider", G, B, m, (me.inertia(B, I_x, I_x, I_z), G))
    kane = me.KanesMethod(
        N, [x, y, psi, gamma], [v, p], kd, u_dependent=[w, omega], velocity_constraints=rows
    )
    kane.kanes_equations([rider], [(G, -m * g * N.z), (B, -(k * gamma + c * p) * A.x)])
    constants = {m: 75.0, I_x: 9.0, I_z: 1.2, h: 0.9, a: 0.3, lam: 0.4, k: 900.0, c: 10.0, g: 9.81}
    start = {x: 0, y: 0, psi: 0.0, gamma: 0.1, v: 4.0, p: 0.0}
    return Script(kane, constants, start, 3.0)


@published(
    "R. N. Arnold, L. Maunder, Gyrodynamics and its Engineering Applications (1961): monorail"
)
def gyroscopic_monorail_car() -> Script:
    s, phi, theta, psi = me.dynamicsymbols("s phi theta psi")
    us, up, ut, ur = me.dynamicsymbols("u_s u_phi u_theta u_r")
    m, h, Ix, mg, hg, A, C, k, d, n, g, b = sm.symbols("m h I_x m_g h_g A C k d n g b")
    F = me.dynamicsymbols("F")
    N = me.ReferenceFrame("N")
    car = N.orientnew("car", "Axis", (phi, N.x))
    gimbal = car.orientnew("gimbal", "Axis", (theta, car.y))
    rotor = gimbal.orientnew("rotor", "Axis", (psi, gimbal.z))
    car.set_ang_vel(N, up * N.x)
    gimbal.set_ang_vel(car, ut * car.y)
    rotor.set_ang_vel(gimbal, ur * gimbal.z)
    O = me.Point("O")
    O.set_vel(N, 0)
    rail = O.locatenew("rail", s * N.x)
    rail.set_vel(N, us * N.x)
    G, H = rail.locatenew("G", h * car.z), rail.locatenew("H", hg * car.z)
    G.v2pt_theory(rail, N, car)
    H.v2pt_theory(rail, N, car)
    bodies = [
        me.RigidBody("car", G, car, m, (me.inertia(car, Ix, 0, 0), G)),
        me.RigidBody("rotor", H, rotor, mg, (me.inertia(rotor, A, A, C), H)),
    ]
    # The gimbal is unstable too (k); a servo turns it by the car's lean (n) and damps it (d).
    servo = (k * theta - d * ut - n * phi) * car.y
    loads = [(G, -m * g * N.z), (H, -mg * g * N.z), (rail, (F - b * us) * N.x)]
    loads += [(gimbal, servo), (car, -servo)]
    q, u = [s, phi, theta, psi], [us, up, ut, ur]
    kane = me.KanesMethod(N, q, u, [a.diff(t) - c for a, c in zip(q, u, strict=True)])
    kane.kanes_equations(bodies, loads)
    constants = {
        m: 200.0,
        h: 0.6,
        Ix: 20.0,
        mg: 40.0,
        hg: 0.8,
        A: 1.0,
        C: 1.8,
        k: 60.0,
        d: 30.0,
        n: 150.0,
        g: 9.81,
        b: 5.0,
    }
    start = {s: 0, phi: 0.02, theta: 0.0, psi: 0.0, us: 5.0, up: 0.0, ut: 0.0, ur: 400.0}
    return Script(kane, constants, start, 1.0, {F: 20.0})


@published("D. Hrovat, Survey of advanced suspension developments, Automatica 33 (1997): half car")
def half_car_on_a_road() -> Script:
    z, theta, z1, z2 = me.dynamicsymbols("z theta z_1 z_2")
    v, w, v1, v2 = me.dynamicsymbols("v w v_1 v_2")
    r1, r2 = me.dynamicsymbols("r_1 r_2")
    m, I, mu1, mu2, a, b, k, c, kt = sm.symbols("m I m_u1 m_u2 a b k c k_t")
    N = me.ReferenceFrame("N")
    B = N.orientnew("B", "Axis", (theta, N.y))
    B.set_ang_vel(N, w * N.y)
    O = me.Point("O")
    O.set_vel(N, 0)
    G = O.locatenew("G", z * N.z)
    G.set_vel(N, v * N.z)
    bodies = [me.RigidBody("body", G, B, m, (me.inertia(B, 0, I, 0), G))]
    loads = []
    for k_, (zk, vk, rk, arm, mass) in enumerate(((z1, v1, r1, a, mu1), (z2, v2, r2, -b, mu2))):
        corner = G.locatenew(f"corner{k_}", arm * B.x)
        corner.v2pt_theory(G, N, B)
        wheel = O.locatenew(f"wheel{k_}", zk * N.z)
        wheel.set_vel(N, vk * N.z)
        stretch, rate = z - arm * sm.sin(theta) - zk, v - arm * sm.cos(theta) * w - vk
        strut = -(k * stretch + c * rate) * N.z
        loads += [(corner, strut), (wheel, -strut - kt * (zk - rk) * N.z)]
        bodies.append(me.Particle(f"wheel{k_}", wheel, mass))
    q, u = [z, theta, z1, z2], [v, w, v1, v2]
    kane = me.KanesMethod(N, q, u, [x.diff(t) - s for x, s in zip(q, u, strict=True)])
    kane.kanes_equations(bodies, loads)
    constants = {
        m: 600.0,
        I: 900.0,
        mu1: 40.0,
        mu2: 40.0,
        a: 1.2,
        b: 1.4,
        k: 18e3,
        c: 1.2e3,
        kt: 180e3,
    }
    start = dict.fromkeys([*q, *u], 0.0) | {z: 0.05, theta: 0.02}
    road = {r1: lambda time: 0.02 * sin(6.0 * time), r2: lambda time: 0.02 * sin(6.0 * time - 1)}
    return Script(kane, constants, start, 2.0, road)
