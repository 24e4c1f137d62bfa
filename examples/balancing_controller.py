"""Two pendulums on top of each other, balanced on a cart by a controller in discrete time.

    python examples/balancing_controller.py

The gains are those of a linear-quadratic regulator for the linear model about the upright
equilibrium (scipy.linalg.solve_continuous_are).  The controller reads the state 200 times a second,
and its force is applied 2 ms later: within one run (mechc.Sampled), in a batch of twenty starts,
and with a stepper as a controller outside would do it, whose latency is measured.
Writes balancing_controller.png.
"""

import time

import numpy as np
from matplotlib.figure import Figure
from scipy.linalg import solve_continuous_are
from sympy.physics.mechanics import KanesMethod, Particle, Point, ReferenceFrame, dynamicsymbols

import mechc

PERIOD, DELAY, SECONDS = 0.005, 0.002, 3.0
START = np.array([0.0, 0.12, -0.06, 0.0, 0.0, 0.0])  # m, rad; at rest


def cart():
    """A cart of 1 kg, pushed by F, with two rods of 0.5 m that carry 0.3 kg and 0.2 kg."""
    t = dynamicsymbols._t
    x, a, b, v, w_a, w_b, force = dynamicsymbols("x a b v w_a w_b F")
    frame, origin = ReferenceFrame("N"), Point("O")
    origin.set_vel(frame, 0)
    pivot = origin.locatenew("pivot", x * frame.x)
    pivot.set_vel(frame, v * frame.x)
    bodies, loads = [Particle("cart", pivot, 1.0)], [(pivot, force * frame.x)]
    below = pivot
    for name, angle, speed, mass in (("lower", a, w_a, 0.3), ("upper", b, w_b, 0.2)):
        rod = frame.orientnew(name, "Axis", (angle, frame.z))
        rod.set_ang_vel(frame, speed * frame.z)
        tip = below.locatenew(f"{name}_tip", 0.5 * rod.y)
        tip.v2pt_theory(below, frame, rod)
        bodies.append(Particle(f"{name}_mass", tip, mass))
        loads.append((tip, -9.81 * mass * frame.y))
        below = tip
    rates = [x.diff(t) - v, a.diff(t) - w_a, b.diff(t) - w_b]
    method = KanesMethod(frame, [x, a, b], [v, w_a, w_b], kd_eqs=rates)
    method.kanes_equations(bodies, loads)
    outputs = ("energy", "state_jacobian")
    return mechc.compile(method, name="cart", outputs=outputs)


def gains(model):
    """Of the regulator: force = -K (q, u), upright at rest."""
    upright = model.with_inputs({"F": 0.0}).linearize(np.zeros(6), inputs=["F"])
    order = [upright.states.index(name) for name in (*model.coordinates, *model.speeds)]
    A, B = upright.A[np.ix_(order, order)], upright.B[order]
    cost = solve_continuous_are(A, B, np.diag([10.0, 10.0, 10.0, 1.0, 1.0, 1.0]), np.eye(1) * 0.1)
    return (B.T @ cost)[0] / 0.1


model = cart()
K = gains(model)
sampled = mechc.Sampled(lambda t, q, u: -K @ np.concatenate([q, u]), PERIOD, DELAY)
sol = model.simulate(SECONDS, START, inputs={"F": sampled}, rtol=1e-9)
force = sol.model.system.driven.given["F"]

leaning = START * np.linspace(1.0, -1.0, 20)[:, None]
batch = model.simulate_batch(
    SECONDS, leaning, inputs={"F": sampled}, rtol=1e-9, reduce=["max(abs(x))"]
)
same = np.abs(batch.y[0] - sol.y[-1]).max()
lean, way = np.abs(batch.y[:, 1:3]).max(), batch["max(abs(x))"].max()
print(f"in a batch the first of {len(batch)} ends {same:.1e} apart; all end within {lean:.1e} rad "
      f"of upright, the cart goes {way:.2f} m at most")  # fmt: skip

stepper = model.stepper(START, inputs={"F": 0.0}, rtol=1e-9)
held, latency = 0.0, []
for _ in range(round(SECONDS / PERIOD)):
    wanted = -K @ stepper.y
    stepper.step(DELAY, {"F": held})
    begun = time.perf_counter()
    stepper.step(PERIOD - DELAY, {"F": wanted})
    latency.append(time.perf_counter() - begun)
    held = wanted
apart = np.abs(stepper.y - sol.y[-1]).max()
print(f"{sol.status.code} after {len(latency)} instants; the stepper ends {apart:.1e} apart")
print(f"a step takes {1e6 * np.median(latency):.1f} us, 99 % of them under "
      f"{1e6 * np.quantile(latency, 0.99):.1f} us")  # fmt: skip
print(f"at the end: {np.abs(sol.y[-1, 1:3]).max():.1e} rad from upright")

figure = Figure(figsize=(7, 7), layout="constrained")
angles, forces, steps = figure.subplots(3, 1)
angles.plot(sol.t, np.degrees(sol["a"]), label="lower rod")
angles.plot(sol.t, np.degrees(sol["b"]), label="upper rod")
angles.set(xlabel="time (s)", ylabel="from upright (°)", xlim=(0, 2))
angles.legend()
times = np.linspace(0, 0.25, 2000)
forces.plot(times, force(times), drawstyle="steps-post")
forces.set(xlabel="time (s)", ylabel="force (N)", xlim=(0, 0.25))
steps.hist(1e6 * np.array(latency), bins=np.linspace(0, 2e6 * np.median(latency), 60))
steps.set(xlabel="latency of a step (µs)", ylabel="steps")
figure.savefig("balancing_controller.png", dpi=120)
