"""
A crane moved with the least force
==================================

A trolley carries a load on a rope over four metres in 2.5 seconds, from rest to rest.  Of all
forces that do it, the one whose square is least over the time is found.
"""

import sympy as sm
import sympy.physics.mechanics as me

import mechc

t = me.dynamicsymbols._t
x, angle, v, w, force = me.dynamicsymbols("x angle v w force")
M, m, L, g = sm.symbols("M m L g", positive=True)
N, O = me.ReferenceFrame("N"), me.Point("O")
O.set_vel(N, 0)
trolley = O.locatenew("trolley", x * N.x)
trolley.set_vel(N, v * N.x)
rope = N.orientnew("rope", "Axis", (angle, N.z))
rope.set_ang_vel(N, w * N.z)
load = trolley.locatenew("load", -L * rope.y)
load.v2pt_theory(trolley, N, rope)
kane = me.KanesMethod(N, [x, angle], [v, w], [x.diff(t) - v, angle.diff(t) - w])
masses = [me.Particle("trolley", trolley, M), me.Particle("load", load, m)]
kane.kanes_equations(masses, [(trolley, force * N.x), (load, -m * g * N.y)])
model = mechc.compile(
    kane,
    defaults={"M": 2.0, "m": 3.0, "L": 1.5, "g": 9.81},
    drawing=mechc.Drawing(ground=(O,), traced=("load",)),
    outputs=("energy", "points", "sensitivities"),
)

# %%
# The force is linear between thirteen samples, which are found.

rest = {"x": 0.0, "angle": 0.0, "v": 0.0, "w": 0.0}
end = {**rest, "x": 4.0}
found = model.optimise(2.5, rest, {"force": None}, integral="force**2", end=end, intervals=12)
print(found)

# %%
# By Pontryagin's conditions the least is 309.7658 N² s.

assert found.converged
assert abs(found.cost / 309.765777 - 1) < 1e-5

# %%
sol = found.solution
sol.animate()
