"""
Andrews' squeezing mechanism
============================

Seven bodies, three loops that meet in one point, driven by 0.033 N m: the classic test of codes
for constrained motion (Schiehlen, *Multibody Systems Handbook*, 1990; Hairer and Wanner, *Solving
Ordinary Differential Equations II*, section VII.7).  The whole motion lasts 30 ms.
"""

import mechc

model = mechc.load("andrews")
sol = model.simulate(0.03, model.assemble({"Theta": 0.0}))

# %%
# The published angle of the crank at the end is 15.810771 rad.

print(f"{sol['beta'][-1]:.8f} rad")
assert abs(sol["beta"][-1] - 15.810771) < 1e-6

# %%
sol.animate(fps=20_000)
