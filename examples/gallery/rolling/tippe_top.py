"""
A tippe top
===========

A truncated sphere with a stem, its mass centre below the middle: spun fast, it turns over and
stands on its stem.  Sliding friction does it (R. J. Cohen, Am. J. Phys. 45, 1977); Coulomb's law
is made smooth near zero slip.
"""

import numpy as np
import sympy as sm
import sympy.physics.mechanics as me

import mechc

t = me.dynamicsymbols._t
q = x, y, phi, theta, psi = me.dynamicsymbols("x y phi theta psi")
u = me.dynamicsymbols("u1:6")
m, R, a, I1, I3, g, mu, v0 = sm.symbols("m R a I_1 I_3 g mu v_0", positive=True)
N, O = me.ReferenceFrame("N"), me.Point("O")
A = N.orientnew("A", "Axis", (phi, N.z))
B = A.orientnew("B", "Axis", (theta, A.x))
T = B.orientnew("T", "Axis", (psi, B.z))
A.set_ang_vel(N, u[2] * N.z)
B.set_ang_vel(A, u[3] * A.x)
T.set_ang_vel(B, u[4] * B.z)
O.set_vel(N, 0)
middle = O.locatenew("middle", x * N.x + y * N.y + R * N.z)
middle.set_vel(N, u[0] * N.x + u[1] * N.y)
G = middle.locatenew("G", -a * B.z)
G.v2pt_theory(middle, N, T)
contact = middle.locatenew("contact", -R * N.z)
contact.v2pt_theory(middle, N, T)
stem = middle.locatenew("stem", 1.6 * R * T.z)


def around(k):
    """From the middle to the belt."""
    return R * (sm.cos(k * sm.pi / 8) * T.x + sm.sin(k * sm.pi / 8) * T.y)


belt = [middle.locatenew(".belt 0", around(0))]
for k in range(1, 16):
    belt.append(belt[-1].locatenew(f".belt {k}", around(k) - around(k - 1)))

slip = contact.vel(N)
friction = -mu * m * g * slip / sm.sqrt(slip.dot(slip) + v0**2)
top = me.RigidBody("top", G, T, m, (me.inertia(B, I1, I1, I3), G))
kane = me.KanesMethod(N, q, u, [c.diff(t) - s for c, s in zip(q, u, strict=True)])
kane.kanes_equations([top], [(G, -m * g * N.z), (contact, friction)])

model = mechc.compile(
    kane,
    defaults={
        "m": 6e-3, "R": 0.015, "a": 0.003, "I_1": 8e-7, "I_3": 7e-7, "g": 9.81, "mu": 0.3,
        "v_0": 0.01,
    },
    drawing=mechc.Drawing(
        links=(("stem", (middle, stem)), ("belt", (*belt, belt[0]))),
        traced=("stem",),
        view=("x", "z"),
    ),
)  # fmt: skip
sol = model.simulate(4, {"theta": 0.1, "u5": 150.0})

# %%
# 0° is upright, 180° upside down.

tilt = np.degrees(sol["theta"])
print(f"tilt: {tilt[0]:.0f}° at the start, {tilt[-1]:.0f}° at the end")
assert tilt[-1] > 150

# %%
sol.view()
