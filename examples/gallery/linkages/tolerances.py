"""
Tolerances of a slider-crank
============================

Crank, rod and offset of the slide are made with tolerances.  How exact are the slide's two ends,
which part matters most, and do ten thousand drawn mechanisms agree with the linear estimate?
"""

import numpy as np
import sympy as sm
import sympy.physics.mechanics as me

import mechc

r, l, e, omega = sm.symbols("r l e omega", positive=True)
frame = me.RigidBody("frame")
crank, slide = me.RigidBody("crank", mass=1.0), me.RigidBody("slide", mass=0.5)
crank.central_inertia = me.inertia(crank.frame, 0, 0, 1e-3)
main = me.PinJoint("main", frame, crank, joint_axis=frame.z)
rail = me.PrismaticJoint("rail", frame, slide, parent_point=e * frame.y, joint_axis=frame.x)
rod = mechc.Cut.rod("rod", crank, slide, l, parent_point=r * crank.x)
mechanism = mechc.from_joints(
    "slider_crank",
    [main, rail, rod],
    motors=[mechc.Motor(main, speed=omega)],
    parameters={r: "40 mm", l: "140 mm", e: "30 mm", omega: 2 * sm.pi},
)
model = mechc.compile(mechanism)

# %%
# A tolerance is three standard deviations of the normal distribution of a part's length.

parts = {"r": "0.05 mm", "l": "0.1 mm", "e": "0.2 mm"}
found = model.tolerances(
    parts,
    of=["max(q_rail)", "min(q_rail)"],
    t_span=1.0,
    y0={"q_main": -0.5},
    guess={"q_rail": 0.15},
    count=10_000,
)
print(found)
found.plot()

# %%
# At the ends crank and rod are in line: the slide is at the root of (l ± r)² - e².

nominal = {r: 0.04, l: 0.14, e: 0.03}
for k, end in enumerate((sm.sqrt((l + r) ** 2 - e**2), sm.sqrt((l - r) ** 2 - e**2))):
    slopes = np.array([end.diff(part).subs(nominal) for part in nominal], dtype=float)
    effects = slopes * [5e-5, 1e-4, 2e-4]
    assert abs(found.nominal[k] - float(end.subs(nominal))) < 1e-9
    assert abs(found.slopes[k] - slopes).max() < 1e-7
    assert abs(found.shares[k] - effects**2 / (effects @ effects)).max() < 1e-6
    assert abs(found.drawn[:, k].std() / found.sigma[k] - 1) < 0.03

# %%
# The nominal motion:

found.batch[0].animate()
