"""
A heavy top
===========

Spun with 150 rad/s, its axis level at the start, the top precesses and nods.  The speeds are the
components of the angular velocity in the body's axes, not the rates of the angles.
"""

import numpy as np

import mechc

model = mechc.load("heavy_top")
sol = model.simulate(2, model.assemble(), rtol=1e-11)
tip = model.points(sol.y)[:, 1]
assert np.ptp(np.linalg.norm(tip, axis=1)) < 1e-12
assert sol.energy_drift < 1e-9

# %%
sol.view()
