"""
A parallel gripper
==================

Each finger is carried by a crank and a bar of one length, so that it keeps its direction; the right
crank mirrors the left one by a `mimic`.  `limits="stop"` makes stops of the limits in
`gripper.urdf`, at which the fingers meet, and `effort="saturate"` bounds the motor.
"""

import numpy as np

import mechc

robot = mechc.from_urdf("gripper.urdf", driven="left_crank", limits="stop", effort="saturate")
model = mechc.compile(robot, outputs=("energy", "points"))
start = model.assemble({"q_left_crank": 0.5})
freedoms = len(model.speeds) - np.linalg.matrix_rank(model.constraint_jacobian(start))
assert freedoms == 1

# %%
# The motor is asked for 1 N m, and gives the 0.4 N m of the file.

sol = model.simulate(0.3, start, inputs={"tau_left_crank": -1.0})
points = model.points(sol.y)
tips = [points[:, model.point_names.index(f"{side}_tip")] for side in ("left", "right")]
opening = 2 * (0.03 + 0.1 * np.sin(0.6 + sol["q_left_crank"]))
assert abs(tips[1][:, 0] - tips[0][:, 0] - opening).max() < 1e-12
print(f"the tips are {1e3 * opening[-1]:.2f} mm apart at the end")
assert abs(sol["q_left_crank"][-1] + 0.904) < 1e-9

# %%
# Until the stop, the work of 0.4 N m and of the damper is the gain of energy.

times = np.linspace(0, sol.events[0].t[0], 50)
energy = model.energy(sol(times))
assert abs(energy - energy[0] - sol.work_until(times)).max() < 1e-9

# %%
sol.view()
