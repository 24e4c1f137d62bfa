"""A ball that bounces: on a floor until it lies still, and on a table that vibrates.

    python examples/bouncing_ball.py

The impacts are an event with a reset, both expressions, which run in compiled code.  On the floor
the times of a hundred bounces are compared with their closed form.  On the table 2,000 balls, each
with another amplitude of the table, are one batch.  The phase of the table at their last impact
shows where the motion has the table's period, where twice or four times that, and where it is
chaotic (Holmes 1982, Journal of Sound and Vibration 84).
Writes bouncing_ball.png.
"""

import time

import numpy as np
from matplotlib.figure import Figure
from sympy import cos, symbols
from sympy.physics.mechanics import KanesMethod, Particle, Point, ReferenceFrame, dynamicsymbols

import mechc

RESTITUTION, DRIVE = 0.9, 2 * np.pi * 10.0  # of the table, rad/s
BALLS, PERIODS = 2_000, 300


def falling():
    """A ball of 1 kg at the height h above a table that moves by A cos(w t)."""
    h, v = dynamicsymbols("h v")
    g, A, w, t = *symbols("g A w"), dynamicsymbols._t
    frame, origin = ReferenceFrame("N"), Point("O")
    origin.set_vel(frame, 0)
    ball = origin.locatenew("ball", h * frame.x)
    ball.set_vel(frame, v * frame.x)
    force = -g + A * w**2 * cos(w * t)  # seen from the table
    kane = KanesMethod(frame, [h], [v], kd_eqs=[h.diff(t) - v])
    kane.kanes_equations([Particle("ball", ball, 1)], [(ball, force * frame.x)])
    return mechc.compile(kane, name="ball", defaults={"g": 9.81, "A": 0.0, "w": DRIVE})


model = falling()
bounce = mechc.Event("h < 0", reset={"v": f"-{RESTITUTION}*v"}, terminal=100)
sol = model.simulate(20.0, {"h": 1.0, "v": 0.0}, events=bounce, rtol=1e-12)
fall = np.sqrt(2 / 9.81)
flights = 2 * fall * RESTITUTION ** np.arange(1, 100)
exact = fall + np.concatenate([[0.0], np.cumsum(flights)])
print(f"100 bounces, at most {np.abs(sol.events[0].t - exact).max():.1e} s from the closed form")

strengths = np.linspace(1.18, 1.32, BALLS)  # of the table's acceleration, g
starts = np.column_stack([np.full(BALLS, 1e-3), np.zeros(BALLS)])
impact = mechc.Event("h < 0", reset={"v": "-0.8*v"})
begun = time.perf_counter()
batch = model.simulate_batch(
    PERIODS * 2 * np.pi / DRIVE, starts, {"A": strengths * 9.81 / DRIVE**2}, events=impact
)
seconds = time.perf_counter() - begun
print(f"{BALLS} balls with {batch.event_counts.sum()} impacts took {seconds:.1f} s")

figure = Figure(figsize=(7, 7), layout="constrained")
heights, phases = figure.subplots(2, 1)
times = np.linspace(0.0, sol.t[-1], 4000)
heights.plot(times, sol(times)[:, 0])
heights.set(xlabel="time (s)", ylabel="height (m)")
finished = batch.t == PERIODS * 2 * np.pi / DRIVE  # others have come to rest on the table
phase = np.degrees(batch.event_latest[:, 0] * DRIVE) % 360.0
phases.plot(strengths[finished], phase[finished], ".", ms=2)
phases.set(xlabel="acceleration of the table (g)", ylabel="phase of the last impact (°)")
figure.savefig("bouncing_ball.png", dpi=120)
