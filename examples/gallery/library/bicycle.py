"""
A riderless bicycle
===================

Whipple's bicycle with the parameters of Meijaard, Papadopoulos, Ruina and Schwab (Proc. R. Soc. A
463, 2007): one holonomic constraint (the front wheel stands on the ground) and four nonholonomic
ones (the wheels do not slip).  Pushed sideways at 4.8 m/s it steers into the fall and rights
itself.
"""

import numpy as np

import mechc

model = mechc.load("bicycle")
sol = model.simulate(5, model.assemble())
roll = np.degrees(sol["roll"])
print(f"largest roll {abs(roll).max():.2f}°, at the end {roll[-1]:.3f}°")
assert abs(roll[-1]) < 0.1 * abs(roll).max()

# %%
sol.view()
