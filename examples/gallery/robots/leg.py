"""
A leg with springs and rods
===========================

A leg in the manner of Agility Robotics' Cassie, with dimensions of our own: the knee's motor acts
on the shin by a leaf spring, a rod from the hip, with a ball at its end, leads to a second spring
at the heel, and the foot is moved by a crank and a rod.  URDF has no springs: their stiffness is a
parameter of the mechanism.
"""

import numpy as np

import mechc

springs = [("shin_spring", "stiffness"), ("heel_spring", "stiffness")]
robot = mechc.from_urdf("leg.urdf", springs, driven=["hip", "knee", "foot_motor"])
model = mechc.compile(robot, outputs=("energy", "points"))
start = model.assemble()
freedoms = len(model.speeds) - np.linalg.matrix_rank(model.constraint_jacobian(start))
assert freedoms == 5  # three motors and two springs

# %%
# The leg runs in the air.

angles = {"hip": "0.5*sin(5*t)", "knee": "0.5*sin(5*t + 1)", "foot_motor": "0.3*sin(5*t)"}
torques = {
    f"tau_{joint}": f"300*({angle} - q_{joint}) - 10*u_{joint}" for joint, angle in angles.items()
}
stiffness = {"k_shin_spring": 1500.0, "k_heel_spring": 1250.0}
sol = model.simulate(3, start, stiffness, inputs=torques)
assert sol.t[-1] == 3

# %%
# All pins but the ball are across the plane of the leg: the end of the heel's spring is found there
# from the angles, and the rod of 0.795 m leads to it.

x, z = 1, 1j
places = [0.12 * x - 0.45 * z, 0.06 * x - 0.05 * z, -0.30 * x - 0.33 * z, -0.02 * x,
          -0.09 * x + 0.04 * z]  # fmt: skip
angle, end = 0.0, 0.0
for joint, way in zip(("hip", "knee", "shin_spring", "tarsus", "heel_spring"), places, strict=True):
    angle = angle + sol[f"q_{joint}"]
    end = end + way * np.exp(-1j * angle)
top = (-0.05 * x - 0.02 * z) * np.exp(-1j * sol["q_hip"])
rod = np.hypot(abs(end - top), 0.06 + 0.02)
print(f"the rod is {rod[0]:.3f} m long, and changes by {np.ptp(rod):.0e} m")
assert np.ptp(rod) < 1e-12
assert sol.energy_drift < 1e-8

# %%
sol.view()
