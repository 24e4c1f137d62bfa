"""
A rolling disc
==============

A disc that rolls without slipping, described by the angles of heading, lean and roll.  The point
of contact has coordinates too, which follow the rolling: five coordinates to three speeds.
"""

import numpy as np
import sympy as sm
import sympy.physics.mechanics as me

import mechc

t = me.dynamicsymbols._t
heading, lean, roll, x, y = me.dynamicsymbols("heading lean roll x y")
u1, u2, u3 = me.dynamicsymbols("u1:4")
r, m, g = sm.symbols("r m g")
N, O = me.ReferenceFrame("N"), me.Point("O")
Y = N.orientnew("Y", "Axis", (heading, N.z))
L = Y.orientnew("L", "Axis", (lean, Y.x))
R = L.orientnew("R", "Axis", (roll, L.y))
from_angles = R.ang_vel_in(N)
R.set_ang_vel(N, u1 * L.x + u2 * L.y + u3 * L.z)

contact = O.locatenew("contact", x * N.x + y * N.y)  # the point of the disc there is at rest
contact.set_vel(N, 0)
centre = contact.locatenew("centre", r * L.z)
centre.v2pt_theory(contact, N, R)

along = r * roll.diff(t)  # the contact moves along the heading
kinematics = [(from_angles - R.ang_vel_in(N)).dot(axis) for axis in L]
kinematics += [x.diff(t) - along * sm.cos(heading), y.diff(t) - along * sm.sin(heading)]
disc = me.RigidBody("disc", centre, R, m, (m * r**2 * me.inertia(L, 0.25, 0.5, 0.25), centre))
kane = me.KanesMethod(N, [heading, lean, roll, x, y], [u1, u2, u3], kinematics)
kane.kanes_equations([disc], [(centre, -m * g * N.z)])

model = mechc.compile(
    kane,
    defaults={"r": 0.3, "m": 2.0, "g": 9.81},
    drawing=mechc.Drawing(
        traced=("contact",), solids=(mechc.Solid.wheel("disc", centre, R, r, axis="y"),)
    ),
)

# %%
# In a steady turn the contact runs along a circle: an upright disc with a little turning wobbles.

sol = model.simulate(8, {"lean": 0.25, "u2": 6.0, "u3": 1.0})
assert sol.energy_drift < 1e-8
print(f"the path is {np.hypot(np.diff(sol['x']), np.diff(sol['y'])).sum():.2f} m long")

# %%
sol.view()
