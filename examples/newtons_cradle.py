"""Newton's cradle, with balls a little apart and with balls that touch.

    python examples/newtons_cradle.py

Five pendulums in a row; between neighbours is a stop (mechc.Stop), an impact by Newton's law of
restitution.  Where the balls are apart the impacts follow each other, and one ball leaves at the
other end.  Where they touch all stops are hit at once, and all balls move off (Moreau 1988);
later on four of them swing together, in contacts that last until one lifts off.
Energy never grows.
Writes newtons_cradle.png.
"""

import numpy as np
from matplotlib.figure import Figure
from sympy import cos, sin, symbols
from sympy.physics.mechanics import KanesMethod, Particle, Point, ReferenceFrame, dynamicsymbols

import mechc

BALLS, RESTITUTION, SECONDS = 5, 0.98, 6.0
RELEASED = np.radians([-30.0, 0.0, 0.0, 0.0, 0.0])


def cradle():
    """Pendulums of one length, side by side; the gaps are those between their angles."""
    q, u = dynamicsymbols(f"q_:{BALLS}"), dynamicsymbols(f"u_:{BALLS}")
    m, length, g = symbols("m l g")
    frame, origin = ReferenceFrame("N"), Point("O")
    origin.set_vel(frame, 0)
    bodies, loads = [], []
    for k in range(BALLS):
        ball = origin.locatenew(f"P_{k}", length * (sin(q[k]) * frame.x - cos(q[k]) * frame.y))
        ball.set_vel(frame, length * u[k] * (cos(q[k]) * frame.x + sin(q[k]) * frame.y))
        bodies.append(Particle(f"ball_{k}", ball, m))
        loads.append((ball, -m * g * frame.y))
    t = dynamicsymbols._t
    rates = [a.diff(t) - b for a, b in zip(q, u, strict=True)]
    kane = KanesMethod(frame, q, u, kd_eqs=rates)
    kane.kanes_equations(bodies, loads)
    return mechc.compile(kane, name="cradle", defaults={"m": 0.1, "l": 0.2, "g": 9.81})


model = cradle()
figure = Figure(figsize=(7, 6), layout="constrained")
for panel, gap, words in zip(
    figure.subplots(2, 1, sharex=True), (1e-3, 0.0), ("1 mrad apart", "touching"), strict=True
):
    stops = [mechc.Stop(f"q_{k + 1} - q_{k} + {gap}", RESTITUTION) for k in range(BALLS - 1)]
    sol = model.simulate(
        SECONDS, np.concatenate([RELEASED, np.zeros(BALLS)]), events=stops, max_steps=20_000
    )
    energies = sol.energy
    first = sol.segments[1 if gap == 0.0 else BALLS - 1].y0[BALLS:]
    arriving = np.abs(sol.segments[0].y1[BALLS:]).max()
    share = np.round(first / arriving, 2)
    print(f"{words}: of the speed that arrives the balls leave with {share}")
    print(f"  {sum(len(record.t) for record in sol.events)} impacts, {sol.status.code}; "
          f"the energy grew by {max(np.diff(energies).max(), 0.0):.0e} J at most")  # fmt: skip
    times = np.linspace(0.0, sol.t[-1], 3000)
    angles = np.degrees(sol(times)[:, :BALLS])
    for k in range(BALLS):
        panel.plot(times, angles[:, k], label=f"ball {k + 1}", lw=1)
    panel.set(title=words, ylabel="angle (°)", xlim=(0.0, SECONDS))
panel.set_xlabel("time (s)")
panel.legend(ncols=BALLS, loc="lower right", fontsize="small")
figure.savefig("newtons_cradle.png", dpi=120)
