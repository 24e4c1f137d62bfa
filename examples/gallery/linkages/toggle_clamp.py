"""
A toggle clamp
==============

A handle presses an arm with a rubber pad on a work piece.  As the handle's joints come in line with
the link that holds it, a small force of the hand makes a large one at the pad; a little beyond that
line the handle lies on a stop, and the clamp stays closed without the hand.
"""

import numpy as np
import sympy as sm
import sympy.physics.mechanics as me

import mechc

# %%
# With both angles zero the joints of handle and link, B, C and D, are in line.  Points in mm.

B, C, D, PAD, GRIP = np.array([(0, 30), (-20, 18), (-50, 0), (60, -20), (-130, 40)])
link = np.hypot(*(C - D)) / 1000
stiffness, damping, limit, hand = sm.symbols("stiffness damping limit hand")


def at(place, frame, origin=(0, 0)):
    x, y = (np.subtract(place, origin) / 1000).tolist()
    return x * frame.x + y * frame.y


base = me.RigidBody("base")
arm, handle = me.RigidBody("arm", mass=0.15), me.RigidBody("handle", mass=0.1)
arm.central_inertia = me.inertia(arm.frame, 0, 0, 1e-4)
handle.central_inertia = me.inertia(handle.frame, 0, 0, 2e-4)
centre = (-60, 34)  # of the handle; that of the arm is at its hinge
hinge = me.PinJoint("hinge", base, arm, joint_axis=base.z)
turn = me.PinJoint(
    "handle", arm, handle,
    parent_point=at(B, arm), child_point=at(B, handle, centre), joint_axis=arm.z,
)  # fmt: skip
rod = mechc.Cut.rod("link", base, handle, link, at(D, base), at(C, handle, centre))
pad = arm.masscenter.locatenew("pad", at(PAD, arm))
grip = handle.masscenter.locatenew("grip", at(GRIP, handle, centre))

# %%
# The rubber is pressed by 1 mm in line.  The hand pushes across the handle.

depth = at(PAD, base).dot(base.y) + 1e-3 - at(PAD, arm).dot(base.y)
across = (GRIP - B) / np.hypot(*(GRIP - B))
push = hand * (-float(across[1]) * handle.x + float(across[0]) * handle.y)
pressed = stiffness * sm.Max(depth, 0)
resisted = -damping * turn.speeds[0] * base.z
clamp = mechc.from_joints(
    "toggle clamp",
    [hinge, turn, rod],
    loads=[(pad, pressed * base.y), (grip, push), (handle.frame, resisted), (arm.frame, -resisted)],
    parameters={stiffness: 1e6, damping: 3.0, limit: "3 deg", hand: 0.0},
    points=(turn.parent_point, rod.child_point, pad, grip),
    drawing=mechc.Drawing(
        links=(("handle", (turn.child_point, grip)), ("arm", (hinge.child_point, pad))),
        traced=(grip, pad),
    ),
)
model = mechc.compile(clamp, outputs=("energy", "points", {"pressed": pressed}))

# %%
# What the hand needs at rest, and the closed form: the handle turns about the point P where the
# lines of its two supports cross, OB and DC.

sweep = model.sweep_positions("q_handle", np.radians([-9, -6, -3, -1, -0.1]), guess={"q_hinge": 0})
still = np.zeros_like(sweep.q)
states = np.hstack([sweep.q, still])
needed = model.inverse_dynamics(states, still, inputs=["hand"]).inputs[:, 0]
places = sweep.points[..., 0] + 1j * sweep.points[..., 1]
d = complex(*D) / 1000
for force, push, (b, c, p, g) in zip(model.output("pressed", states), needed, places, strict=True):
    P = b * (d.conjugate() * (c - d)).imag / (b.conjugate() * (c - d)).imag
    of_hand = ((g - P) * (g - b).conjugate()).real / abs(g - b)  # its lever arm about P
    expected = abs(b) / abs(b - P) * of_hand / p.real
    print(f"{push:5.2f} N of the hand, {force:4.0f} N at the pad: {force / push:.1f} times as much")
    assert abs(force / push / expected - 1) < 1e-9

# %%
# The hand pushes with 60 N for 1.5 s and lets go.  With the stop 3° beyond the line the clamp
# stays closed; with the stop 3° before it the pad pushes the clamp open.

start = model.assemble({"q_handle": "-70 deg"}, guess={"q_hinge": 0.4})
released = mechc.Event("t > 1.5", reset={"hand": 0})
stop = mechc.Stop("limit - q_handle")
for limit in (-3, 3):
    params = {"limit": f"{limit} deg", "hand": "60 N"}
    sol = model.simulate(3.0, start, params, events=[released, stop])
    most, last = sol["pressed"].max(), sol["pressed"][-1]
    print(f"stop at {limit:+d}°: {most:.0f} N at the pad, without the hand {last:.0f} N")
    assert most > 850
    assert last > 850 if limit > 0 else last == 0
sol.animate()
