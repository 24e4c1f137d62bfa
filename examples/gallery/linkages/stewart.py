"""
A Stewart platform
==================

Six linear motors between the ground and a platform hold it in any attitude (D. Stewart, *A
platform with six degrees of freedom*, 1965).  Each leg follows the length that its end of the
circle asks for, as a spring and damper do; the platform's own six coordinates are free.
"""

import numpy as np
import sympy as sm
import sympy.physics.mechanics as me

import mechc

t = me.dynamicsymbols._t
x, y, z, roll, pitch, yaw = q = me.dynamicsymbols("x y z roll pitch yaw")
u = me.dynamicsymbols("v_x v_y v_z omega_x omega_y omega_z")
m, I, k, c, g = sm.symbols("m I k c g")
N, O = me.ReferenceFrame("N"), me.Point("O")
P = N.orientnew("platform", "Body", (roll, pitch, yaw), "123")
from_angles = P.ang_vel_in(N)
P.set_ang_vel(N, u[3] * P.x + u[4] * P.y + u[5] * P.z)
O.set_vel(N, 0)
G = O.locatenew("G", x * N.x + y * N.y + z * N.z)
G.set_vel(N, u[0] * N.x + u[1] * N.y + u[2] * N.z)

# %%
# Joints in pairs: on the ground 24° apart, on the platform 24° apart and turned by 60°.

feet, heads = [], []
for j in range(6):
    low = sm.pi * (2 * (j // 2) / sm.S(3) + (1 if j % 2 else -1) / sm.S(15))
    high = sm.pi * (2 * (j // 2) / sm.S(3) + (4 if j % 2 else -4) / sm.S(15))
    feet.append(O.locatenew(f"foot {j}", sm.cos(low).n() * N.x + sm.sin(low).n() * N.y))
    head = G.locatenew(f"head {j}", 0.6 * (sm.cos(high).n() * P.x + sm.sin(high).n() * P.y))
    feet[j].set_vel(N, 0)
    head.v2pt_theory(G, N, P)
    heads.append(head)

# %%
# The wanted pose moves around a circle of 15 cm and nods; the legs' wanted lengths follow from it.

pose = {x: 0.15 * sm.cos(2 * t), y: 0.15 * sm.sin(2 * t), z: 1 + 0.05 * sm.sin(4 * t)}
pose |= {roll: 0.2 * sm.sin(2 * t), pitch: 0.2 * sm.cos(2 * t), yaw: 0}
loads = [(G, -m * g * N.z)]
for foot, head in zip(feet, heads, strict=True):
    leg = head.pos_from(foot)
    length = sm.sqrt(sum(leg.dot(axis) ** 2 for axis in N))
    along = leg / length
    wanted = length.subs(pose)
    rate = head.vel(N).dot(along) - wanted.diff(t)
    loads.append((head, (m * g / 6 - k * (length - wanted) - c * rate) * along))

platform = me.RigidBody("platform", G, P, m, (I * me.inertia(P, 1, 1, 2), G))
kinematics = [a.diff(t) - b for a, b in zip(q[:3], u[:3], strict=True)]
kinematics += [(from_angles - P.ang_vel_in(N)).dot(axis) for axis in P]
kane = me.KanesMethod(N, q, u, kinematics)
kane.kanes_equations([platform], loads)

model = mechc.compile(
    kane,
    defaults={"m": 10.0, "I": 0.9, "k": 4e4, "c": 800.0, "g": 9.81},
    drawing=mechc.Drawing(
        links=(
            ("platform", (*heads, heads[0])),
            *((f"leg {j}", (feet[j], heads[j])) for j in range(6)),
        ),
        ground=tuple(feet),
        traced=(),
        view=("x", "z"),
    ),
)
sol = model.simulate(6.5, {"x": 0.15, "z": 1.0, "pitch": 0.2})
error = abs(sol["x"] - 0.15 * np.cos(2 * sol.t))[sol.t > 1].max()
print(f"the platform follows to {error * 1000:.1f} mm")
assert error < 0.01

# %%
sol.view()
