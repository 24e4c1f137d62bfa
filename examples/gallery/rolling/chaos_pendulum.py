"""
A rod and a plate
=================

A rod swings in a plane, and a plate at its end turns freely about the rod.  Small swings are
regular; larger ones couple to the plate and become chaotic (T. R. Kane and D. A. Levinson,
*Dynamics: Theory and Applications*, 1985).
"""

import numpy as np
import sympy as sm
import sympy.physics.mechanics as me

import mechc

t = me.dynamicsymbols._t
theta, phi, omega, alpha = me.dynamicsymbols("theta phi omega alpha")
m_r, m_p, l, w, d, g = sm.symbols("m_r m_p l w d g", positive=True)
N, O = me.ReferenceFrame("N"), me.Point("O")
A = N.orientnew("rod", "Axis", (theta, N.y))
B = A.orientnew("plate", "Axis", (phi, A.z))
A.set_ang_vel(N, omega * N.y)
B.set_ang_vel(A, alpha * A.z)
O.set_vel(N, 0)
end = O.locatenew("end", -l * A.z)
A_o = O.locatenew("A_o", -l / 2 * A.z)
for point in (end, A_o):
    point.v2pt_theory(O, N, A)
corners = [
    end.locatenew(f"corner {k}", x * w / 2 * B.x + z * d / 2 * B.z)
    for k, (x, z) in enumerate([(1, 1), (-1, 1), (-1, -1), (1, -1)])
]

rod = me.RigidBody("rod", A_o, A, m_r, (me.inertia(A, m_r * l**2 / 12, m_r * l**2 / 12, 0), A_o))
plate = me.inertia(B, m_p * d**2 / 12, m_p * (w**2 + d**2) / 12, m_p * w**2 / 12)
bodies = [rod, me.RigidBody("plate", end, B, m_p, (plate, end))]
kane = me.KanesMethod(N, [theta, phi], [omega, alpha], [omega - theta.diff(t), alpha - phi.diff(t)])
kane.kanes_equations(bodies, [(b.masscenter, -b.mass * g * N.z) for b in bodies])

# %%
# The plate is drawn by its four corners.

edge = (*corners, corners[0])
model = mechc.compile(
    kane,
    defaults={"m_r": 0.01, "m_p": 0.1, "l": 0.075, "w": 0.2, "d": 0.1, "g": 9.81},
    drawing=mechc.Drawing(links=(("edge", edge),), ground=(O,), view=("x", "z")),
)
sol = model.simulate(10, {"theta": np.radians(90), "phi": np.radians(0.5)})
assert sol.energy_drift < 1e-8

# %%
# Two starts a thousandth of a degree apart, at a small and at a large swing:

for swing in (45, 90):
    ends = [
        model.simulate(10, {"theta": np.radians(swing), "phi": np.radians(turn)})["phi"][-1]
        for turn in (0.5, 0.501)
    ]
    print(f"{swing}°: the plate's angles at the end differ by {abs(ends[1] - ends[0]):.1e} rad")

# %%
sol.animate()
