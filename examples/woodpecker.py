"""A woodpecker toy: it pecks its way down a pole, and the motion becomes a limit cycle.

    python examples/woodpecker.py

A sleeve with play on a pole and a bird on a spring (R. I. Leine, D. H. van Campen, C. Glocker,
J. Vibration and Control 9 (2003)).  The beak hits the pole (restitution 0.5); the sleeve jams at
its lower or upper rim (plastic, friction 0.3), sticks while the bird swings, slides, and falls
free.  Each is a mechc.Stop with friction.  The state where the bird passes phi_S = -0.2788 on its
way back is compared with the one on the limit cycle given there, v_y = -0.3411 m/s and
omega_S = -7.4583 rad/s.  Then the cycle itself is found by shooting, with its multipliers.
Writes woodpecker.png.
"""

import numpy as np
from matplotlib.figure import Figure
from scipy.optimize import brentq
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

SECONDS, SECTION = 1.2, -0.2788
FRICTION, BEAK = 0.3, 0.5
SLEEVE = {"r_0": 0.0025, "r_M": 0.0031, "h_M": 0.0058, "h_S": 0.02, "l_S": 0.0201}  # m
DEFAULTS = {
    "m_M": 3e-4, "m_S": 4.5e-3, "J_M": 5e-9, "J_S": 7e-7, "c": 0.0056, "l_M": 0.010, "l_G": 0.015,
    "g": 9.81,
}  # fmt: skip


def toy():
    """Sleeve and bird for small angles: y of the sleeve, its angle phi_M and that of the bird."""
    y, phi_M, phi_S, v_y, omega_M, omega_S = dynamicsymbols("y phi_M phi_S v_y omega_M omega_S")
    m_M, m_S, J_M, J_S, c, l_M, l_G, g = symbols("m_M m_S J_M J_S c l_M l_G g")
    N, O, t = ReferenceFrame("N"), Point("O"), dynamicsymbols._t
    O.set_vel(N, 0)
    bodies, loads = [], []
    for name, height, speed, angle, rate, mass, turning in (
        ("sleeve", y, v_y, phi_M, omega_M, m_M, J_M),
        ("bird", y + l_M * phi_M + l_G * phi_S, v_y + l_M * omega_M + l_G * omega_S,
         phi_S, omega_S, m_S, J_S),
    ):  # fmt: skip
        frame, point = N.orientnew(name, "Axis", [angle, N.z]), O.locatenew(name, height * N.y)
        frame.set_ang_vel(N, rate * N.z)
        point.set_vel(N, speed * N.y)
        bodies.append(RigidBody(name, point, frame, mass, (inertia(frame, 0, 0, turning), point)))
        side = 1 if name == "sleeve" else -1
        loads += [(point, -mass * g * N.y), (frame, -side * c * (phi_M - phi_S) * N.z)]
    rates = [y.diff(t) - v_y, phi_M.diff(t) - omega_M, phi_S.diff(t) - omega_S]
    kane = KanesMethod(N, [y, phi_M, phi_S], [v_y, omega_M, omega_S], kd_eqs=rates)
    kane.kanes_equations(bodies, loads)
    return mechc.compile(kane, name="woodpecker", defaults=DEFAULTS)


def stops():
    """The beak, the lower and the upper rim of the sleeve."""
    play, reach = SLEEVE["r_M"] - SLEEVE["r_0"], SLEEVE["l_S"] + SLEEVE["r_0"]
    rim = f"v_y + {SLEEVE['r_M']}*omega_M"
    beak = f"v_y + l_M*omega_M + (l_G - {SLEEVE['l_S']})*omega_S"
    return [
        mechc.Stop(
            f"l_M + l_G - {reach} - {SLEEVE['h_S']}*phi_S", BEAK, friction=FRICTION, slip=beak
        ),
        mechc.Stop(f"{play} + {SLEEVE['h_M']}*phi_M", friction=FRICTION, slip=rim),
        mechc.Stop(f"{play} - {SLEEVE['h_M']}*phi_M", friction=FRICTION, slip=rim),
    ]  # fmt: skip


model = toy()
jammed = -(SLEEVE["r_M"] - SLEEVE["r_0"]) / SLEEVE["h_M"]
sol = model.simulate(SECONDS, [0.0, jammed, SECTION, -0.35, 0.0, -7.4], events=stops(), rtol=1e-8)
sliding = [
    part for part in sol.segments
    if part.contacts[1] == "slides -" and part.y0[2] > SECTION > part.y1[2]
]  # fmt: skip
passed = [brentq(lambda t: sol(t)[2] - SECTION, part.t0, part.t1) for part in sliding]
last = sol(passed[-1])
fall = sol(passed[-2])[0] - last[0]
print(f"{len(sol.events[0].t)} pecks, {len(sol.segments)} smooth parts: {sol.status.code}")
print(f"period {passed[-1] - passed[-2]:.4f} s, {1e3 * fall:.2f} mm a period")
print(f"on the section v_y = {last[3]:.4f} m/s, omega_S = {last[5]:.4f} rad/s")
assert abs(last[3] / -0.3411 - 1) < 0.01
assert abs(last[5] / -7.4583 - 1) < 0.01

cycle = model.periodic(sol(passed[-2]), 0.146, advance={"y": None}, events=stops())
print(cycle)
states = sol(np.array(passed))[:, 3]
factors = np.diff(states)[1:] / np.diff(states)[:-1]  # by which a deviation grows in a period
print(f"by the motion itself: period {passed[-1] - passed[-2]:.6f} s, factor {factors[-1]:.3f}")
assert abs(cycle.multipliers[0].real / factors[-1] - 1) < 0.02

figure = Figure(figsize=(7, 7), layout="constrained")
heights, portrait = figure.subplots(2, 1)
times = np.linspace(0.0, sol.t[-1], 6000)
states = sol(times)
heights.plot(times, 1e3 * states[:, 0], lw=1)
heights.set(xlabel="time (s)", ylabel="height of the sleeve (mm)")
for part in sol.segments:
    if part.contacts[1] == "sticks":
        heights.axvspan(part.t0, part.t1, alpha=0.2, lw=0)
portrait.plot(states[:, 2], states[:, 5], lw=0.7)
portrait.plot(sol(np.array(passed))[:, 2], sol(np.array(passed))[:, 5], ".")
portrait.set(xlabel="angle of the bird (rad)", ylabel="its rate (rad/s)")
figure.savefig("woodpecker.png", dpi=120)
