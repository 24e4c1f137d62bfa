"""
A cart with a motor
===================

A motor of direct current moves a cart by a rack; on the cart stands a rod.  The current is a state
of its own, with the coil's differential equation.  A linear regulator, whose gains follow from the
linear model, balances the rod by the voltage.
"""

import numpy as np
import sympy as sm
import sympy.physics.mechanics as me
from scipy.linalg import solve_continuous_are

import mechc

x, theta, v, omega, i, V = me.dynamicsymbols("x theta v omega i V")
M, m, l, g, K, R, L = sm.symbols("M m l g K R L")
N, O = me.ReferenceFrame("N"), me.Point("O")
A = N.orientnew("rod", "Axis", (theta, N.z))
A.set_ang_vel(N, omega * N.z)
O.set_vel(N, 0)
pivot = O.locatenew("pivot", x * N.x)
pivot.set_vel(N, v * N.x)
middle = pivot.locatenew("middle", l / 2 * A.y)
middle.v2pt_theory(pivot, N, A)
tip = middle.locatenew("tip", l / 2 * A.y)
rod = me.RigidBody("rod", middle, A, m, (m * l**2 / 12 * me.inertia(A, 1, 0, 1), middle))
kane = me.KanesMethod(N, [x, theta], [v, omega], [x.diff() - v, theta.diff() - omega])
kane.kanes_equations(
    [me.Particle("cart", pivot, M), rod], [(pivot, K * i * N.x), (middle, -m * g * N.y)]
)

model = mechc.compile(
    kane,
    states={i: (V - R * i - K * v) / L},
    defaults={
        "M": 1.0, "m": 0.3, "l": 0.6, "g": 9.81, "K": 5.0, "R": 1.0, "L": 0.01,
    },
    outputs=("energy", "state_jacobian"),
    drawing=mechc.Drawing(
        traced=("tip",), solids=(mechc.Solid.box("cart", pivot, N, (0.25, 0.1, 0.15)),)
    ),
)  # fmt: skip

# %%
# The gains of the regulator, by the linear model about the upright equilibrium.

upright = model.with_inputs({"V": 0.0}).linearize(np.zeros(5), inputs=["V"])
weights = np.diag([10.0 if name in ("x", "theta") else 0.1 for name in upright.states])
gains = (upright.B.T @ solve_continuous_are(upright.A, upright.B, weights, np.eye(1) * 0.05))[
    0
] / 0.05
place = [[*model.coordinates, *model.speeds].index(name) for name in upright.states]


def voltage(t, q, u):
    return -gains @ np.array([*q, *u])[place]


sol = model.simulate(6, {"x": 0.0, "theta": 0.25}, inputs={"V": voltage})
print(
    f"the cart moves by {np.ptp(sol['x']):.2f} m, the current is up to {abs(sol['i']).max():.1f} A"
)
assert abs(sol.y[-1]).max() < 0.01

# %%
sol.view()
