"""
Peaucellier's cell
==================

Seven rods turn a circle into an exactly straight line (C.-N. Peaucellier, 1864): the product of
the distances of B and P from the fixed point is constant.  The cell here hangs from gravity like
a pendulum.
"""

import numpy as np
import sympy as sm
import sympy.physics.mechanics as me

import mechc

# %%
# Every joint is a point mass with two coordinates, every rod a distance that does not change.

t = me.dynamicsymbols._t
m, g = sm.symbols("m g", positive=True)
N, O = me.ReferenceFrame("N"), me.Point("O")
O.set_vel(N, 0)
Q = O.locatenew("Q", N.x)
joints, q, u = {"O": O, "Q": Q}, [], []
for name in "BCDP":
    x, y, vx, vy = me.dynamicsymbols(f"x_{name} y_{name} vx_{name} vy_{name}")
    joints[name] = O.locatenew(name, x * N.x + y * N.y)
    joints[name].set_vel(N, vx * N.x + vy * N.y)
    q += [x, y]
    u += [vx, vy]
rods = {"QB": 1.0, "OC": 3.0, "OD": 3.0, "BC": 1.25, "BD": 1.25, "PC": 1.25, "PD": 1.25}
between = [joints[b].pos_from(joints[a]) for a, b in rods]
gaps = [r.dot(r) - length**2 for r, length in zip(between, rods.values(), strict=True)]
qdots = dict(zip([c.diff(t) for c in q], u, strict=True))
kane = me.KanesMethod(
    N,
    q_ind=q[1:2],
    u_ind=u[1:2],
    kd_eqs=[speed - qdot for qdot, speed in qdots.items()],
    q_dependent=[q[0], *q[2:]],
    u_dependent=[u[0], *u[2:]],
    configuration_constraints=gaps,
    velocity_constraints=[gap.diff(t).subs(qdots) for gap in gaps],
)
kane.kanes_equations(
    [me.Particle(name, joints[name], m) for name in "BCDP"],
    [(joints[name], -m * g * N.y) for name in "BCDP"],
)
model = mechc.compile(
    kane,
    defaults={"m": 1.0, "g": 9.81},
    drawing=mechc.Drawing(
        links=tuple((rod, (joints[rod[0]], joints[rod[1]])) for rod in rods),
        ground=(O, Q),
        traced=("P", "B"),
    ),
)
guess = {"x_B": 1.9, "x_C": 2.7, "y_C": 1.2, "x_D": 2.9, "y_D": -0.4, "x_P": 3.7, "y_P": 0.9}
sol = model.simulate(10, model.assemble({"y_B": 0.4}, guess=guess))

# %%
# P moves up and down a line that is straight to rounding.

print(f"P moves over {np.ptp(sol['y_P']):.3f} m, and by {np.ptp(sol['x_P']):.1e} m across")
assert np.ptp(sol["x_P"]) < 1e-12 < 0.5 < np.ptp(sol["y_P"])

# %%
sol.animate()
