"""
A rattleback
============

A boat-shaped stone that prefers one direction of spin: spun the other way it begins to rattle,
stops and turns back (T. R. Kane and D. A. Levinson, *Realistic mathematical modeling of the
rattleback*, 1982).  The ellipsoid rolls on the table without slipping.
"""

import sympy as sm
import sympy.physics.mechanics as me

import mechc

alpha, beta, gamma = me.dynamicsymbols("alpha beta gamma")
w1, w2, w3 = me.dynamicsymbols("omega_1:4")
a, b, c, h, M, g, s = sm.symbols("a b c h M g sigma")
A, B, C, D = sm.symbols("A B C D")
N = me.ReferenceFrame("N")
Y = N.orientnew("Y", "Axis", (gamma, N.z))
L = Y.orientnew("L", "Axis", (alpha, Y.x))
R = L.orientnew("R", "Axis", (beta, L.y))
from_angles = R.ang_vel_in(N)
R.set_ang_vel(N, w1 * R.x + w2 * R.y + w3 * R.z)

# %%
# The table's normal, seen from the stone, says which point of the ellipsoid touches the table.

mu = [N.z.dot(axis) for axis in R]
size = sm.sqrt((a * mu[0]) ** 2 + (b * mu[1]) ** 2 + (c * mu[2]) ** 2)
contact, middle, centre = me.Point("contact"), me.Point("middle"), me.Point("centre")
arm = sum((k**2 * m / size * e for k, m, e in zip((a, b, c), mu, R, strict=True)), 0 * R.x)
middle.set_pos(contact, arm)
centre.set_pos(middle, -h * R.z)
contact.set_vel(N, 0)
middle.v2pt_theory(contact, N, R)
centre.v2pt_theory(middle, N, R)


def around(k):
    """From the middle to the edge."""
    return a * sm.cos(k * sm.pi / 12) * R.x + b * sm.sin(k * sm.pi / 12) * R.y


outline = [middle.locatenew(".edge 0", around(0))]
for k in range(1, 24):
    outline.append(outline[-1].locatenew(f".edge {k}", around(k) - around(k - 1)))

stone = me.RigidBody("stone", centre, R, M, (me.inertia(R, A, B, C, D), centre))
kinematics = [(from_angles - R.ang_vel_in(N)).dot(axis) for axis in R]
kane = me.KanesMethod(N, [alpha, beta, gamma], [w1, w2, w3], kinematics)
kane.kanes_equations([stone], [(centre, -M * g * N.z), (R, -s * R.ang_vel_in(N))])

model = mechc.compile(
    kane,
    defaults={
        "a": 0.2, "b": 0.03, "c": 0.02, "h": 0.01, "M": 1.0, "g": 9.81, "sigma": 0.0,
        "A": 2e-4, "B": 1.6e-3, "C": 1.7e-3, "D": -2e-5,
    },
    drawing=mechc.Drawing(
        links=(("outline", (*outline, outline[0])), ("axis", (outline[0], outline[12]))),
        ground=(contact,),
        traced=(),
        view=("x", "y"),
    ),
)  # fmt: skip
sol = model.simulate(4, {"alpha": 0.0087, "beta": 0.0087, "omega_3": -5.0})

# %%
# The spin changes its sign without any moment about the vertical but the contact's.

spin = sol["omega_3"]
print(f"spin: {spin[0]:.2f} rad/s at the start, {spin.min():.2f} to {spin.max():.2f} rad/s later")
assert spin[0] < 0 < spin.max()
assert sol.energy_drift < 1e-7

# %%
sol.view()
