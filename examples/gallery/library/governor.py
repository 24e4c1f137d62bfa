"""
A flyball governor
==================

Two balls of 5 kg rise as their shaft spins, against stiff springs with strong dampers (problem
A05 of the IFToMM library): decay rates of thousands per second in a motion of seconds.  Angular
momentum about the shaft is conserved: the shaft slows down when the balls rise.
"""

import numpy as np

import mechc

model = mechc.load("flyball_governor")
sol = model.simulate(10, model.assemble())
momentum = model.momenta(sol.y).angular[:, :, 2].sum(axis=1)
print(f"slider at {sol['s'][-1]:.6f} m, {sol.stats['steps']} steps")
assert abs(sol["s"][-1] - 0.619622917) < 1e-6
assert np.ptp(momentum) < 1e-6 * abs(momentum).max()

# %%
sol.view()
