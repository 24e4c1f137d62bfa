"""
Two pendulums in a row, thousands at once
=========================================

The double pendulum is chaotic: of a thousand that start within a thousandth of a degree of each
other, none stays near another for long.
"""

import numpy as np

import mechc

model = mechc.load("pendulum", links=2)
start = model.assemble({"theta_0": 2.0, "theta_1": 2.5})
many = np.tile(start, (1000, 1))
many[:, 0] += np.radians(1e-3) * np.linspace(-0.5, 0.5, 1000)
batch = model.simulate_batch(12, many, t_eval=np.linspace(0, 12, 121), method="dop853")
spread = np.asarray(batch["y_eval"][:, :, 0]).std(axis=0)
for k in range(0, 121, 20):
    print(f"t = {k / 10:4.1f} s: standard deviation of the upper angle {spread[k]:.1e} rad")
assert spread[0] < 1e-5 < 1e-2 < spread[-1]

# %%
# One of them:

sol = model.simulate(12, start)
sol.animate()
