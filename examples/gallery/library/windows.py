"""
Windows in a row
================

Parallelograms of equal rods with one degree of freedom together (problem A02 of the IFToMM
library of computational benchmarks).  When the rods lie flat, as many constraint rows are
dependent as there are windows, and ``count + 1`` branches cross.
"""

import mechc

model = mechc.load("windows", count=4)
sol = model.simulate(10, model.assemble(), {"tilt": 0.3})
print(f"{len(sol.change_points)} change points passed")
assert sol.status.ok
assert sol.energy_drift < 1e-8

# %%
sol.animate()
