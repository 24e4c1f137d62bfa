"""
A falling cat
=============

Dropped upside down, a cat lands on its feet, though nothing turns it: two halves of a body bend
against each other and twist, at zero angular momentum all the time (T. R. Kane and M. P. Scher,
*A dynamical explanation of the falling cat phenomenon*, 1969).  Shown is the motion about the
mass centre.
"""

import numpy as np
import sympy as sm
import sympy.physics.mechanics as me

import mechc

t = me.dynamicsymbols._t
q1, q2, q3, bend, twist = me.dynamicsymbols("q1 q2 q3 beta gamma")
u1, u2, u3, u4, u5 = me.dynamicsymbols("u1:6")
T_b, T_t = me.dynamicsymbols("T_b T_t")
m, I, J, d = sm.symbols("m I J d")
N = me.ReferenceFrame("N")
A = N.orientnew("front half", "Body", (q1, q2, q3), "123")
C = A.orientnew("C", "Axis", (bend, A.y))
B = C.orientnew("back half", "Axis", (twist, C.x))
from_angles = A.ang_vel_in(N)
A.set_ang_vel(N, u1 * A.x + u2 * A.y + u3 * A.z)
C.set_ang_vel(A, u4 * A.y)
B.set_ang_vel(C, u5 * C.x)

centre, spine = me.Point("centre"), me.Point("spine")
centre.set_vel(N, 0)
spine.set_pos(centre, -(d * A.x - d * C.x) / 2)
spine.set_vel(N, -d / 2 * (A.ang_vel_in(N) ^ A.x) + d / 2 * (C.ang_vel_in(N) ^ C.x))
front, back = spine.locatenew("front", d * A.x), spine.locatenew("back", -d * C.x)
front.v2pt_theory(spine, N, A)
back.v2pt_theory(spine, N, C)
fore = [spine.locatenew(f"forefoot {k}", 1.5 * d * A.x - d * A.z) for k in (1,)]
hind = [spine.locatenew(f"hindfoot {k}", -1.5 * d * B.x - d * B.z) for k in (1,)]

bodies = [
    me.RigidBody("front", front, A, m, (me.inertia(A, J, I, I), front)),
    me.RigidBody("back", back, B, m, (me.inertia(B, J, I, I), back)),
]
kinematics = [(from_angles - A.ang_vel_in(N)).dot(axis) for axis in A]
kinematics += [bend.diff(t) - u4, twist.diff(t) - u5]
kane = me.KanesMethod(N, [q1, q2, q3, bend, twist], [u1, u2, u3, u4, u5], kinematics)
loads = [(C, T_b * A.y), (A, -T_b * A.y), (B, T_t * C.x), (C, -T_t * C.x)]
kane.kanes_equations(bodies, loads)

# %%
# The muscles hold the back bent and twist one half against the other by a full turn in 0.6 s.

model = mechc.compile(
    kane,
    defaults={"m": 1.5, "I": 0.01, "J": 0.004, "d": 0.12},
    inputs={
        T_b: -20 * (bend - 1.0) - 0.6 * u4,
        T_t: -1.0 * (twist - 2 * sm.pi * t / 0.6) - 0.1 * u5,
    },
    outputs=("energy", "momenta"),
    drawing=mechc.Drawing(
        links=(("front", (spine, front, fore[0])), ("back", (spine, back, hind[0]))),
        view=("y", "z"),
    ),
)
sol = model.simulate(1.2, {"beta": 1.0, "q1": np.pi})
turned = np.degrees(sol["q1"] - sol["q1"][0])
print(f"turned by {turned[-1]:.0f}°")

# %%
# Nothing turns it from outside: the angular momentum about the centre stays zero.

momentum = model.momenta(sol.y).angular.sum(axis=1)
assert abs(momentum).max() < 1e-9

# %%
sol.view()
