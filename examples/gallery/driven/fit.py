"""
Values from a noisy recording
=============================

A rocker swings on its bearing and takes a lever along by a rod.  What are the rocker's inertia and
the damping of its bearing?  A potentiometer at the lever recorded the motion, with noise.
"""

import numpy as np
import sympy as sm
import sympy.physics.mechanics as me

import mechc

J, c = sm.symbols("J c", positive=True)
frame = me.RigidBody("frame")
rocker, lever = me.RigidBody("rocker", mass=3.0), me.RigidBody("lever", mass=0.5)
rocker.central_inertia = me.inertia(rocker.frame, 0, 0, J)
lever.central_inertia = me.inertia(lever.frame, 0, 0, 0.01)
bearing = me.PinJoint("rocker", frame, rocker, child_point=0.3 * rocker.y, joint_axis=frame.z)
hinge = me.PinJoint(
    "lever", frame, lever,
    parent_point=0.5 * frame.x, child_point=0.15 * lever.y, joint_axis=frame.z,
)  # fmt: skip
rod = mechc.Cut.rod("rod", rocker, lever, "520 mm", 0.1 * rocker.y, -0.15 * lever.y)
linkage = mechc.from_joints(
    "linkage",
    [bearing, hinge, rod],
    gravity=-9.81 * frame.y,
    loads=[me.Torque(rocker, -c * bearing.speeds[0] * frame.z)],
    parameters={J: 0.05, c: 0.1},
    drawing=mechc.Drawing(
        links=(("rocker", (bearing.child_point, rocker.masscenter)),), traced=("rocker_masscenter",)
    ),
)
model = mechc.compile(linkage, outputs=("energy", "sensitivities"))

# %%
# The recording: 100 samples a second, made with the values that are to be found again.

truth = {"J": 0.12, "c": 0.25}
times = np.linspace(0, 4, 401)
start = model.assemble({"q_rocker": 0.9}, guess={"q_lever": 0.7})
sol = model.simulate(4.0, start, truth, t_eval=times)
sigma = np.radians(0.5)
recorded = sol["q_lever"] + np.random.default_rng(1).normal(scale=sigma, size=times.size)

# %%
# The first sample is as noisy as the others, so the start is to be found too.

result = model.fit(
    {"t": times, "q_lever": recorded},
    free={"J": (0.01, 1.0), "c": (0.0, 2.0), "q_lever": None},
    measured={"q_lever": sigma},
    guess={"q_rocker": 0.8},
)
print(result)
for name, value in {**truth, "q_lever": sol["q_lever"][0]}.items():
    low, high = result.intervals[name]
    assert low < value < high
    assert high - low < 0.05 * value
assert abs(result.rms["q_lever"] / sigma - 1) < 0.1
result.plot()

# %%
result.solutions[0].animate()
