"""
Bennett's linkage
=================

Four links and four hinges in space: by counting, the loop should be rigid, and yet it moves.
Opposite links are equal, and their lengths are as the sines of the angles between their hinges
(G. T. Bennett, *A new mechanism*, 1903).  Two of the cut's five rows follow from the others
wherever the loop is closed.
"""

import numpy as np
import sympy as sm
from sympy.physics.mechanics import PinJoint, RigidBody, dynamicsymbols, inertia

import mechc

# %%
# Length, and the angle about the link from the hinge at its near end to that at its far end.

links = [(2, sm.pi / 2), (1, sm.pi / 6), (2, sm.pi / 2), (1, sm.pi / 6)]
g = sm.Symbol("g")


def rod(name, length):
    body = RigidBody(name, mass=1)
    about = sm.Rational(length**2, 12)
    body.central_inertia = inertia(body.frame, sm.Rational(1, 50), about, about)
    return body


ground = at = RigidBody("ground")
place, angle = 1 * ground.x, links[-1][1]
joints = []
for k, (length, next_angle) in enumerate(links[:-1]):
    body = rod(f"link {k}", length)
    axis = at.frame.orientnew(f"hinge {k}", "Axis", (angle, at.x))
    joints.append(
        PinJoint(
            f"pin_{k}", at, body, *dynamicsymbols(f"q_{k} u_{k}"), place, -length * body.x / 2,
            parent_interframe=axis, joint_axis=axis.z,
        )
    )  # fmt: skip
    at, place, angle = body, length * body.x / 2, next_angle
axis = at.frame.orientnew("last hinge", "Axis", (angle, at.x))
joints.append(
    mechc.Cut.pin(
        "last", at, ground, place, 0 * ground.x, joint_axis=axis.z,
        parent_interframe=axis, child_interframe=ground.frame,
    )
)  # fmt: skip
mechanism = mechc.from_joints(
    "bennett", joints, gravity=-g * ground.y, parameters={"g": 9.81}, ground=ground
)
model = mechc.compile(mechanism)
for row in model.redundant_constraints():
    print(row)

# %%
# Closed configurations are known: the tangents of half of two neighbouring angles have a constant
# product.

ratio = np.sin(np.pi / 3) / np.sin(-np.pi / 6)
guess = {"q_1": 2 * np.arctan(ratio / np.tan(0.5)), "q_2": -1.0}
sol = model.simulate(5, model.assemble({"q_0": 1.0}, guess=guess))
product = np.tan(sol["q_0"] / 2) * np.tan(sol["q_1"] / 2)
print(f"the product deviates by {abs(product - ratio).max():.1e}")
assert np.median(abs(product - ratio)) < 1e-10
assert sol.energy_drift < 1e-8

# %%
sol.view()
