"""
Klann's walking leg
===================

A crank of 17.5 mm moves a foot along a path that is nearly straight on the ground for more than a
third of each turn, and lifts it on the way back.  Six links, one degree of freedom (J. Klann, US
patent 6,260,862, 2001); the lengths are those of an `optimised leg
<http://boim.com/Walkin8r/Klann.html>`_.
"""

import numpy as np
import sympy as sm
import sympy.physics.mechanics as me

import mechc

# %%
# The crank has an angle.  Every other joint is a point mass with two coordinates, and every side of
# a link is a distance that does not change: *natural coordinates* (García de Jalón and Bayo, 1994).

t = me.dynamicsymbols._t
theta, omega, T = me.dynamicsymbols("theta omega T")
r, m, g = sm.symbols("r m g", positive=True)
N, A = me.ReferenceFrame("N"), me.Point("A")
crank = N.orientnew("crank", "Axis", (theta, N.z))
crank.set_ang_vel(N, omega * N.z)
A.set_vel(N, 0)
B = A.locatenew("B", -0.0388 * N.x - 0.0125 * N.y)
D = A.locatenew("D", -0.0146 * N.x + 0.0419 * N.y)
C = A.locatenew("C", r * crank.x)
C.v2pt_theory(A, N, crank)

joints = {"B": B, "C": C, "D": D}
q, u = [theta], [omega]
for name in "EFGH":
    x, y, vx, vy = me.dynamicsymbols(f"x_{name} y_{name} vx_{name} vy_{name}")
    joints[name] = A.locatenew(name, x * N.x + y * N.y)
    joints[name].set_vel(N, vx * N.x + vy * N.y)
    q += [x, y]
    u += [vx, vy]

sides = {"BH": 0.0237, "CF": 0.0734, "CH": 0.0388, "FH": 0.0352}
sides |= {"DE": 0.0341, "EF": 0.0577, "EG": 0.1117, "FG": 0.0590}
gaps = [joints[b].pos_from(joints[a]).magnitude() - length for (a, b), length in sides.items()]
qdots = {coordinate.diff(t): speed for coordinate, speed in zip(q, u, strict=True)}

masses = [me.Particle(f"at {name}", joints[name], m) for name in "CEFGH"]
loads = [(joints[name], -m * g * N.y) for name in "CEFGH"] + [(crank, T * N.z)]
kane = me.KanesMethod(
    N,
    q_ind=q[:1],
    u_ind=u[:1],
    kd_eqs=[speed - qdot for qdot, speed in qdots.items()],
    q_dependent=q[1:],
    u_dependent=u[1:],
    configuration_constraints=gaps,
    velocity_constraints=[gap.diff(t).subs(qdots) for gap in gaps],
)
kane.kanes_equations(
    [*masses, me.RigidBody("crank", A, crank, m, (me.inertia(crank, 0, 0, 0), A))], loads
)

# %%
# The triangles C-F-H and E-F-G are rigid links.  A motor holds the crank near 6 rad/s.

model = mechc.compile(
    kane,
    defaults={"r": 0.0175, "m": 0.02, "g": 9.81},
    inputs={T: 0.01 * (6 - omega)},
    drawing=mechc.Drawing(
        links=(
            ("coupler", ("C", "H", "F")),
            ("leg", ("E", "F", "G", "E")),
            ("lower rocker", ("B", "H")),
            ("upper rocker", ("D", "E")),
        ),
        ground=("A", "B", "D"),
        traced=("G",),
    ),
    outputs=("energy", "points"),
)
guess = {"x_H": -0.021, "y_H": 0.003, "x_F": -0.056, "y_F": -0.003}
guess |= {"x_E": -0.046, "y_E": 0.054, "x_G": -0.032, "y_G": -0.056}
y0 = model.assemble({"theta": 0.0}, speeds={"omega": 6.0}, guess=guess)
sol = model.simulate(3.0, y0)

# %%
# For more than a third of each turn the foot stays within 4 mm of the ground, on a stride of 7 cm.

path = model.points(sol(np.linspace(1.0, 1.0 + 2 * np.pi / 6, 500)))[
    :, model.point_names.index("G")
]
on_ground = path[:, 1] < path[:, 1].min() + 0.004
stride = np.ptp(path[on_ground, 0])
print(f"{on_ground.mean():.0%} of the time, over {stride * 100:.1f} cm")
assert on_ground.mean() > 1 / 3
assert 0.065 < stride < 0.075

# %%
sol.animate()
