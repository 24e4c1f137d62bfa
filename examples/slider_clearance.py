"""A slider-crank whose slider has play in its guide.

    python examples/slider_clearance.py

The mechanism of P. Flores, R. Leine, C. Glocker, Multibody System Dynamics 23 (2010), 165-190, with
their data: a slider of 100 x 50 mm in a guide 2 mm wider, restitution 0.4, friction 0.01, a crank
that starts at 150 rad/s.  Crank, rod and slider have no loop: the guide is four stops, one at each
corner.  The slider bounces from wall to wall, rests on one and slides, and leaves it.  Impacts
and friction take energy and never give any.  The motion is compared with a scheme of time steps
(J. J. Moreau, 1988), which is of first order, and with published results of the program Siconos.
Writes slider_clearance.png.
"""

import numpy as np
from matplotlib.figure import Figure
from sympy import symbols
from sympy.physics.mechanics import (
    KanesMethod,
    Point,
    ReferenceFrame,
    RigidBody,
    dynamicsymbols,
    inertia,
)

import mechc

A, B, PLAY = 0.05, 0.025, 0.001  # m: half the length and height of the slider; its play
RESTITUTION, FRICTION = 0.4, 0.01
START, SECONDS = [0.0, 0.0, 0.0, 150.0, -75.0, 0.0], 0.05
DATA = {
    "m_1": 0.038, "m_2": 0.038, "m_3": 0.076, "J_1": 7.4e-5, "J_2": 5.9e-4, "J_3": 2.7e-6,
    "l_1": 0.153, "l_2": 0.306, "g": 9.81,
}  # fmt: skip
# Of crank and rod (rad) at 10, 30 and 50 ms by Siconos with time steps of 100 us
# (siconos-tutorials, SliderCrankMoreauJeanDirectProjectionOSI.ref)
SICONOS = {0.01: (0.952682, -0.416124), 0.03: (2.593273, -0.267036), 0.05: (4.840701, 0.522608)}
CORNERS = [(side, end) for side in (1, -1) for end in (-1, 1)]


def slider_crank():
    """Crank, rod and slider by their angles; the rod's end is the middle of the slider."""
    angles, rates = dynamicsymbols("theta_1:4"), dynamicsymbols("omega_1:4")
    m, J, l, g = symbols("m_1:4"), symbols("J_1:4"), symbols("l_1:3"), symbols("g")
    N, O, t = ReferenceFrame("N"), Point("O"), dynamicsymbols._t
    O.set_vel(N, 0)
    frames = [N.orientnew(f"B_{k}", "Axis", [angle, N.z]) for k, angle in enumerate(angles)]
    for frame, rate in zip(frames, rates, strict=True):
        frame.set_ang_vel(N, rate * N.z)
    pin = O.locatenew("pin", l[0] * frames[0].x)
    end = pin.locatenew("end", l[1] * frames[1].x)
    centres = [
        O.locatenew("C_1", l[0] / 2 * frames[0].x),
        pin.locatenew("C_2", l[1] / 2 * frames[1].x),
    ]
    pin.v2pt_theory(O, N, frames[0])
    end.v2pt_theory(pin, N, frames[1])
    centres[0].v2pt_theory(O, N, frames[0])
    centres[1].v2pt_theory(pin, N, frames[1])
    bodies = [
        RigidBody(name, centre, frame, m[k], (inertia(frame, 0, 0, J[k]), centre))
        for k, (name, centre, frame) in enumerate(
            zip(("crank", "rod", "slider"), (*centres, end), frames, strict=True)
        )
    ]
    kinematics = [angle.diff(t) - rate for angle, rate in zip(angles, rates, strict=True)]
    kane = KanesMethod(N, angles, rates, kd_eqs=kinematics)
    kane.kanes_equations(bodies, [(body.masscenter, -body.mass * g * N.y) for body in bodies])
    return mechc.compile(kane, name="slider_crank_with_play", defaults=DATA)


def corner(side, end):
    """The stop of one corner at the upper (1) or lower wall."""
    height = f"(l_1*sin(theta_1) + l_2*sin(theta_2) + ({end * A})*sin(theta_3))"
    slip = (
        "-l_1*sin(theta_1)*omega_1 - l_2*sin(theta_2)*omega_2"
        f" - (({end * A})*sin(theta_3) + ({side * B})*cos(theta_3))*omega_3"
    )
    gap = f"{B + PLAY} - {B}*cos(theta_3) - ({side})*{height}"
    return mechc.Stop(gap, RESTITUTION, friction=FRICTION, slip=slip)


