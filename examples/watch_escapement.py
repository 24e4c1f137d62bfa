"""A watch: the escapement keeps its balance wheel swinging and lets the train go on tooth by tooth.

    python examples/watch_escapement.py

Between the angles -a and a of its swing the balance is pushed by a pallet; where it leaves them the
escape wheel drops by half a tooth.  So the pallet's torque and the angle of the wheel are numbers
that events reset: states whose rate is zero.  Between the events the motion is linear, and so the
limit cycle has a closed form, with which amplitude and period are compared.  A batch of 400
mainsprings shows the amplitude and how the rate follows the torque (Airy's isochronism error).
Writes watch_escapement.png.
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

BEATS, TEETH = 5.0, 15  # half swings a second, teeth of the escape wheel
LIFT, QUALITY = np.radians(25.0), 200.0  # a; how slowly the balance comes to rest
INERTIA, TORQUE = 1.2e-9, 2.4e-8  # kg m², N m
OMEGA = np.pi * BEATS


def balance():
    """The balance wheel at the angle q, its hairspring k, damping c, and what events reset."""
    q, u, pallet, wheel = dynamicsymbols("q u pallet wheel")
    c, k, torque, t = *symbols("c k torque"), dynamicsymbols._t
    frame, staff = ReferenceFrame("N"), Point("O")
    staff.set_vel(frame, 0)
    turned = frame.orientnew("B", "Axis", (q, frame.z))
    turned.set_ang_vel(frame, u * frame.z)
    body = RigidBody("balance", staff, turned, 1e-4, (inertia(turned, 0, 0, INERTIA), staff))
    kane = KanesMethod(frame, [q], [u], kd_eqs=[q.diff(t) - u])
    kane.kanes_equations([body], [(turned, (torque * pallet - k * q - c * u) * frame.z)])
    given = {"k": INERTIA * OMEGA**2, "c": INERTIA * OMEGA / QUALITY, "torque": TORQUE}
    return mechc.compile(kane, name="watch", states={pallet: 0, wheel: 0}, defaults=given)


def escapement():
    """The pallet pushes from the side of the rest on; the wheel drops where it lets go."""
    drop = {"pallet": 0, "wheel": f"wheel + {np.pi / TEETH}"}
    return [
        mechc.Event(f"q > {-LIFT}", reset={"pallet": 1}),
        mechc.Event(f"q > {LIFT}", reset=drop),
        mechc.Event(f"q < {LIFT}", reset={"pallet": -1}),
        mechc.Event(f"q < {-LIFT}", reset=drop),
    ]


def limit_cycle(torque):
    """Amplitude and period, by the linear motion between the events, in closed form."""
    rate, spring = 0.5 * OMEGA / QUALITY, INERTIA * OMEGA**2
    swing = np.sqrt(OMEGA**2 - rate**2)

    def moved(q, u, t, middle):
        """After a time t under a constant torque, about the angle of rest `middle`."""
        decay, x = np.exp(-rate * t), q - middle
        cosine, sine = np.cos(swing * t), np.sin(swing * t) / swing
        return (
            middle + decay * (x * cosine + (u + rate * x) * sine),
            decay * (u * cosine - (OMEGA**2 * x + rate * u) * sine),
        )

    def until(state, middle, component, value):
        """The state where a component first has a value, and the time until then."""
        late = 0.9 * np.pi / swing
        t = brentq(lambda t: moved(*state, t, middle)[component] - value, 1e-9, late)
        return moved(*state, t, middle), t

    def half(amplitude):
        """From rest at -amplitude to rest on the other side: the angle there, and the time."""
        state, free = until((-amplitude, 0.0), 0.0, 0, -LIFT)
        state, pushed = until(state, torque / spring, 0, LIFT)
        state, rest = until(state, 0.0, 1, 0.0)
        return state[0], free + pushed + rest

    amplitude = brentq(lambda a: half(a)[0] - a, 1.05 * LIFT, 12 * np.pi, xtol=1e-14)
    return amplitude, 2 * half(amplitude)[1]


model, events = balance(), escapement()
start = {"q": 2 * LIFT}
turns = mechc.Event("u", direction=-1)  # the balance is at rest, on its far side
sol = model.simulate(400.0, start, events=[*events, turns], rtol=1e-11, max_steps=10**6)
found = sol.events[-1].y[-1, 0], np.diff(sol.events[-1].t[-2:])[0]
exact = limit_cycle(TORQUE)
off = max(abs(a / b - 1) for a, b in zip(found, exact, strict=True))
print(
    f"limit cycle: {np.degrees(found[0]):.4f} deg, {found[1]:.9f} s, {off:.0e} from the closed form"
)
drops = len(sol.events[1].t) + len(sol.events[3].t)
print(
    f"{drops} drops turned the wheel by {np.degrees(sol['wheel'][-1]) / 180 * TEETH:.3f} half teeth"
)

torques = np.linspace(0.4, 2.0, 400) * TORQUE
amplitude = np.array([limit_cycle(torque)[0] for torque in torques])
state = np.column_stack([-amplitude, np.zeros((400, 3))])  # q, pallet, wheel, u
batch = model.simulate_batch(40.0, state, {"torque": torques}, events=[*events, turns], rtol=1e-11)
period = batch.event_latest[:, -1] / (batch.event_counts[:, -1] - 0.5)  # from the other side on
rates = 86400 * (2 / BEATS / period - 1)
known = [86400 * (2 / BEATS / limit_cycle(torque)[1] - 1) for torque in torques]
print(f"400 mainsprings: rates within {np.abs(rates - known).max():.0e} s a day of the closed form")

figure = Figure(figsize=(8, 7), layout="constrained")
(first, wheel), (gained, grown) = figure.subplots(2, 2)
times = np.linspace(0.0, 4.0, 4000)
first.plot(times, np.degrees(sol(times)[:, 0]))
first.set(xlabel="time (s)", ylabel="angle of the balance (°)")
wheel.plot(times, np.degrees(sol(times)[:, 2]))
wheel.set(xlabel="time (s)", ylabel="angle of the escape wheel (°)")
gained.plot(torques * 1e9, rates, lw=3, alpha=0.4)
gained.plot(torques * 1e9, known, lw=1)
gained.set(xlabel="torque at the pallet (nN m)", ylabel="rate (s a day)")
grown.plot(torques * 1e9, np.degrees(amplitude))
grown.set(xlabel="torque at the pallet (nN m)", ylabel="amplitude (°)")
figure.savefig("watch_escapement.png", dpi=120)
