"""
A platform on three arms in the plane
=====================================

The 3-RRR robot of C. Gosselin and J. Angeles (*The optimum kinematic design of a planar
three-degree-of-freedom parallel manipulator*, 1988): three motors on the ground move a platform by
three cranks and rods.  `planar_3rrr.urdf` has a planar joint for the platform and closes the three
loops by the pins at its corners.
"""

import numpy as np

import mechc

robot = mechc.from_urdf("planar_3rrr.urdf", driven=["motor_0", "motor_1", "motor_2"])
print(robot.cuts)
model = mechc.compile(robot, outputs=("energy", "points"))
start = model.assemble()
freedoms = len(model.speeds) - np.linalg.matrix_rank(model.constraint_jacobian(start))
assert freedoms == 3

# %%
# Each motor holds its crank to an angle that changes with time.

torques = {
    f"tau_motor_{k}": f"20*(0.4*sin(2*t + {k}) - q_motor_{k}) - u_motor_{k}" for k in range(3)
}
sol = model.simulate(6, start, inputs=torques)
assert sol.t[-1] == 6

# %%
# Where the platform is, the crank's angle is known in closed form: it is that of the line from its
# pivot to the corner, and the angle of a triangle with the sides 0.3 m and 0.35 m.

turn = np.exp(1j * sol["q_platform"])
for k in range(3):
    outwards = np.exp(2j * np.pi * k / 3)
    line = sol["x_platform"] + 1j * sol["y_platform"] + 0.15 * outwards * turn - 0.5 * outwards
    reach = abs(line)
    angle = np.arccos((0.3**2 + reach**2 - 0.35**2) / (2 * 0.3 * reach))
    crank = np.unwrap(np.angle(-line / outwards)) + angle
    assert abs(sol[f"q_motor_{k}"] - (crank - np.arccos(3 / 7))).max() < 1e-11
print(f"the energy differs from the work of the motors by {sol.energy_drift:.1e}")
assert sol.energy_drift < 1e-8

# %%
sol.view()