def equations(q, u):
    """M and F of the same mechanism, by hand."""
    m, J, l = ([DATA[f"{x}_{k}"] for k in (1, 2, 3)[:n]] for x, n in (("m", 3), ("J", 3), ("l", 2)))
    both = (m[1] / 2 + m[2]) * l[0] * l[1]
    turn = q[1] - q[0]
    M = np.diag([J[0] + (m[0] / 4 + m[1] + m[2]) * l[0] ** 2,
                 J[1] + (m[1] / 4 + m[2]) * l[1] ** 2, J[2]])  # fmt: skip
    M[0, 1] = M[1, 0] = both * np.cos(turn)
    weight = DATA["g"] * np.array([(m[0] / 2 + m[1] + m[2]) * l[0], (m[1] / 2 + m[2]) * l[1], 0.0])
    F = both * np.sin(turn) * np.array([u[1] ** 2, -(u[0] ** 2), 0.0]) - weight * np.cos(q)
    return M, F


def closed(q):
    """Rows of the gaps and slips that are closed at q, two a corner."""
    s, c = np.sin(q), np.cos(q)
    l_1, l_2 = DATA["l_1"], DATA["l_2"]
    rows = []
    for side, end in CORNERS:
        height = l_1 * s[0] + l_2 * s[1] + end * A * s[2] + side * B * c[2]
        if B + PLAY - side * height <= 0.0:
            rows.append(
                -side * np.array([l_1 * c[0], l_2 * c[1], end * A * c[2] - side * B * s[2]])
            )
            rows.append(-np.array([l_1 * s[0], l_2 * s[1], end * A * s[2] + side * B * c[2]]))
    return np.array(rows)


def time_steps(h):
    """The state after SECONDS by steps of impulses, found by projected Gauss-Seidel."""
    q, u = np.array(START[:3]), np.array(START[3:])
    for _ in range(round(SECONDS / h)):
        middle = q + 0.5 * h * u
        M, F = equations(middle, u)
        after, rows = u + h * np.linalg.solve(M, F), closed(middle)
        if len(rows):
            weighted = np.linalg.solve(M, rows.T)
            G, before, free = rows @ weighted, rows @ u, rows @ after
            p = np.zeros(len(rows))
            for _ in range(200):
                last = p.copy()
                for k in range(0, len(p), 2):
                    w = free[k] + G[k] @ p + RESTITUTION * before[k]
                    p[k] = max(0.0, p[k] - w / G[k, k])
                    slip = free[k + 1] + G[k + 1] @ p
                    most = FRICTION * p[k]
                    p[k + 1] = min(max(p[k + 1] - slip / G[k + 1, k + 1], -most), most)
                if np.abs(p - last).max() <= 1e-12 * np.abs(p).max():
                    break
            after = after + weighted @ p
        u, q = after, middle + 0.5 * h * after
    return np.concatenate([q, u])


model = slider_crank()
stops = [corner(side, end) for side, end in CORNERS]
sol = model.simulate(SECONDS, START, events=stops, rtol=1e-10)
hits = sum(len(record.t) for record in sol.events)
resting = sum(
    part.t1 - part.t0 for part in sol.segments if any("slides" in x for x in part.contacts)
)
print(f"{sol.status.code}: {hits} impacts of corners, {1e3 * resting:.2f} ms on a wall")
print(f"energy grows by at most {np.diff(sol.energy).max():.0e} J")
far = [np.abs(time_steps(h)[:2] - sol.y[-1, :2]).max() for h in (4e-5, 1e-5)]
print(f"crank and rod of time steps of 40 and 10 us are {far[0]:.4f} and {far[1]:.4f} rad off")
far = [np.abs(sol(t)[:2] - angles).max() for t, angles in SICONOS.items()]
print(f"those of Siconos, of 100 us, are {far[0]:.3f}, {far[1]:.3f} and {far[2]:.3f} rad off")

times = np.linspace(0.0, SECONDS, 3000)
y = sol(times)
middle = DATA["l_1"] * np.sin(y[:, 0]) + DATA["l_2"] * np.sin(y[:, 1])
figure = Figure(figsize=(7, 6), layout="constrained")
play, energy = figure.subplots(2, 1, sharex=True)
play.plot(1e3 * times, middle / PLAY)
for part in sol.segments:
    if any("slides" in word for word in part.contacts):
        play.axvspan(1e3 * part.t0, 1e3 * part.t1, alpha=0.15, lw=0)
play.set(ylabel="slider in its play (−1 to 1)")
energy.plot(1e3 * times, model.energy(y))
energy.set(xlabel="time (ms)", ylabel="energy (J)")
figure.savefig("slider_clearance.png", dpi=120)
