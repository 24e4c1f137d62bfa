"""A four-bar linkage with play in three of its joints.

    python examples/four_bar_clearance.py

The linkage of N. Akhadkar, V. Acary, B. Brogliato, Multibody System Dynamics 38 (2016), 101-136,
with the data of the example FourBarClearance of the program Siconos: journals of 55 mm radius in
bearings of 60 mm, plastic impacts, friction 0.1; a controller turns the crank to and fro.  There
is no loop: each joint with play is a stop, whose gap is the play less the distance of the centres.
The angles are compared with those that Siconos gives by time steps of 0.1 ms, a method of first
order; from 0.5 s on two versions of its results differ by 2e-4 rad.
Writes four_bar_clearance.png.
"""

import numpy as np
from matplotlib.figure import Figure
from sympy import atan2, cos, pi, sin, sqrt, symbols
from sympy.physics.mechanics import (
    KanesMethod,
    Point,
    ReferenceFrame,
    RigidBody,
    dynamicsymbols,
    inertia,
)

import mechc

L0, L1, L2, L3, MASS, G = 3.0, 1.0, 4.0, 2.5, 1.0, 9.81  # m, kg, m/s^2
JOURNAL, BEARING, FRICTION = 0.055, 0.06, 0.1
SECONDS = 1.0
GAIN, LAMBDA = 200.0, 10.0  # N m s/rad, 1/s: of the controller
START = {  # the centres of journals and bearings are 1e-6 m apart
    "theta_1": 1.570823772407980, "theta_2": 0.3532842020624460, "theta_3": 1.264872058968431,
    "x_2": 1.876454585097650, "y_2": 1.691962091335582,
    "x_3": 0.3764686197082958, "y_3": 1.191962183453451,
}  # fmt: skip
# Siconos 4 (siconos-tutorials, FourBarClearance.ref): theta_1, theta_2, theta_3 (rad), every 0.05 s
SICONOS = np.array([
    [1.667922, 0.359791, 1.305372], [1.985175, 0.400993, 1.456448], [2.431353, 0.479953, 1.657370],
    [2.944229, 0.589950, 1.838651], [3.469429, 0.722471, 1.960191], [3.979969, 0.855959, 2.003572],
    [4.455763, 0.962198, 1.968255], [4.882151, 1.013001, 1.860835], [5.248881, 0.994595, 1.695506],
    [5.545613, 0.915803, 1.499657], [5.776244, 0.807024, 1.308647], [5.928751, 0.724861, 1.185240],
    [5.997105, 0.685947, 1.131470], [5.982561, 0.693877, 1.142192], [5.885876, 0.748229, 1.219071],
    [5.707564, 0.839538, 1.362846], [5.448762, 0.938970, 1.555590], [5.116799, 1.006560, 1.761075],
    [4.707143, 0.999644, 1.914130], [4.238456, 0.918991, 1.995552],
])  # fmt: skip


