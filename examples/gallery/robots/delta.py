"""
A Delta robot
=============

R. Clavel's robot (patent US 4,976,582, 1990): three motors move a platform that never turns, for it
is led by pairs of parallel rods.  In `delta.urdf` each rod has a universal joint at its arm, two
pins with a link without mass between them, and a ball at the platform: five loops in space.
"""

import numpy as np

import mechc

motors = [f"motor_{k}" for k in range(3)]
robot = mechc.from_urdf("delta.urdf", driven=motors)
print(robot.cuts)
model = mechc.compile(robot, outputs=("energy", "points", "accelerations"))
start = model.assemble()
freedoms = len(model.speeds) - np.linalg.matrix_rank(model.constraint_jacobian(start))
assert freedoms == 3

# %%
# The motors hold the arms against their weight, to angles that change with time.

torques = {
    f"tau_{motor}": f"200*(0.35*(sin(3*t + {2 * k}) - sin({2 * k})) - q_{motor}) - 10*u_{motor}"
    for k, motor in enumerate(motors)
}
sol = model.simulate(2, start, inputs=torques)
assert sol.t[-1] == 2
points = dict(zip(model.point_names, np.moveaxis(model.points(sol.y), 1, 0), strict=True))

# %%
# The platform keeps its direction, and is where three spheres meet: 0.9 m from the elbows, moved
# inwards by the 0.1 m of the platform.

for k, motor in enumerate(motors):
    outwards = np.array([np.cos(2 * np.pi * k / 3), np.sin(2 * np.pi * k / 3), 0])
    assert abs(points[f"corner_{k}"] - points["centre"] - 0.1 * outwards).max() < 1e-11
    angle = sol[f"q_{motor}"][:, None]
    elbow = (0.3 - 0.1 + 0.4 * np.cos(angle)) * outwards - 0.4 * np.sin(angle) * [0, 0, 1]
    assert abs(np.linalg.norm(points["centre"] - elbow, axis=1) - 0.9).max() < 1e-11
print(f"the energy differs from the work of the motors by {sol.energy_drift:.1e}")
assert sol.energy_drift < 1e-8

# %%
# The platform draws a circle and rises: inverse dynamics gives the torques for it, and with these
# the motion is the circle again.

centre = model.point_names.index("centre")
x, y, z = (f"points[{centre},{axis}]" for axis in range(3))
height = points["centre"][0, 2]
circle = {x: "0.15 - 0.15*cos(3*t)", y: "0.15*sin(3*t)", z: f"{height} + 0.05*t"}
drawn = model.inverse_dynamics(path=circle, t=np.linspace(0, 2, 201))
sol = model.simulate(drawn.t, drawn.y[0], inputs=drawn.signals())
off = abs(model.points(sol.y)[:, centre] - np.stack([drawn[name] for name in circle], axis=1))
print(f"the platform is {off.max():.1e} m off its path at most")
assert off.max() < 1e-8

# %%
sol.view()
