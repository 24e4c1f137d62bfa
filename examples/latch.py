"""A latch: a drawer snaps shut behind a pawl on a spring, and stays until the pawl is lifted.

    python examples/latch.py

A pin on the drawer meets the round tooth of the pawl, lifts it, passes below it and is pushed back
against it by the drawer's spring.  There the line of the force passes the pawl's pivot on the side
that shuts it, so that the pawl is pressed on its rest.  Tooth, rest
and an upper stop are each a mechc.Stop.  From
1 s on a torque that grows lifts the pawl; it opens when it outweighs both springs.  The first
impact, where the drawer is held and when the pawl is lifted have closed forms.
Writes latch.png.
"""

import numpy as np
from matplotlib.figure import Figure
from sympy import symbols
from sympy.physics.mechanics import (
    KanesMethod,
    Particle,
    Point,
    ReferenceFrame,
    RigidBody,
    dynamicsymbols,
    inertia,
)

import mechc

DATA = {
    "m": 0.5, "J": 2e-5,  # kg, kg m^2: drawer, and pawl about its pivot
    "k": 200.0, "x_0": 0.06,  # N/m, m: the drawer's spring, how far it reaches before the tooth
    "c": 0.2, "phi_0": 0.5,  # N m/rad, rad: the pawl's spring and its preload
}  # fmt: skip
WIDE, HIGH = 0.03, 0.04  # m: the tooth's centre is so far before the pawl's pivot and above it
REACH, LOW = 0.010, 0.004  # m: radii of pin and tooth; the pin's way lies so far below the tooth
RESTITUTION, PULLED, GROWTH, HIGHEST = 0.2, 1.0, 2.0, 0.35  # 1, s, N m/s, rad
SHUT, SPEED, SECONDS = -0.05, 1.8, 1.34  # m, m/s, s: the drawer's start


def latch():
    """x of the drawer's pin, 0 below the tooth; phi of the pawl, 0 on its rest."""
    x, phi, v, omega, pull = dynamicsymbols("x phi v omega pull")
    m, J, k, x_0, c, phi_0 = symbols("m J k x_0 c phi_0")
    N, O, t = ReferenceFrame("N"), Point("O"), dynamicsymbols._t
    O.set_vel(N, 0)
    pin, pawl = O.locatenew("pin", x * N.x), N.orientnew("pawl", "Axis", [-phi, N.z])
    pin.set_vel(N, v * N.x)
    pawl.set_ang_vel(N, -omega * N.z)
    turning = pull * (t - PULLED) - c * (phi + phi_0)
    loads = [(pin, -k * (x + x_0) * N.x), (pawl, -turning * N.z)]
    kane = KanesMethod(N, [x, phi], [v, omega], kd_eqs=[x.diff(t) - v, phi.diff(t) - omega])
    bodies = [
        Particle("drawer", pin, m),
        RigidBody("pawl", O, pawl, 1, (inertia(pawl, 0, 0, J), O)),
    ]
    kane.kanes_equations(bodies, loads)
    return mechc.compile(kane, name="latch", states={pull: 0}, defaults=DATA)


TOOTH = (
    f"{WIDE}*(1 - cos(phi)) + {HIGH}*sin(phi)",
    f"{WIDE}*sin(phi) - {HIGH}*(1 - cos(phi))",
)
EVENTS = [
    mechc.Stop(f"sqrt((x - ({TOOTH[0]}))**2 + ({LOW} + {TOOTH[1]})**2) - {REACH}", RESTITUTION),
    mechc.Stop("phi", RESTITUTION),
    mechc.Stop(f"{HIGHEST} - phi", RESTITUTION),
    mechc.Event(f"t > {PULLED}", reset={"pull": str(GROWTH)}),
    mechc.Event("x < -0.02", reset={"pull": "0"}),
]

model = latch()
start = {"x": SHUT, "v": SPEED, "phi": 0.0, "pull": 0.0}
sol = model.simulate(SECONDS, start, events=EVENTS, rtol=1e-11)
print(sol.status)
before, after = sol.segments[0].y1, sol.segments[1].y0

# The tooth is met where the centres are 10 mm apart; slopes of the gap by x and phi there.
behind = np.sqrt(REACH**2 - LOW**2)
by_x, by_phi = -behind / REACH, (behind * HIGH + LOW * WIDE) / REACH
mass = 1.0 / (by_x**2 / DATA["m"] + by_phi**2 / DATA["J"])
impulse = -(1.0 + RESTITUTION) * mass * by_x * before[3]
off = after[3:] - before[3:] - impulse * np.array([by_x / DATA["m"], by_phi / DATA["J"]])
print(f"the first impact: {impulse:.6f} N s, rates {np.abs(off).max():.0e} from the closed form")

# Held, the pin is as far behind the tooth; the pawl opens when the torque is that of both springs.
held = [part for part in sol.segments if part.contacts[:2] == ("held", "held")]
force = DATA["k"] * (behind + DATA["x_0"])
torque = DATA["c"] * DATA["phi_0"] + force * (HIGH * behind - WIDE * LOW) / behind
off = max(abs(part.y0[0] - behind) for part in held)
print(f"held by {force:.3f} N at {1e3 * behind:.4f} mm, {off:.0e} m from the closed form")
lifted = PULLED + torque / GROWTH
off = abs(held[-1].t1 - lifted)
print(f"the pawl is lifted by {torque:.4f} N m at {lifted:.6f} s, {off:.0e} s from the closed form")

figure = Figure(figsize=(7, 7), layout="constrained")
panels = figure.subplots(2, 2, sharey="col")
for row, (first, last) in enumerate(((0.0, 0.15), (held[-1].t1 - 0.05, SECONDS))):
    times = np.linspace(first, last, 2000)
    x, phi = sol(times)[:, :2].T
    for panel, value, name in zip(
        panels[row], (1e3 * x, phi), ("pin of the drawer (mm)", "pawl (rad)"), strict=True
    ):
        panel.plot(times, value)
        panel.set(xlabel="time (s)", ylabel=name)
        for part in held:
            left, right = max(part.t0, first), min(part.t1, last)
            if left < right:
                panel.axvspan(left, right, alpha=0.15, lw=0)
figure.savefig("latch.png", dpi=120)
