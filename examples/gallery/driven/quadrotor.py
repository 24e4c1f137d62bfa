"""
A quadrotor on a helix
======================

Four rotors lift and tilt a rigid body.  A controller of the textbook kind, written as expressions
of the state, follows a helix: it is compiled into the equations of motion.
"""

import numpy as np
import sympy as sm
import sympy.physics.mechanics as me

import mechc

t = me.dynamicsymbols._t
x, y, z, phi, theta, psi = q = me.dynamicsymbols("x y z phi theta psi")
u = me.dynamicsymbols("v_x v_y v_z omega_x omega_y omega_z")
lift, T_x, T_y, T_z = inputs = me.dynamicsymbols("lift T_x T_y T_z")
m, I_x, I_y, I_z, g = sm.symbols("m I_x I_y I_z g", positive=True)
N, O = me.ReferenceFrame("N"), me.Point("O")
B = N.orientnew("B", "Body", (psi, theta, phi), "321")
from_angles = B.ang_vel_in(N)
B.set_ang_vel(N, u[3] * B.x + u[4] * B.y + u[5] * B.z)
O.set_vel(N, 0)
G = O.locatenew("G", x * N.x + y * N.y + z * N.z)
G.set_vel(N, u[0] * N.x + u[1] * N.y + u[2] * N.z)
rotors = [G.locatenew(f"rotor {k}", 0.23 * arm) for k, arm in enumerate((B.x, B.y, -B.x, -B.y))]
drone = me.RigidBody("drone", G, B, m, (me.inertia(B, I_x, I_y, I_z), G))
kinematics = [a.diff(t) - b for a, b in zip(q[:3], u[:3], strict=True)]
kinematics += [(from_angles - B.ang_vel_in(N)).dot(axis) for axis in B]
kane = me.KanesMethod(N, q, u, kinematics)
kane.kanes_equations(
    [drone], [(G, lift * B.z - m * g * N.z), (B, T_x * B.x + T_y * B.y + T_z * B.z)]
)

# %%
# The outer loop asks for accelerations, the inner one for the angles that give them.

path = (sm.cos(t), sm.sin(t), 0.2 * t)
asked = [
    4 * (want - have) + 4 * (want.diff(t) - rate) + want.diff(t, 2)
    for want, have, rate in zip(path, q[:3], u[:3], strict=True)
]
control = {
    lift: m * (g + asked[2]) / (sm.cos(phi) * sm.cos(theta)),
    T_x: I_x * (-100 * (phi + asked[1] / g) - 20 * u[3]),
    T_y: I_y * (-100 * (theta - asked[0] / g) - 20 * u[4]),
    T_z: I_z * (-9 * psi - 6 * u[5]),
}
model = mechc.compile(
    kane,
    defaults={"m": 0.65, "I_x": 7.5e-3, "I_y": 7.5e-3, "I_z": 1.3e-2, "g": 9.81},
    inputs=control,
    drawing=mechc.Drawing(
        links=(("arm x", (rotors[0], G, rotors[2])), ("arm y", (rotors[1], G, rotors[3]))),
        traced=("G",),
        view=("x", "z"),
    ),
)
sol = model.simulate(15, {"x": 1.0})

# %%
off = np.hypot(sol["x"] - np.cos(sol.t), sol["y"] - np.sin(sol.t))[sol.t > 8].max()
print(f"at most {off * 100:.0f} cm off the helix once it is reached")
assert off < 0.2

# %%
sol.view()
