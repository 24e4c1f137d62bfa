"""
Six rods that spin
==================

A platform on six rods, each with a ball at both ends, on six cranks: a 6-RSS.  Counting says twelve
freedoms, and so does the rank of the constraints: six are those of the platform, and every rod may
spin about itself, which moves nothing else.  In `hexapod_6rss.urdf` a lower ball is three pins, of
which the last is along the rod.
"""

from xml.etree import ElementTree

import numpy as np
from scipy.spatial.transform import Rotation

import mechc

motors = [f"motor_{k}" for k in range(6)]
robot = mechc.from_urdf("hexapod_6rss.urdf", driven=motors)
model = mechc.compile(robot, outputs=("energy", "points"))
start = model.assemble()
rows = model.constraint_jacobian(start)
assert len(model.speeds) - np.linalg.matrix_rank(rows) == 12
of_spins = rows[:, [model.speeds.index(f"u_spin_{k}") for k in range(1, 6)]]
assert abs(of_spins).max() < 1e-12

# %%
# The motors move the platform, while the last five rods spin.

torques = {
    f"tau_{motor}": f"300*(0.5*(sin(2*t + {k}) - sin({k})) - q_{motor}) - 20*u_{motor}"
    for k, motor in enumerate(motors)
}
spinning = start.copy()
for rod in range(1, 6):
    spinning[len(model.coordinates) + model.speeds.index(f"u_spin_{rod}")] = 5.0 * rod
sol = model.simulate(2, spinning, inputs=torques)
assert sol.t[-1] == 2

# %%
# By Euler's equations no torque spins a rod that is round and hangs on balls: the component of its
# angular velocity along itself is constant.  Here it is summed from the pins of the third crank,
# whose axes are read from the file.

k = 3
tree, axes = ElementTree.parse("hexapod_6rss.urdf"), {}
for name in ("motor", "swing", "lean", "spin"):
    axis = tree.find(f"joint[@name='{name}_{k}']/axis").get("xyz")
    axes[name] = np.array([float(x) for x in axis.split()])
turned, spin = Rotation.identity(len(sol.t)), 0.0
for name, axis in reversed(axes.items()):  # from the rod to the ground, in the rod's frame
    seen = turned.inv().apply(axis)
    spin = spin + sol[f"u_{name}_{k}"] * (seen @ axes["spin"])
    turned = Rotation.from_rotvec(sol[f"q_{name}_{k}"][:, None] * axis) * turned
print(f"the rod spins at {spin[0]:.3f} rad/s, and changes by {np.ptp(spin):.0e}")
assert np.ptp(spin) < 1e-7
assert sol.energy_drift < 1e-8

# %%
sol.view()
