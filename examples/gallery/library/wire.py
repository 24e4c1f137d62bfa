"""
Bars hinged across and along
============================

A row of bars in space whose hinge axes alternate: a model of a twisting wire, or a snake robot
without its motors.
"""

import mechc

model = mechc.load("spatial_chain", links=8)
sol = model.simulate(2, model.assemble())
assert sol.energy_drift < 1e-8

# %%
sol.view()