def torque(theta, omega):
    """Of the controller on the crank, by the ideal linkage: a path of 6 sin(0.75 pi t) rad."""
    t, a, p, x = dynamicsymbols._t, *symbols("a p x")
    wanted = 6.0 * sin(0.75 * pi * t)
    k_1, k_2 = -2 * L1 * L3 * sin(theta), 2 * L3 * (L0 - L1 * cos(theta))
    k_3 = L0**2 + L1**2 - L2**2 + L3**2 - 2 * L0 * L1 * cos(theta)
    rocker = 2 * (pi + atan2(-k_1 - sqrt(k_1**2 + k_2**2 - k_3**2), k_3 - k_2))
    rod = atan2(L3 * sin(rocker) - L1 * sin(theta), L0 - L1 * cos(theta) + L3 * cos(rocker))
    turn_2 = L1 * sin(p - x) / (L2 * sin(a - p))  # of the rod for one of the crank
    turn_3 = L1 * sin(a - x) / (L3 * sin(a - p))

    def along(value):
        return value.diff(x) + value.diff(a) * turn_2 + value.diff(p) * turn_3

    P = MASS * L1 * L2 / 2
    J_1, J_2 = (MASS * (L1**2 / 3 + L1**2)) / 2, MASS * L2**2 / 6
    J_3, mixed = MASS * L3**2 / 6, P * cos(x - a) * turn_2
    mass = 2 * (J_1 + J_2 * turn_2**2 + J_3 * turn_3**2 + mixed)
    # that program takes the inertia about the centre of mass in the second term
    rate = 2 * J_2 * turn_2 * along(turn_2) + MASS * L3**2 / 6 * turn_3 * along(turn_3)
    rate += along(mixed)
    weight = MASS * G * (1.5 * L1 * cos(x) + turn_2 * L2 / 2 * cos(a) + turn_3 * L3 / 2 * cos(p))
    off, slow = theta - wanted, omega - wanted.diff(t)
    given = mass * (wanted.diff(t, 2) - LAMBDA * slow) + rate * omega * (omega - LAMBDA * off)
    given += weight - GAIN * (slow + LAMBDA * off)
    return given.subs({a: rod, p: rocker, x: theta}, simultaneous=True)


def linkage():
    """Crank on its pivot; rod and rocker free, the latter from the ground's other pivot."""
    theta, x, y = dynamicsymbols("theta_1:4"), dynamicsymbols("x_2:4"), dynamicsymbols("y_2:4")
    omega, v = dynamicsymbols("omega_1:4"), dynamicsymbols("v_2:4")
    w = dynamicsymbols("w_2:4")
    N, O, t = ReferenceFrame("N"), Point("O"), dynamicsymbols._t
    O.set_vel(N, 0)
    frames = [N.orientnew(f"B_{k}", "Axis", [angle, N.z]) for k, angle in enumerate(theta)]
    for frame, rate in zip(frames, omega, strict=True):
        frame.set_ang_vel(N, rate * N.z)
    middle = O.locatenew("C_1", L1 / 2 * frames[0].x)
    middle.v2pt_theory(O, N, frames[0])
    centres = [middle]
    for k in (0, 1):
        centre = O.locatenew(f"C_{k + 2}", (x[k] + L0 * k) * N.x + y[k] * N.y)
        centre.set_vel(N, v[k] * N.x + w[k] * N.y)
        centres.append(centre)
    bodies = [
        RigidBody(name, centre, frame, MASS, (inertia(frame, 0, 0, MASS * l**2 / 12), centre))
        for name, centre, frame, l in zip(
            ("crank", "rod", "rocker"), centres, frames, (L1, L2, L3), strict=True
        )
    ]
    q, u = [*theta, x[0], y[0], x[1], y[1]], [*omega, v[0], w[0], v[1], w[1]]
    kane = KanesMethod(N, q, u, kd_eqs=[a.diff(t) - b for a, b in zip(q, u, strict=True)])
    loads = [(body.masscenter, -MASS * G * N.y) for body in bodies]
    kane.kanes_equations(bodies, [*loads, (frames[0], torque(theta[0], omega[0]) * N.z)])
    return mechc.compile(kane, name="four_bar_with_play")


def joint(dx, dy, vx, vy, journal, bearing):
    """The stop of a journal in its bearing: their centres (dx, dy) apart, (vx, vy) the rate, and
    what turns them, journal first."""
    away = f"sqrt(({dx})**2 + ({dy})**2)"
    turning = f"{BEARING}*{bearing} - {JOURNAL}*{journal}"  # of the surfaces
    slip = f"(({vx})*({dy}) - ({vy})*({dx}))/{away} + {turning}"
    return mechc.Stop(f"{BEARING - JOURNAL} - {away}", 0.0, friction=FRICTION, slip=slip)


