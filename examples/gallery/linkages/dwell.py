"""
A six-bar that dwells
=====================

A four-bar carries a point along a curve that is nearly an arc of a circle for a third of a turn.  A
rod as long as its radius lets a lever rest meanwhile (R. L. Norton, *Design of Machinery*, 1992).
All lengths and pivots are found by :meth:`mechc.Model.synthesize`, from what the lever has to do.
"""

import numpy as np
import sympy as sm
from sympy.physics.mechanics import PinJoint, RigidBody, inertia

import mechc

l = sm.symbols("l_0:6")
x_c, y_c, x_s, y_s, m, g = sm.symbols("x_C y_C x_S y_S m g")
ground = RigidBody("ground")


def link(name, length):
    """A rod, and the places of its ends."""
    body = RigidBody(name, mass=m * length)
    body.central_inertia = inertia(body.frame, 0, 0, m * length**3 / 12)
    return body, -length / 2 * body.x, length / 2 * body.x


crank, crank_at, crank_end = link("crank", l[0])
coupler, coupler_at, coupler_end = link("coupler", l[1])
rocker, rocker_at, rocker_end = link("rocker", l[2])
rod, rod_at, rod_end = link("rod", l[4])
lever, lever_at, lever_end = link("lever", l[5])
tracer = coupler_at + x_c * coupler.x + y_c * coupler.y
pivot = x_s * ground.x + y_s * ground.y


def pin(name, parent, child, at, child_at):
    return PinJoint(name, parent, child, parent_point=at, child_point=child_at, joint_axis=ground.z)


joints = [
    pin("crank", ground, crank, 0 * ground.x, crank_at),
    pin("coupler", crank, coupler, crank_end, coupler_at),
    pin("rocker", ground, rocker, l[3] * ground.x, rocker_at),
    pin("rod", coupler, rod, tracer, rod_at),
    pin("lever", ground, lever, pivot, lever_at),
    mechc.Cut.pin("loop", coupler, rocker, coupler_end, rocker_end, joint_axis=ground.z),
    mechc.Cut.pin("drive", rod, lever, rod_end, lever_end, joint_axis=ground.z),
]
usual = {
    "l_0": 0.1, "l_1": 0.3, "l_2": 0.25, "l_3": 0.3, "l_4": 0.4, "l_5": 0.2, "x_C": 0.15,
    "y_C": 0.1, "x_S": 0.4, "y_S": 0.3, "m": 1.0, "g": 9.81,
}  # fmt: skip
mechanism = mechc.from_joints(
    "dwell", joints, gravity=-g * ground.y, ground=ground, parameters=usual
)
model = mechc.compile(mechanism, outputs=("energy", "points", "sensitivities"))

# %%
# The lever rests over 120 degrees of the crank's turn, and is lifted by 30 degrees in between.

rests = np.radians(np.arange(0.0, 121.0, 10.0))
designs = model.synthesize(
    {
        "q_crank": np.append(rests, np.radians(240.0)),
        "q_lever": np.append(0.0 * rests, np.radians(30.0)),
    },
    {
        **dict.fromkeys(("l_1", "l_2", "l_4", "l_5"), (0.05, 0.6)),
        **dict.fromkeys(("x_C", "y_C"), (-0.5, 0.5)), **dict.fromkeys(("x_S", "y_S"), (-0.6, 0.6)),
        "l_3": (0.1, 0.6), "q_crank": None, "q_lever": None,
    },
    params={"l_0": 0.1}, turns=True, samples=1024, refined=12, tolerances={"q_lever": "1deg"},
    transmission_angle=[
        ("rod_coupler_joint", "drive_lever_joint", "lever_ground_joint", "30deg"),
        ("coupler_crank_joint", "loop_rocker_joint", "rocker_ground_joint", "30deg"),
    ],
)  # fmt: skip
best = designs[0]
print(best)
assert not best.warnings
assert np.degrees(best.errors["q_lever"]) < 0.1

# %%
# It coasts, and the lever rests in each turn.

sol = model.simulate(1.5, best.assemble({"u_crank": 12.0}), best.params)
turned = (sol["q_crank"] - best.driven[0]) % (2 * np.pi)
resting = sol["q_lever"][turned < rests[-1]]
print(f"at rest the lever moves by {np.degrees(np.ptp(resting)):.3f} degrees")
assert np.degrees(np.ptp(resting)) < 0.2

# %%
sol.animate()
