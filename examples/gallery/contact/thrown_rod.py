"""
A thrown rod
============

A rod is thrown onto a floor.  Its ends bounce (restitution 0.5, friction 0.4), one of them slides
and sticks while the other swings down, and at last the rod lies still.
"""

import numpy as np
import sympy as sm
import sympy.physics.mechanics as me

import mechc

t = me.dynamicsymbols._t
x, y, theta = me.dynamicsymbols("x y theta")
v_x, v_y, omega = me.dynamicsymbols("v_x v_y omega")
m, g, l = sm.symbols("m g l")
N, O = me.ReferenceFrame("N"), me.Point("O")
B = N.orientnew("B", "Axis", (theta, N.z))
B.set_ang_vel(N, omega * N.z)
O.set_vel(N, 0)
centre = O.locatenew("centre", x * N.x + y * N.y)
centre.set_vel(N, v_x * N.x + v_y * N.y)
left, right = centre.locatenew("left", -l * B.x), centre.locatenew("right", l * B.x)
floor = [O.locatenew(f"floor {k}", k * N.x) for k in (-1, 4)]
for end in (left, right):
    end.v2pt_theory(centre, N, B)

rod = me.RigidBody("rod", centre, B, m, (me.inertia(B, 0, 0, m * l**2 / 3), centre))
rates = [x.diff(t) - v_x, y.diff(t) - v_y, theta.diff(t) - omega]
kane = me.KanesMethod(N, [x, y, theta], [v_x, v_y, omega], rates)
kane.kanes_equations([rod], [(centre, -m * g * N.y)])

# %%
# Each end is a stop: the gap above the floor, and the speed along it.

model = mechc.compile(
    kane,
    defaults={"m": 1.0, "g": 9.81, "l": 0.5},
    outputs=("energy",),
    drawing=mechc.Drawing(
        links=(("rod", (left, centre, right)), ("floor", floor)), ground=(O,), view=("x", "y")
    ),
)
ends = [
    mechc.Stop(end.pos_from(O).dot(N.y), 0.5, friction=0.4, slip=end.vel(N).dot(N.x))
    for end in (left, right)
]
sol = model.simulate(3.0, {"y": 1.2, "theta": 0.6, "v_x": 1.5, "omega": 3.0}, events=ends)
print(sol.status)
print(f"{sum(len(record.t) for record in sol.events)} impacts of its ends")

# %%
# Energy never grows, and both ends stick at last.

assert np.diff(sol.energy).max() < 1e-9
assert sol.segments[-1].contacts == ("sticks", "sticks")
for part in sol.segments[::10]:
    print(f"{part.t0:.3f} s: left {part.contacts[0]}, right {part.contacts[1]}")

# %%
sol.animate()
