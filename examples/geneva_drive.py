"""A Geneva drive with play: a pin turns a wheel of four slots by a quarter, and it rests between.

    python examples/geneva_drive.py

A crank with a motor carries a pin.  While the pin is in a slot of the wheel, two stops are the
walls of the slot; meanwhile the wheel may differ from the ideal drive by the play, and where a wall
presses by how much has a closed form.  Then the locking disc keeps the wheel, two stops again,
whose play is wide at their ends; dry friction in the wheel's bearing brings it to rest.  Slots and
locking take turns in runs that end at an event.
Writes geneva_drive.png.
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

CRANK, PLAY, RESTITUTION = 0.04, 1e-4, 0.3  # m, m: half of what a slot is wider than the pin
BETWEEN, SPEED, TURNS = CRANK * np.sqrt(2.0), 2 * np.pi, 4  # m, rad/s, revolutions
LOOSE, TIGHT = (
    1.1 * PLAY / CRANK,
    0.3 * PLAY / CRANK,
)  # rad: play of the locking at its ends, inside
DATA = {"J_1": 2e-3, "J_2": 1e-3, "c": 0.5}  # kg m^2, kg m^2, N m s/rad: crank, wheel, motor
BEARING = 0.01  # N m: friction of the wheel
QUARTER = np.pi / 4


def drive():
    """theta of the crank, phi of the wheel: 0 with the pin, and a slot, between the axes."""
    theta, phi, omega, w = dynamicsymbols("theta phi omega w")
    J_1, J_2, c, Omega = symbols("J_1 J_2 c Omega")
    N, O, t = ReferenceFrame("N"), Point("O"), dynamicsymbols._t
    O.set_vel(N, 0)
    bodies, loads = [], []
    for name, angle, rate, J, torque in (
        ("crank", theta, omega, J_1, c * (Omega - omega)), ("wheel", phi, w, J_2, 0),
    ):  # fmt: skip
        frame = N.orientnew(name, "Axis", [angle, N.z])
        frame.set_ang_vel(N, rate * N.z)
        bodies.append(RigidBody(name, O, frame, 1, (inertia(frame, 0, 0, J), O)))
        loads.append((frame, torque * N.z))
    kane = KanesMethod(N, [theta, phi], [omega, w], kd_eqs=[theta.diff(t) - omega, phi.diff(t) - w])
    kane.kanes_equations(bodies, loads)
    return mechc.compile(kane, name="geneva_drive", defaults=DATA | {"Omega": SPEED})


def ideal(theta):
    """The wheel's angle without play, and how far the pin is from the wheel's axis."""
    along, across = BETWEEN - CRANK * np.cos(theta), CRANK * np.sin(theta)
    return -np.arctan2(across, along), np.hypot(along, across)


OFF = f"(({BETWEEN} - {CRANK}*cos(theta))*sin(phi) + {CRANK}*sin(theta)*cos(phi))"
GUIDE = f"({TIGHT} + {LOOSE - TIGHT}*((1 + cos(theta))/{1 + np.cos(QUARTER)})**4)"
REST = mechc.DryFriction("w", mu=BEARING, normal="1")
IN_SLOT = [
    mechc.Stop(f"{PLAY} - {OFF}", RESTITUTION), mechc.Stop(f"{PLAY} + {OFF}", RESTITUTION), REST,
    mechc.Event(f"theta > {QUARTER}", terminal=True),
]  # fmt: skip
LOCKED = [
    mechc.Stop(f"{GUIDE} - (phi + {QUARTER})"), mechc.Stop(f"{GUIDE} + (phi + {QUARTER})"), REST,
    mechc.Event(f"theta > {2 * np.pi - QUARTER}", terminal=True),
]  # fmt: skip

model = drive()
t, y, runs = 0.0, np.array([-QUARTER, QUARTER, SPEED, 0.0]), []
for turn in range(TURNS):
    for events in (IN_SLOT, LOCKED):
        runs.append((turn, model.simulate([t, t + 2.0], y, events=events, rtol=1e-10)))
        t, y = runs[-1][1].t[-1], runs[-1][1].y[-1].copy()
    y[:2] += [-2 * np.pi, 2 * QUARTER]  # the next slot
in_slot, locked = [sol for _, sol in runs[::2]], [sol for _, sol in runs[1::2]]
turned = (y[1] - QUARTER - TURNS * 2 * QUARTER) / (2 * QUARTER)
print(f"{TURNS} revolutions turn the wheel by {turned:.3f} quarters")

# Where a wall presses the pin is off the slot's middle by the play.
pressed, off = 0.0, 0.0
for sol in in_slot:
    for part in sol.segments:
        if "held" in part.contacts[:2]:
            pressed += part.t1 - part.t0
            theta, phi = sol(np.linspace(part.t0, part.t1, 100)[1:-1])[:, :2].T
            without, distance = ideal(theta)
            ahead = np.arcsin(PLAY / distance) * (1 if part.contacts[0] == "held" else -1)
            off = max(off, np.abs(phi - without - ahead).max())
    phi = sol.y[:, 1] - ideal(sol.y[:, 0])[0]
    assert (np.abs(phi) <= np.arcsin(PLAY / ideal(sol.y[:, 0])[1]) + 1e-9).all()
print(f"a wall presses for {pressed / t:.1%} of the time: {off:.0e} rad from the closed form")

# At the first impact in a slot both rates change by one impulse, and energy is lost.
sol = in_slot[0]
first = min(record.t[0] for record in sol.events[:2] if len(record.t))
number = next(k for k, part in enumerate(sol.segments) if part.t1 == first)
before, after = sol.segments[number].y1, sol.segments[number + 1].y0
theta, phi = before[:2]
rows = np.array([CRANK * np.cos(theta - phi), ideal(theta)[1] * np.cos(phi - ideal(theta)[0])])
shares, closing = rows / [DATA["J_1"], DATA["J_2"]], rows @ before[2:]
mass = 1.0 / (rows @ shares)
off = np.abs(after[2:] - before[2:] + (1 + RESTITUTION) * mass * closing * shares).max()
lost = model.energy(before) - model.energy(after)
off_lost = abs(lost - 0.5 * mass * (1 - RESTITUTION**2) * closing**2)
print(f"the first impact takes {1e3 * lost:.4f} mJ: {off_lost:.0e} J, rates {off:.0e} rad/s off")
still = sum(p.t1 - p.t0 for sol in locked for p in sol.segments if p.contacts[2] == "sticks")
print(f"the wheel is still for {still / t:.1%} of the time")

figure = Figure(figsize=(7, 8), layout="constrained")
angles, offs, rates = figure.subplots(3, 1, sharex=True)
for turn, sol in runs:
    times = np.linspace(sol.t[0], sol.t[-1], 1500)
    states = sol(times)
    angles.plot(times, states[:, 1] - 2 * QUARTER * turn, "C0")
    rates.plot(times, states[:, 3], "C0", lw=1)
    if sol in in_slot:
        without, distance = ideal(states[:, 0])
        offs.plot(times, 1e3 * distance * np.sin(states[:, 1] - without), "C0", lw=1)
for panel in (angles, offs, rates):
    for sol in locked:
        panel.axvspan(sol.t[0], sol.t[-1], color="C1", alpha=0.1, lw=0)
angles.set(ylabel="wheel (rad)")
offs.set(ylabel="pin off the slot's middle (mm)")
rates.set(xlabel="time (s)", ylabel="rate of the wheel (rad/s)")
figure.savefig("geneva_drive.png", dpi=120)
