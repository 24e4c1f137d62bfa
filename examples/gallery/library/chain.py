"""
A falling chain
===============

Sixteen uniform rods hinged to each other, dropped from level.  From seven links on the equations
are derived and evaluated link by link: their cost grows in proportion to the number of links.
"""

import mechc

model = mechc.load("planar_chain", links=16)
sol = model.simulate(3, model.assemble())
print(f"{sol.stats['steps']} steps; energy kept to {sol.energy_drift:.1e}")
assert sol.energy_drift < 1e-8

# %%
sol.animate()
