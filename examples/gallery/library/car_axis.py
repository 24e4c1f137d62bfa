"""
A car axis on a bumpy road
==========================

A stiff bar of two point masses on springs, its right wheel on a sine (Test Set for IVP Solvers,
"car axis").  One constraint depends on time.  Masses and lengths are scaled as in the Test Set.
"""

import mechc

model = mechc.load("car_axis")
sol = model.simulate(3, model.assemble())
assert sol.closure.max() < 1e-13

# %%
sol.animate()
