"""Dry friction that sticks: a block on a slope, a mass on a belt, and a clutch.

    python examples/stick_and_slip.py

Sticking is a constraint and its end an event, so that all times agree with closed forms: a block
is pushed up a slope and stays or slides back; a belt carries a mass on a spring until its static
friction does not hold it any more, again and again; a clutch is closed by a growing force, slips,
and takes its two discs along as one.
Writes stick_and_slip.png.
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

G, SLOPE = 9.81, 0.3  # m/s^2, rad
N, O, t = ReferenceFrame("N"), Point("O"), dynamicsymbols._t
O.set_vel(N, 0)


def mass():
    """A mass of 1 kg on a line with a constant force, and a spring to the origin."""
    q, u, force, k = *dynamicsymbols("q u"), *symbols("force k")
    point = O.locatenew("P", q * N.x)
    point.set_vel(N, u * N.x)
    kane = KanesMethod(N, [q], [u], kd_eqs=[q.diff(t) - u])
    kane.kanes_equations([Particle("mass", point, 1)], [(point, (force - k * q) * N.x)])
    return mechc.compile(kane, name="mass", defaults={"force": 0.0, "k": 0.0})


def clutch():
    """Two discs on an axis: one that turns, driven by a torque, and one at rest with a load."""
    a, b, w_a, w_b, J_a, J_b, drive, load = (
        *dynamicsymbols("a b w_a w_b"),
        *symbols("J_a J_b drive load"),
    )
    bodies, loads = [], []
    for name, angle, rate, J, torque in (("A", a, w_a, J_a, drive), ("B", b, w_b, J_b, -load)):
        frame = N.orientnew(name, "Axis", [angle, N.z])
        frame.set_ang_vel(N, rate * N.z)
        bodies.append(RigidBody(name, O, frame, 1, (inertia(frame, 0, 0, J), O)))
        loads.append((frame, torque * N.z))
    kane = KanesMethod(N, [a, b], [w_a, w_b], kd_eqs=[a.diff(t) - w_a, b.diff(t) - w_b])
    kane.kanes_equations(bodies, loads)
    values = {"J_a": 0.2, "J_b": 0.3, "drive": 4.0, "load": 1.0}
    return mechc.compile(kane, name="clutch", defaults=values)


figure = Figure(figsize=(7, 8), layout="constrained")
panels = figure.subplots(3, 1)

block = mass()
for mu in (0.5, 0.2):
    friction = mechc.DryFriction("u", mu, G * np.cos(SLOPE))
    weight = {"force": -G * np.sin(SLOPE)}
    sol = block.simulate(1.0, [0.0, 2.0], weight, events=friction, rtol=1e-11)
    up, down = (G * (np.sin(SLOPE) + way * mu * np.cos(SLOPE)) for way in (1, -1))
    rest = 1.0 - 2.0 / up
    off = sol.y[-1, 0] - (2.0 / up - max(down, 0.0) * rest**2 / 2)
    print(f"mu = {mu}: the block {sol.segments[-1].contacts[0]}, {abs(off):.0e} m off")
    times = np.linspace(0.0, 1.0, 300)
    panels[0].plot(times, sol(times)[:, 0], label=f"μ = {mu}")
panels[0].set(xlabel="time (s)", ylabel="way up the slope (m)")
panels[0].legend()

# Carried to 1.5 N / k, it slides at 1 N on an ellipse round 1 N / k until it has the belt's speed.
belt = mechc.DryFriction("u - 1/5", 1.0, static=1.5)
sol = block.simulate(30.0, [0.0, 0.0], {"k": 4.0}, events=belt, rtol=1e-11)
slips = [part.t1 - part.t0 for part in sol.segments if part.contacts[0] == "slides -"][1:-1]
exact = 2 * (np.pi - np.arctan(2.0 * 0.125 / 0.2)) / 2.0
print(f"{len(slips)} slips on the belt, {np.abs(np.array(slips) - exact).max():.0e} s off")
times = np.linspace(0.0, 30.0, 2000)
panels[1].plot(times, sol(times)[:, 0])
panels[1].set(xlabel="time (s)", ylabel="mass on a belt (m)")

# The clutch carries 10 t; w_a falls and w_b grows until they meet, then the drive turns both.
pressed = mechc.DryFriction("w_a - w_b", mu=1.0, normal="10*t")
discs = clutch()
sol = discs.simulate(3.0, {"w_a": 40.0, "w_b": 0.0, "a": 0.0, "b": 0.0}, events=pressed, rtol=1e-11)
slipping = 10 / 0.2 + 10 / 0.3  # of the difference of the rates: 40 + 70/3 t - slipping t^2 / 2
closed = ((4 / 0.2 + 1 / 0.3) + np.sqrt((4 / 0.2 + 1 / 0.3) ** 2 + 2 * slipping * 40)) / slipping
sticks = sol.segments[-1].t0
print(f"the clutch holds at {sticks:.6f} s, {abs(sticks - closed):.0e} s off")
times = np.linspace(0.0, 3.0, 1000)
panels[2].plot(times, sol(times)[:, 2:], label=["driven disc", "loaded disc"])
panels[2].set(xlabel="time (s)", ylabel="rates of a clutch (rad/s)")
panels[2].legend()
figure.savefig("stick_and_slip.png", dpi=120)
