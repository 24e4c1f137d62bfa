"""
An arm moved by muscles
=======================

Flexors and extensors of shoulder and elbow, with the dynamics of activation (F. E. Zajac, *Muscle
and tendon*, 1989).  Activations are states of their own beside coordinates and speeds;
excitations are inputs, given as functions of time.
"""

import numpy as np
import sympy as sm
import sympy.physics.mechanics as me

import mechc

q1, q2, u1, u2 = me.dynamicsymbols("q1 q2 u1 u2")
a = me.dynamicsymbols("a1:5")
e = me.dynamicsymbols("e1:5")
m1, m2, l1, l2, g = sm.symbols("m1 m2 l1 l2 g")
T0, tau, beta, fastest = sm.symbols("T0 tau beta u_max", positive=True)
N, shoulder = me.ReferenceFrame("N"), me.Point("shoulder")
A, B = N.orientnew("A", "Axis", (q1, N.z)), N.orientnew("B", "Axis", (q2, N.z))
A.set_ang_vel(N, u1 * N.z)
B.set_ang_vel(N, u2 * N.z)
shoulder.set_vel(N, 0)
elbow = shoulder.locatenew("elbow", l1 * A.x)
hand = elbow.locatenew("hand", l2 * B.x)
elbow.v2pt_theory(shoulder, N, A)
hand.v2pt_theory(elbow, N, B)
bodies, loads = [], []
for name, root, frame, mass, length in (
    ("upper", shoulder, A, m1, l1),
    ("lower", elbow, B, m2, l2),
):
    G = root.locatenew(f"G {name}", 0.45 * length * frame.x)
    G.v2pt_theory(root, N, frame)
    central = me.inertia(frame, 0, 0, mass * length**2 / 10)
    bodies.append(me.RigidBody(name, G, frame, mass, (central, G)))
    loads.append((G, -mass * g * N.y))


# %%
# A muscle's torque falls off away from its best angle and with the speed of shortening.


def torque(flexor, extensor, angle, rate):
    reach = sm.exp(-((angle - 1) ** 2))
    return T0 * reach * (flexor * (1 - rate / fastest) - extensor * (1 + rate / fastest))


at_shoulder = torque(a[0], a[1], q1 + 1.5, u1)
at_elbow = torque(a[2], a[3], q2 - q1, u2 - u1)
loads += [(A, (at_shoulder - at_elbow) * N.z), (B, at_elbow * N.z)]
t = me.dynamicsymbols._t
kane = me.KanesMethod(N, [q1, q2], [u1, u2], [q1.diff(t) - u1, q2.diff(t) - u2])
kane.kanes_equations(bodies, loads)

model = mechc.compile(
    kane,
    states={act: (x - (beta + (1 - beta) * x) * act) / tau for act, x in zip(a, e, strict=True)},
    defaults={
        "m1": 2.1, "m2": 1.6, "l1": 0.3, "l2": 0.4, "g": 9.81, "T0": 40.0, "tau": 0.015,
        "beta": 0.3, "u_max": 20.0,
    },
    drawing=mechc.Drawing(
        links=(("forearm", (elbow, hand)),), ground=(shoulder,), traced=("hand",)
    ),
)  # fmt: skip


def pulse(begin, end, height):
    """An excitation that rises and falls."""
    return lambda time: (
        height * 0.5 * (np.tanh((time - begin) / 0.02) - np.tanh((time - end) / 0.02))
    )


excitations = {"e1": pulse(0.1, 0.6, 0.5), "e2": pulse(0.6, 0.8, 0.1)}
excitations |= {"e3": pulse(0.15, 0.5, 0.4), "e4": pulse(0.55, 0.7, 0.2)}
sol = model.simulate(1.5, {"q1": -1.4, "q2": -1.2}, inputs=excitations)
points = model.picture.points(sol.y, sol.params, sol.t)
lifted = points[:, model.picture.point_names.index("hand"), 1]
print(f"the hand is lifted from {lifted[0]:.2f} m to {lifted.max():.2f} m")
assert lifted.max() > lifted[0] + 0.1

# %%
sol.animate(fps=120)
