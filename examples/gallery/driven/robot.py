"""
A robot arm from a URDF file
============================

Links, joints and shapes of an arm with three axes are read from `robot.urdf`; every joint gets a
motor.  The arm goes through given angles; the motors' torques are those of the inverse dynamics.
"""

import numpy as np
from scipy.interpolate import CubicSpline

import mechc

mechanism = mechc.from_urdf("robot.urdf", driven="all", limits="ignore", effort="ignore")
model = mechc.compile(mechanism)
print(model.coordinates, model.inputs)

# %%
# The path is a spline through five postures, at rest at both ends.

postures = [[0.0, 0.0, 0.2], [1.2, 0.8, 1.0], [2.0, 0.2, 2.0], [0.5, -0.6, 1.5], [0.0, 0.0, 0.2]]
path = CubicSpline([0.0, 1.0, 2.0, 3.0, 4.0], postures, bc_type="clamped")


# %%
# The controller acts 500 times a second.


def torques(t, q, u):
    asked = path(t, 2) + 400 * (path(t) - q) + 40 * (path(t, 1) - u)
    return model.inverse_dynamics([*q, *u], asked, inputs=model.inputs).inputs


controller = mechc.Sampled(torques, period=0.002)
sol = model.simulate(4.0, [*path(0), 0, 0, 0], inputs={model.inputs: controller})
off = np.degrees(abs(sol.q - path(sol.t)).max())
print(f"the joints are {off:.2f}° off their path at most")
assert off < 0.5

# %%
sol.view()
