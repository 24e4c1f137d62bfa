"""
The turning of a free body
==========================

A body that spins about its axis of middle inertia turns over again and again (Poinsot;
Dzhanibekov's wing nut).  The attitude is a quaternion, four coordinates to three speeds: no angle
runs into a pole.
"""

import numpy as np
from scipy.special import ellipj

import mechc

model = mechc.load("rigid_body")
sol = model.simulate(20, model.assemble())

# %%
# Euler's equations are scaled here so that the speeds are Jacobi's elliptic functions.

sn, cn, dn, _ = ellipj(sol.t, 0.51)
error = abs(sol.u - np.stack([sn, cn, dn], axis=1)).max()
print(f"largest error of the speeds: {error:.1e}")
assert error < 1e-7

# %%
sol.view()
