"""
The arm of a digger
===================

Boom, stick and bucket are moved by three cylinders, the bucket by way of a rocker and a link: four
loops in `digger.urdf`.  Cylinders are prismatic joints between a barrel and a rod.
"""

import numpy as np

import mechc

parts = ("boom", "stick", "bucket")
cylinders = [f"{part}_cylinder" for part in parts]
robot = mechc.from_urdf("digger.urdf", driven=cylinders, limits="ignore", effort="ignore")
model = mechc.compile(robot, outputs=("energy", "points"))
start = model.assemble()
freedoms = len(model.speeds) - np.linalg.matrix_rank(model.constraint_jacobian(start))
assert freedoms == 3

# %%
# The forces follow lengths that change with time, as valves and pumps would.

lengths = {"boom": "0.12*sin(t)", "stick": "0.3*sin(1.3*t)", "bucket": "0.2*sin(2*t)"}
forces = {
    f"tau_{part}_cylinder": f"4e5*({length} - q_{part}_cylinder) - 4e4*u_{part}_cylinder"
    for part, length in lengths.items()
}
sol = model.simulate(8, start, inputs=forces)
assert sol.t[-1] == 8

# %%
# The law of cosines gives the length of the boom's cylinder from the boom's angle.

foot, head = 0.5 - 0.35j, 1.4 + 0.6j
length = abs(head * np.exp(1j * sol["q_boom"]) - foot)
assert abs(sol["q_boom_cylinder"] - (length - abs(head - foot))).max() < 1e-10
print(f"the energy differs from the work of the cylinders by {sol.energy_drift:.1e}")
assert sol.energy_drift < 1e-8

# %%
sol.view()
