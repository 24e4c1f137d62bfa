"""
Landing on a soft ground
========================

Foot, shank, thigh and trunk drop from a small height.  The ground is a smooth law of contact at
heel and toe (compliance and damping after K. H. Hunt and F. R. E. Crossley, 1975; friction that
saturates), knee and hip are stiff springs with dampers: a gait model's contact on a leg.
"""

import sympy as sm
import sympy.physics.mechanics as me

import mechc

t = me.dynamicsymbols._t
x, y, ankle, knee, hip, trunk = q = me.dynamicsymbols("x y q_foot q_shank q_thigh q_trunk")
u = me.dynamicsymbols("v_x v_y u_foot u_shank u_thigh u_trunk")
k, c, mu, g = sm.symbols("k c mu g", positive=True)
N, O = me.ReferenceFrame("N"), me.Point("O")
O.set_vel(N, 0)
F, S, T, H = frames = [
    N.orientnew(name, "Axis", (angle, N.z))
    for name, angle in zip(("foot", "shank", "thigh", "trunk"), q[2:], strict=True)
]
for frame, rate in zip(frames, u[2:], strict=True):
    frame.set_ang_vel(N, rate * N.z)
A = O.locatenew("ankle", x * N.x + y * N.y)
A.set_vel(N, u[0] * N.x + u[1] * N.y)
K = A.locatenew("knee", 0.43 * S.y)
hip_joint = K.locatenew("hip", 0.43 * T.y)
head = hip_joint.locatenew("head", 0.8 * H.y)
heel, toe = (
    A.locatenew("heel", -0.06 * F.x - 0.08 * F.y),
    A.locatenew("toe", 0.16 * F.x - 0.08 * F.y),
)
for point, root, frame in (
    (K, A, S),
    (hip_joint, K, T),
    (head, hip_joint, H),
    (heel, A, F),
    (toe, A, F),
):
    point.v2pt_theory(root, N, frame)

bodies, loads = [], []
parts = (("foot", A, F, 0.05 * F.x - 0.04 * F.y, 1.2), ("shank", A, S, 0.24 * S.y, 3.5))
parts += (("thigh", K, T, 0.24 * T.y, 8.0), ("trunk", hip_joint, H, 0.35 * H.y, 45.0))
for name, root, frame, arm, mass in parts:
    G = root.locatenew(f"G of the {name}", arm)
    G.v2pt_theory(root, N, frame)
    bodies.append(me.RigidBody(name, G, frame, mass, (me.inertia(frame, 0, 0, 0.02 * mass), G)))
    loads.append((G, -mass * g * N.y))

# %%
# The compression is made smooth over a millimetre; friction acts against the slip.

for point in (heel, toe):
    height, velocity = point.pos_from(O).dot(N.y), point.vel(N)
    depth = (sm.sqrt(height**2 + 1e-6) - height) / 2
    normal = k * depth ** sm.Rational(3, 2) * (1 - c * velocity.dot(N.y))
    slip = velocity.dot(N.x)
    loads.append((point, normal * N.y - mu * normal * sm.tanh(slip / 0.05) * N.x))

# %%
# Ankle, knee, hip, and the balance of the trunk.

for stiffness, damping, lower, upper, rest in (
    (600, 30, 0, 1, 0),
    (900, 60, 1, 2, 0.5),
    (900, 60, 2, 3, -0.6),
):
    turned = q[3 + upper - 1] - q[2 + lower]
    moment = -stiffness * (turned - rest) - damping * (u[3 + upper - 1] - u[2 + lower])
    loads += [(frames[upper], moment * N.z), (frames[lower], -moment * N.z)]

kane = me.KanesMethod(N, q, u, [a.diff(t) - b for a, b in zip(q, u, strict=True)])
kane.kanes_equations(bodies, loads)
model = mechc.compile(
    kane,
    defaults={"k": 4e5, "c": 0.8, "mu": 0.9, "g": 9.81},
    drawing=mechc.Drawing(links=(("foot", (A, heel, toe, A)),), traced=("hip",)),
)
start = {"x": 0.0, "y": 0.3, "q_shank": -0.25, "q_thigh": 0.25, "q_trunk": -0.35}
sol = model.simulate(0.8, start, rtol=1e-7)
points = model.picture.points(sol.y, sol.params, sol.t)
height = points[:, model.picture.point_names.index("hip"), 1]
print(f"the hip sinks from {height[0]:.2f} m to {height.min():.2f} m")
assert sol.status.ok

# %%
sol.animate(fps=250)
