"""
A five-bar robot draws a circle
===============================

Two motors on the ground hold a pen between them by four links.  Each follows the angle that the
circle asks for, as a spring and a damper do.
"""

import numpy as np
import sympy as sm
from sympy.physics.mechanics import PinJoint, RigidBody, dynamicsymbols, inertia

import mechc

t = dynamicsymbols._t
a, b, d, m, k, c = sm.symbols("a b d m k c")
x, y = 0.08 * sm.cos(3 * t), 0.35 + 0.08 * sm.sin(3 * t)


def rod(name, length):
    made = RigidBody(name, mass=m)
    made.central_inertia = m * length**2 / 12 * inertia(made.frame, 0, 1, 1)
    return made


ground = RigidBody("ground")
joints, loads, lower = [], [], []
for side, sign in (("left", -1), ("right", 1)):
    arm, fore = rod(f"{side} arm", a), rod(f"{side} forearm", b)
    shoulder = PinJoint(
        side,
        ground,
        arm,
        parent_point=sign * d * ground.x,
        child_point=-a / 2 * arm.x,
        joint_axis=ground.z,
    )
    elbow = PinJoint(
        f"{side}_elbow",
        arm,
        fore,
        parent_point=a / 2 * arm.x,
        child_point=-b / 2 * fore.x,
        joint_axis=arm.z,
    )
    reach = sm.sqrt((x - sign * d) ** 2 + y**2)
    bend = sm.acos((a**2 + reach**2 - b**2) / (2 * a * reach))
    wanted = sm.atan2(y, x - sign * d) - sign * bend
    q, u = shoulder.coordinates[0], shoulder.speeds[0]
    loads.append((arm.frame, (k * (wanted - q) + c * (wanted.diff(t) - u)) * ground.z))
    joints += [shoulder, elbow]
    lower.append(fore)
pen = mechc.Cut.pin(
    "pen",
    *lower,
    parent_point=b / 2 * lower[0].x,
    child_point=b / 2 * lower[1].x,
    joint_axis=lower[0].z,
)

robot = mechc.from_joints(
    "five_bar",
    [*joints, pen],
    loads=loads,
    parameters={"a": 0.2, "b": 0.3, "d": 0.06, "m": 0.2, "k": 400.0, "c": 8.0},
    drawing=mechc.Drawing(traced=("pen_left forearm_joint",)),
)
model = mechc.compile(robot)

# %%
# The elbows are outside; which of the two assemblies it is follows from a guess.

guess = {"q_left_elbow": -1.5, "q_right_elbow": 1.5}
start = model.assemble({"q_left": 2.4, "q_right": 0.7}, guess=guess)
sol = model.simulate(6, start)
points = model.points(sol.y, t=sol.t)[:, model.point_names.index("pen_left forearm_joint")]
radius = np.hypot(points[:, 0], points[:, 1] - 0.35)[sol.t > 1]
print(f"the pen is {1000 * abs(radius - 0.08).max():.2f} mm off the circle at most")
assert abs(radius - 0.08).max() < 2e-3
assert sol.closure.max() < 1e-12

# %%
sol.view()