def joints():
    """Crank and rod, rod and rocker, rocker and ground."""
    c = [f"{l}*cos(theta_{k})" for k, l in enumerate((L1, L2 / 2, L3 / 2), 1)]
    s = [f"{l}*sin(theta_{k})" for k, l in enumerate((L1, L2 / 2, L3 / 2), 1)]
    w = ["omega_1", "omega_2", "omega_3"]
    return [
        joint(f"x_2 - {c[1]} - {c[0]}", f"y_2 - {s[1]} - {s[0]}",
              f"v_2 + {s[1]}*{w[1]} + {s[0]}*{w[0]}", f"w_2 - {c[1]}*{w[1]} - {c[0]}*{w[0]}",
              w[0], w[1]),
        joint(f"{L0} + x_3 + {c[2]} - {c[1]} - x_2", f"y_3 + {s[2]} - {s[1]} - y_2",
              f"v_3 - {s[2]}*{w[2]} + {s[1]}*{w[1]} - v_2",
              f"w_3 + {c[2]}*{w[2]} - {c[1]}*{w[1]} - w_2", w[1], w[2]),
        joint(f"x_3 - {c[2]}", f"y_3 - {s[2]}", f"v_3 + {s[2]}*{w[2]}", f"w_3 - {c[2]}*{w[2]}",
              w[2], "0"),
    ]  # fmt: skip


def between_centres(y):
    """Of each joint how far its centres are apart in x and y: (3, 2, n), m."""
    tips = [l * np.array([np.cos(angle), np.sin(angle)])
            for l, angle in zip((L1, L2 / 2, L3 / 2), y[:, :3].T, strict=True)]  # fmt: skip
    rod, rocker = y[:, 3:5].T, y[:, 5:7].T
    ground = np.array([[L0], [0.0]])
    return np.array([
        rod - tips[1] - tips[0], ground + rocker + tips[2] - tips[1] - rod, rocker - tips[2],
    ])  # fmt: skip


def ideal(theta):
    """The angles of rod and rocker without play, in the branch of the start."""
    x, y = L0 - L1 * np.cos(theta), -L1 * np.sin(theta)
    length = np.hypot(x, y)
    rod = np.arccos((length**2 + L2**2 - L3**2) / (2 * length * L2)) + np.arctan2(y, x)
    tip_x, tip_y = L2 * np.cos(rod) - x, L2 * np.sin(rod) - y
    return rod, np.arctan2(tip_y, tip_x)


model = linkage()
rest = dict.fromkeys(("omega_1", "omega_2", "omega_3", "v_2", "w_2", "v_3", "w_3"), 0.0)
sol = model.simulate(SECONDS, START | rest, events=joints(), rtol=1e-7)
print(f"{sol.status.code}: {sum(len(record.t) for record in sol.events)} impacts,", end=" ")
print(f"{len(sol.segments)} smooth parts")
given = 0.05 * np.arange(1, len(SICONOS) + 1)
given = given[given <= SECONDS]
off = np.abs(sol(given)[:, :3] - SICONOS[: len(given)]).max()
print(f"angles of Siconos every 0.05 s are at most {off:.5f} rad off")


times = np.linspace(0.0, SECONDS, 3000)
y = sol(times)
apart = np.linalg.norm(between_centres(y), axis=1) / (BEARING - JOURNAL)
figure = Figure(figsize=(7, 9), layout="constrained")
angles, plays, rocker = figure.subplots(3, 1, sharex=True)
for k, name in enumerate(("crank", "rod", "rocker")):
    angles.plot(times, y[:, k], f"C{k}", label=name)
    angles.plot(given, SICONOS[: len(given), k], f"C{k}o", ms=4)
angles.set(ylabel="angles (rad); dots: Siconos")
angles.legend()
for k, name in enumerate(("crank and rod", "rod and rocker", "rocker and ground")):
    plays.plot(times, apart[k], f"C{k}", label=name, lw=1)
plays.set(ylabel="centres apart, in the play")
plays.legend()
rocker.plot(times, 1e3 * (y[:, 2] - ideal(y[:, 0])[1]), lw=1)
rocker.set(xlabel="time (s)", ylabel="rocker less the ideal one (mrad)")
figure.savefig("four_bar_clearance.png", dpi=120)
