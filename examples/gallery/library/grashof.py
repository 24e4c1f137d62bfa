"""
Crank and rocker
================

By Grashof's rule the shortest link of a four-bar turns fully if it and the longest together are
not longer than the other two.  Here a motor of constant torque works against friction in the
joints: the crank turns, the rocker swings.
"""

import numpy as np

import mechc

model = mechc.load("four_bar", friction=True, crank_torque=True)
params = {"l_0": 1.0, "l_1": 3.0, "l_2": 2.5, "l_3": 3.5, "T_0": 40.0}
sol = model.simulate(6, model.assemble({"theta_0": 1.0}, params=params), params)
print(model.limits("theta_2", params))

# %%
# The crank has turned several times; the rocker never leaves the limits that the params give.

low, high = model.limits("theta_2", params)[0]
assert sol["theta_0"][-1] > 4 * np.pi
assert low - 1e-9 <= sol["theta_2"].min() < sol["theta_2"].max() <= high + 1e-9

# %%
sol.animate()
