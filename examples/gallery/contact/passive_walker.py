"""
A walker without motors
=======================

Two legs and a hip walk down a slope, driven by gravity alone (A. Goswami, B. Thuilot and
B. Espiau, INRIA report 2996, 1996).  At each step the swing leg strikes the ground and becomes the
stance leg, and the other swings.  The gait is a cycle: it is found by shooting, and followed
through slopes.
"""

import numpy as np
import sympy as sm
import sympy.physics.mechanics as me

import mechc

stance, swing, w_stance, w_swing = me.dynamicsymbols("stance swing w_stance w_swing")
m, m_hip, a, b, g, slope = sm.symbols("m m_hip a b g slope")
t = me.dynamicsymbols._t
N, foot = me.ReferenceFrame("N"), me.Point("foot")
foot.set_vel(N, 0)
legs = [N.orientnew(name, "Axis", (angle, N.z)) for name, angle in (("S", stance), ("W", swing))]
for leg, rate in zip(legs, (w_stance, w_swing), strict=True):
    leg.set_ang_vel(N, rate * N.z)
hip = foot.locatenew("hip", (a + b) * legs[0].y)
masses = [
    foot.locatenew("stance_mass", a * legs[0].y),
    hip.locatenew("swing_mass", -b * legs[1].y),
    hip,
]
tip = hip.locatenew("tip", -(a + b) * legs[1].y)
for point, base, leg in (
    (masses[0], foot, 0), (hip, foot, 0), (masses[1], hip, 1), (tip, hip, 1),
):  # fmt: skip
    point.v2pt_theory(base, N, legs[leg])
bodies = [
    me.Particle(point.name, point, mass) for point, mass in zip(masses, (m, m, m_hip), strict=True)
]
rates = [stance.diff(t) - w_stance, swing.diff(t) - w_swing]
kane = me.KanesMethod(N, [stance, swing], [w_stance, w_swing], rates)
kane.kanes_equations(bodies, [(body.point, -body.mass * g * N.y) for body in bodies])

# %%
# The strike conserves the angular momentum of the whole about the new foot, and that of the leg
# that was the stance leg about the hip.  Then the legs change their names.

before = {body: body.mass * body.point.vel(N) for body in bodies}
new_stance, new_swing = sm.symbols("new_stance new_swing")
renamed = {w_stance: new_swing, w_swing: new_stance}


def about(point, bodies, momenta):
    """Angular momentum of some bodies about a point."""
    return sum(body.point.pos_from(point).cross(momenta[body]).dot(N.z) for body in bodies)


after = {}
for body in bodies:  # the tip stands, and all turns about it
    place = body.point.pos_from(tip)
    turned = (
        place.express(N).diff(t, N).xreplace({stance.diff(t): new_swing, swing.diff(t): new_stance})
    )
    after[body] = body.mass * turned
balances = [
    about(tip, bodies, before) - about(tip, bodies, after),
    about(hip, bodies[:1], before) - about(hip, bodies[:1], after),
]
matrix, right = sm.linear_eq_to_matrix(balances, [new_stance, new_swing])
known = matrix.LUsolve(right)
strike = mechc.Event(
    stance + swing + 2 * slope, direction=-1,
    reset={
        stance: swing, swing: stance, w_stance: known[0], w_swing: known[1],
    },
)  # fmt: skip

# %%
# The gait on three degrees, from a guess.

model = mechc.compile(
    kane,
    name="compass_gait",
    defaults={"m": 5.0, "m_hip": 10.0, "a": 0.5, "b": 0.5, "g": 9.81},
    parameters={"slope": np.radians(3)},
    units={"stance": "rad", "swing": "rad", "w_stance": "rad/s", "w_swing": "rad/s"},
    drawing=mechc.Drawing(
        links=(("stance", (foot, masses[0], hip)), ("swing", (hip, masses[1], tip))),
        ground=(foot,), view=("x", "y"),
    ),
)  # fmt: skip
start = {"stance": 0.22, "swing": -0.33, "w_stance": -1.1, "w_swing": -0.38}
cycle = model.periodic(start, 0.73, events=[strike])
print(cycle)
assert cycle.stable

# %%
# Followed to steeper slopes, until every second step is another one.

branch = cycle.follow("slope", np.radians([3.0, 5.0]), step=0.2)
print([f"{point.kind} at {np.degrees(point.value):.2f} deg" for point in branch.special])
assert abs(branch.doublings[0].cycle.multipliers + 1).min() < 1e-6

# %%
sol = model.simulate(4 * cycle.period, cycle.y0, events=[strike])
sol.animate()
