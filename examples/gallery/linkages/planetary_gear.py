"""
A planetary gear
================

A motor turns the sun, the ring is fixed, and three planets carry the arm around.  Teeth that mesh
are constraints between angles: of five angles one is free.
"""

import numpy as np
import sympy as sm
import sympy.physics.mechanics as me

import mechc

t = me.dynamicsymbols._t
sun, arm, *planets = q = me.dynamicsymbols("sun arm planet_1:4")
u = me.dynamicsymbols("u_s u_a u_1:4")
T = me.dynamicsymbols("T")
r_s, r_p, m, J = sm.symbols("r_s r_p m J", positive=True)
N, O = me.ReferenceFrame("N"), me.Point("O")
O.set_vel(N, 0)
frames = [N.orientnew(f"of {angle.name}", "Axis", (angle, N.z)) for angle in q]
for frame, rate in zip(frames, u, strict=True):
    frame.set_ang_vel(N, rate * N.z)
S, A, *P = frames

# %%
# Without slip at the sun and at the ring, whose radius is that of the sun and two planets'.

r_r = r_s + 2 * r_p
meshing = [r_s * (sun - arm) + r_p * (p - arm) for p in planets]
meshing.append(r_r * (0 - arm) - r_p * (planets[0] - arm))

disc = me.RigidBody("sun", O, S, m, (me.inertia(S, 0, 0, m * r_s**2 / 2), O))
carrier = me.RigidBody("arm", O, A, m, (me.inertia(A, 0, 0, J), O))
bodies, circles = [disc, carrier], []
for k, frame in enumerate(P):
    turned = 2 * sm.pi * k / 3
    hub = O.locatenew(f"hub {k}", (r_s + r_p) * (sm.cos(turned) * A.x + sm.sin(turned) * A.y))
    hub.v2pt_theory(O, N, A)
    bodies.append(
        me.RigidBody(f"planet {k}", hub, frame, m, (me.inertia(frame, 0, 0, m * r_p**2 / 2), hub))
    )
    circles.append((hub, frame, r_p))
circles.append((O, S, r_s))


def circle(k, centre, frame, radius):
    """A polygon with a spoke that shows how it turns."""
    turns = [2 * sm.pi * i / 24 for i in range(24)]
    arms = [radius * (sm.cos(a) * frame.x + sm.sin(a) * frame.y) for a in turns]
    rim = [centre.locatenew(f".rim {k}, 0", arms[0])]
    for i in range(1, 24):
        rim.append(rim[-1].locatenew(f".rim {k}, {i}", arms[i] - arms[i - 1]))
    return f"wheel {k}", (centre, *rim, rim[0])


rates = dict(zip([angle.diff(t) for angle in q], u, strict=True))
kane = me.KanesMethod(
    N,
    q_ind=[sun],
    u_ind=[u[0]],
    kd_eqs=[rate - qdot for qdot, rate in rates.items()],
    q_dependent=q[1:],
    u_dependent=u[1:],
    configuration_constraints=meshing,
    velocity_constraints=[row.diff(t).subs(rates) for row in meshing],
)
kane.kanes_equations(bodies, [(S, T * N.z)])
model = mechc.compile(
    kane,
    defaults={"r_s": 0.03, "r_p": 0.02, "m": 0.2, "J": 1e-4},
    inputs={T: 2e-3 * (20 - u[0])},
    drawing=mechc.Drawing(
        links=tuple(circle(k, *each) for k, each in enumerate(circles)), ground=(O,), traced=()
    ),
)
sol = model.simulate(4, model.assemble({"sun": 0.0}))

# %%
# Willis' formula: the arm turns r_s / (2 (r_s + r_p)) times as fast as the sun.

ratio = 0.03 / (2 * (0.03 + 0.02))
assert np.allclose(sol["arm"], ratio * sol["sun"], rtol=0, atol=1e-12)
print(f"sun {sol['sun'][-1] / (2 * np.pi):.2f} turns, arm {sol['arm'][-1] / (2 * np.pi):.2f}")

# %%
sol.animate()
