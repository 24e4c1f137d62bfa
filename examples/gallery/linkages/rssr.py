"""
A spatial four-bar
==================

A crank about a vertical axis and a rocker about a level one, joined by a rod with a ball at each
end (RSSR).  The rod is massless: one distance that does not change, the only constraint.
"""

import numpy as np
import sympy as sm
import sympy.physics.mechanics as me

import mechc

t = me.dynamicsymbols._t
phi, psi, u1, u2, T = me.dynamicsymbols("phi psi u1 u2 T")
a, b, l, m, g = sm.symbols("a b l m g", positive=True)
N, O = me.ReferenceFrame("N"), me.Point("O")
crank = N.orientnew("crank", "Axis", (phi, N.z))
rocker = N.orientnew("rocker", "Axis", (psi, N.x))
crank.set_ang_vel(N, u1 * N.z)
rocker.set_ang_vel(N, u2 * N.x)
O.set_vel(N, 0)
pivot = O.locatenew("pivot", 0.4 * N.x + 0.7 * N.y)
pivot.set_vel(N, 0)
A = O.locatenew("A", a * crank.x)
B = pivot.locatenew("B", b * rocker.z)
A.v2pt_theory(O, N, crank)
B.v2pt_theory(pivot, N, rocker)

rod = B.pos_from(A)
gap = rod.dot(rod) - l**2
slender = {"crank": (0, 1, 1), "rocker": (1, 1, 0)}
bodies, loads = [], [(crank, T * N.z)]
for name, root, frame, arm in (
    ("crank", O, crank, a * crank.x),
    ("rocker", pivot, rocker, b * rocker.z),
):
    G = root.locatenew(f"G of the {name}", arm / 2)
    G.v2pt_theory(root, N, frame)
    size = arm.magnitude()
    central = m * size**2 / 12 * me.inertia(frame, *slender[name])
    bodies.append(me.RigidBody(name, G, frame, m, (central, G)))
    loads.append((G, -m * g * N.z))
kane = me.KanesMethod(
    N,
    q_ind=[phi],
    u_ind=[u1],
    kd_eqs=[phi.diff(t) - u1, psi.diff(t) - u2],
    q_dependent=[psi],
    u_dependent=[u2],
    configuration_constraints=[gap],
    velocity_constraints=[gap.diff(t).subs({phi.diff(t): u1, psi.diff(t): u2})],
)
kane.kanes_equations(bodies, loads)

model = mechc.compile(
    kane,
    defaults={"a": 0.2, "b": 0.6, "l": 0.9, "m": 1.0, "g": 9.81},
    inputs={T: 20 * (8 - u1)},
    drawing=mechc.Drawing(links=(("rod", (A, B)),), ground=(O, pivot), view=("y", "z")),
)
sol = model.simulate(4, model.assemble({"phi": 0.0}, speeds={"u1": 8.0}, guess={"psi": 0.2}))

# %%
# The crank turns fully and the rocker swings between two limits, which position analysis finds.

sweep = model.sweep_positions("phi", np.linspace(0, 2 * np.pi, 361), guess={"psi": 0.2})
found = np.degrees([sweep.q[:, 1].min(), sweep.q[:, 1].max()])
swing = np.degrees([sol["psi"].min(), sol["psi"].max()])
print(f"the rocker swings from {swing[0]:.2f}° to {swing[1]:.2f}°, in the sweep {found.round(2)}")
assert abs(swing - found).max() < 0.05
assert sol["phi"][-1] > 4 * np.pi

# %%
sol.view()
