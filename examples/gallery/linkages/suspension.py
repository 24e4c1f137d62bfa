"""
A double wishbone with a tie rod
================================

The wheel carrier of a car on two wishbones.  It would turn freely about its two balls; a tie rod,
:meth:`mechc.Cut.rod`, holds its direction.  Where the rod is mounted decides how far the wheel
steers by itself as it moves up and down.
"""

import numpy as np
import sympy as sm
import sympy.physics.mechanics as me
from scipy.spatial.transform import Rotation

import mechc

# %%
# Points of the car as it stands, in m: x forward, y to the left, z up.

PIVOTS = {"lower": (0, 0.35, 0.2), "upper": (0, 0.45, 0.48)}
BALLS = {"lower": (0.01, 0.72, 0.18), "upper": (-0.01, 0.67, 0.5)}
HUB, ARM = (0, 0.76, 0.32), (0.13, 0.69, 0.24)
SPRING = (0, 0.5, 0.65)


def between(one, other, frame):
    x, y, z = np.subtract(other, one)
    return x * frame.x + y * frame.y + z * frame.z


car = me.RigidBody("car")
wheel = me.RigidBody("wheel", mass=30.0)
wheel.central_inertia = me.inertia(wheel.frame, 0.8, 1.4, 0.8)
at = {name: between((0, 0, 0), place, car.frame) for name, place in PIVOTS.items()}
height, length = sm.symbols("height length")
inner = 0.12 * car.x + 0.36 * car.y + height * car.z  # of the tie rod, at the rack
joints, arms = [], {}
for name in ("lower", "upper"):
    arm = arms[name] = me.RigidBody(name, mass=3.0)
    arm.central_inertia = me.inertia(arm.frame, 0.05, 0.02, 0.06)
    half = between(PIVOTS[name], BALLS[name], arm.frame) / 2
    joints.append(
        me.PinJoint(
            f"hinge_{name}", car, arm, parent_point=at[name], child_point=-half, joint_axis=car.x
        )
    )
lower, upper = arms["lower"], arms["upper"]
ball = between(PIVOTS["lower"], BALLS["lower"], lower.frame) / 2
top = between(PIVOTS["upper"], BALLS["upper"], upper.frame) / 2
joints += [
    me.SphericalJoint(
        "lower_ball", lower, wheel,
        parent_point=ball, child_point=between(HUB, BALLS["lower"], wheel.frame),
    ),
    mechc.Cut.spherical("upper_ball", upper, wheel, top, between(HUB, BALLS["upper"], wheel.frame)),
    mechc.Cut.rod(
        "tie_rod", car, wheel, length, inner, between(HUB, ARM, wheel.frame)
    ),
]  # fmt: skip

# %%
# A spring and a damper from the lower wishbone to the car carry its share of the weight, 3.5 kN.

mount = car.masscenter.locatenew("mount", between((0, 0, 0), SPRING, car.frame))
seat = lower.masscenter.locatenew("seat", ball / 4)
strut = me.LinearPathway(mount, seat)
free = 0.605
loads = [me.LinearSpring(4e4, strut, free), me.LinearDamper(2500, strut)]
ground = (wheel.masscenter, 3500 * car.z)

mechanism = mechc.from_joints(
    "suspension",
    joints,
    gravity=-9.81 * car.z,
    loads=[*loads, ground],
    drawing=mechc.Drawing(
        view=("-y", "z"),
        solids=(mechc.Solid.wheel("tyre", wheel.masscenter, wheel.frame, 0.3, axis="y"),),
    ),
)
model = mechc.compile(
    mechanism, outputs=("energy", "points", {"pull": mechc.multiplier("tie_rod")})
)

# %%
# The wheel moves up and down by 7 cm.  How far does it steer, by the height of the rack?

near = {"q_hinge_upper": 0.0, **{f"q{k}_lower_ball": 0.0 for k in range(3)}}


def mounted(height):
    inner = (0.12, 0.36, height)
    return {"height": height, "length": float(np.linalg.norm(np.subtract(ARM, inner)))}


def toe(params):
    """Lift of the hub in m, and the wheel's angle about the vertical in degrees."""
    angles = np.linspace(-0.2, 0.2, 81)
    sweep = model.sweep_positions("q_hinge_lower", angles, guess=near, params=params)
    q = dict(zip(model.coordinates, sweep.q.T, strict=True))
    turns = np.stack([q[f"q{k}_lower_ball"] for k in range(3)], axis=-1)
    carried = Rotation.from_euler("x", angles[:, None]) * Rotation.from_euler("XYZ", turns)
    axle = carried.apply([0, 1, 0])
    hub = sweep.points[:, model.point_names.index("wheel_masscenter"), 2]
    return hub - HUB[2], np.degrees(np.arctan2(axle[:, 0], axle[:, 1]))


heights = (0.23, 0.24, 0.25, 0.26)
lifts = (-0.07, -0.035, 0, 0.035, 0.07)
for at in heights:
    lift, turned = toe(mounted(at))
    print(f"{1000 * at:.0f} mm:", "  ".join(f"{x:+.2f}°" for x in np.interp(lifts, lift, turned)))
    assert abs(np.interp(0, lift, turned)) < 1e-9
    if at == 0.25:  # where the rod points to the wishbones' common pole
        assert abs(turned).max() < 0.3

# %%
# It starts 5 cm too high and swings to where the spring carries the load.

best = mounted(0.25)
start = model.assemble({"q_hinge_lower": 0.12}, guess=near, params=best)
sol = model.simulate(2.0, start, best)
pull = sol.output("pull")
print(f"the tie rod carries {pull.min():.0f} to {pull.max():.0f} N")
assert sol.status.ok
sol.view()
