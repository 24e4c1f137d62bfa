"""
A slider-crank, started stretched
=================================

Crank and rod are in line at the start.  There the slider's speed is zero whatever the crank's is,
so the slider cannot serve as independent coordinate; mechc chooses none.  A torque of 10 N m
accelerates the crank.
"""

import mechc

model = mechc.load("slider_crank")
sol = model.simulate(1, model.assemble())
assert abs(sol["x"][-1] - 1.3550640434287) < 1e-8  # Exudyn's example

# %%
sol.animate()
