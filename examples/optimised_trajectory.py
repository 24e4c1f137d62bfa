"""A crane that moves its load by four metres in 2.5 seconds, with the least force.

    python examples/optimised_trajectory.py

The force is a sum of sines; its coefficients are parameters of the compiled model.  SciPy's SLSQP
makes the sum of their squares least, so that the load ends at its place and at rest; the end state
and its derivatives by all coefficients come from one run.
Writes optimised_trajectory.png.
"""

import numpy as np
import sympy as sm
from matplotlib.figure import Figure
from scipy.optimize import minimize
from sympy.physics.mechanics import KanesMethod, Particle, Point, ReferenceFrame, dynamicsymbols

import mechc

SECONDS, TERMS = 2.5, 8
START = np.zeros(4)  # the crane at 0, the load hanging, at rest
END = np.array([4.0, 0.0, 0.0, 0.0])


def crane():
    """A load of 3 kg on a rope of 1.5 m under a crane of 2 kg, pushed by a sum of sines."""
    t = dynamicsymbols._t
    x, angle, v, w, force = dynamicsymbols("x angle v w force")
    frame, origin = ReferenceFrame("N"), Point("O")
    origin.set_vel(frame, 0)
    trolley = origin.locatenew("trolley", x * frame.x)
    trolley.set_vel(frame, v * frame.x)
    rope = frame.orientnew("rope", "Axis", (angle, frame.z))
    rope.set_ang_vel(frame, w * frame.z)
    load = trolley.locatenew("load", -1.5 * rope.y)
    load.v2pt_theory(trolley, frame, rope)
    method = KanesMethod(frame, [x, angle], [v, w], kd_eqs=[x.diff(t) - v, angle.diff(t) - w])
    loads = [(trolley, force * frame.x), (load, -3.0 * 9.81 * frame.y)]
    method.kanes_equations([Particle("trolley", trolley, 2.0), Particle("load", load, 3.0)], loads)
    terms = sm.symbols(f"a_1:{TERMS + 1}")
    push = sum(a * sm.sin(k * sm.pi * t / SECONDS) for k, a in enumerate(terms, start=1))
    return mechc.compile(
        method,
        name="crane",
        inputs={force: push},
        defaults=dict.fromkeys(terms, 0.0),
        outputs=("energy", "points", "sensitivities"),
    )


model = crane()
NAMES = [f"a_{k}" for k in range(1, TERMS + 1)]


def end_state(coefficients):
    """How far the load ends from its place and from rest (4,)."""
    params = dict(zip(NAMES, coefficients, strict=True))
    return model.simulate(SECONDS, START, params).y[-1] - END


def end_slopes(coefficients):
    """Its derivatives (4, 8)."""
    params = dict(zip(NAMES, coefficients, strict=True))
    sol = model.simulate(SECONDS, START, params, sensitivities=NAMES)
    return np.stack([sol.sensitivity[name][-1] for name in NAMES], axis=-1)


def optimised():
    """The coefficients that need the least force; SciPy's result."""
    return minimize(
        lambda a: 0.01 * a @ a,
        np.zeros(TERMS),
        jac=lambda a: 0.02 * a,
        constraints={"type": "eq", "fun": end_state, "jac": end_slopes},
        method="SLSQP",
        options={"ftol": 1e-10, "maxiter": 200},
    )


def force_of(coefficients, t):
    """The push over time, N."""
    k = np.arange(1, TERMS + 1)
    return np.sin(np.pi * np.outer(t, k) / SECONDS) @ coefficients


def picture(coefficients):
    """The force, the angle of the rope, and the motion, a picture every tenth of a second."""
    sol = model.simulate(SECONDS, START, dict(zip(NAMES, coefficients, strict=True)))
    t = np.linspace(0.0, SECONDS, 400)
    y = sol(t)
    figure = Figure(figsize=(7.4, 6.4), layout="constrained")
    force, angle, space = figure.subplots(3, 1, height_ratios=(1, 1, 1.5))
    force.plot(t, force_of(coefficients, t), color="#0072B2")
    force.set(ylabel="force (N)", xlabel="time (s)")
    angle.plot(t, np.degrees(y[:, 1]), color="#D55E00")
    angle.set(ylabel="rope (°)", xlabel="time (s)")
    for k in range(0, len(t), 16):
        x, turn, shade = y[k, 0], y[k, 1], 0.15 + 0.85 * k / len(t)
        space.plot([x, x + 1.5 * np.sin(turn)], [0, -1.5 * np.cos(turn)], "o-", color="#0072B2",
                   alpha=shade, markersize=4)  # fmt: skip
    space.axhline(0.0, color="#9ca3af", linewidth=0.8)
    space.set(aspect="equal", xlabel="x (m)", ylabel="y (m)")
    return figure


if __name__ == "__main__":
    result = optimised()
    print(result.message)
    print("coefficients in N:", np.round(result.x, 3))
    print(f"the motion ends {np.abs(end_state(result.x)).max():.1e} from its place and from rest")
    picture(result.x).savefig("optimised_trajectory.png", dpi=120)
