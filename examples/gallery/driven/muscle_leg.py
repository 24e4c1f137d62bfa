"""
A leg that kicks
================

Thigh and shank are moved by four muscles of ``sympy.physics.biomechanics``, with the curves of
F. De Groote et al. (2016).  The hamstrings pass over both joints, the vasti over the kneecap.  The
muscles first draw the leg back, then kick.
"""

import numpy as np
import sympy.physics.mechanics as me
from scipy.integrate import simpson
from sympy import Float
from sympy.physics.biomechanics import FirstOrderActivationDeGroote2016, MusculotendonDeGroote2016

import mechc

pelvis = me.RigidBody("pelvis")
thigh, shank = me.RigidBody("thigh", mass=8.0), me.RigidBody("shank", mass=4.2)
thigh.central_inertia = me.inertia(thigh.frame, 0, 0, 0.13)
shank.central_inertia = me.inertia(shank.frame, 0, 0, 0.09)
hip = me.PinJoint("hip", pelvis, thigh, child_point=0.18 * thigh.y, joint_axis=pelvis.z)
knee = me.PinJoint(
    "knee", thigh, shank,
    parent_point=-0.24 * thigh.y, child_point=0.25 * shank.y, joint_axis=thigh.z,
)  # fmt: skip
ankle = shank.masscenter.locatenew("ankle", -0.17 * shank.y)
toe = ankle.locatenew("toe", 0.15 * shank.x - 0.05 * shank.y)

# %%
# Muscles run through points of the bodies, given in m from hip or knee, x forward, y up.  Their
# strength is in N, and lengths of fibres and of tendons are in m.

ORIGINS = {pelvis: hip.parent_point, thigh: hip.child_point, shank: knee.child_point}
KNEECAP = (thigh, 0.055, -0.435)
MUSCLES = {
    "iliopsoas": (2000, 0.11, 0.05, [(pelvis, 0.05, 0.06), (thigh, 0.02, -0.09)]),
    "gluteus": (2500, 0.14, 0.03, [(pelvis, -0.09, 0.03), (thigh, -0.03, -0.12)]),
    "hamstrings": (2500, 0.11, 0.32, [(pelvis, -0.06, -0.05), (shank, -0.035, -0.06)]),
    "vasti": (5000, 0.10, 0.24, [(thigh, 0.04, -0.16), KNEECAP, (shank, 0.045, -0.06)]),
}
muscles = []
for name, (strength, fibre, tendon, places) in MUSCLES.items():
    points = [
        ORIGINS[body].locatenew(f"{name} {k}", x * body.x + y * body.y)
        for k, (body, x, y) in enumerate(places)
    ]
    muscles.append(
        MusculotendonDeGroote2016.with_defaults(
            name,
            me.ObstacleSetPathway(*points) if len(points) > 2 else me.LinearPathway(*points),
            FirstOrderActivationDeGroote2016.with_defaults(name),
            peak_isometric_force=strength,
            optimal_fiber_length=Float(fibre),
            tendon_slack_length=Float(tendon),
        )
    )
leg = mechc.from_joints(
    "leg",
    [hip, knee],
    gravity=-9.81 * pelvis.y,
    loads=muscles,
    states=muscles,
    points=(toe,),
    drawing=mechc.Drawing(links=(("foot", (shank.masscenter, ankle, toe)),), traced=(toe,)),
)
powers = {f"power_{m.name}": m.force * m.pathway.extension_velocity for m in muscles}
model = mechc.compile(leg, outputs=("energy", "points", powers))

# %%
# Excitations between 0 and 1 are inputs, activations follow them as states of their own.  The run
# ends where the knee is nearly straight again.


def excited(level, begin, end):
    return mechc.Signal([-1, begin, end, 9], [0.01, level, 0.01, 0.01], "previous")


inputs = {
    "e_hamstrings": excited(0.6, 0.0, 0.2),
    "e_gluteus": excited(0.1, 0.0, 0.2),
    "e_iliopsoas": excited(1.0, 0.15, 1.0),
    "e_vasti": excited(1.0, 0.4, 1.0),
}
straight = mechc.Event("q_knee > -0.1", terminal=True)
sol = model.simulate(1.0, {"q_knee": -0.2}, inputs=inputs, events=straight)
speed = sol.output("point_velocities[toe,x]")[-1]
print(f"the toe moves with {speed:.1f} m/s after {sol.t[-1]:.3f} s")

# %%
# The work of the muscles is what kinetic and potential energy have grown by.

times = np.linspace(0, sol.t[-1], 20001)
works = {m.name: simpson(sol.output(f"power_{m.name}", times), x=times) for m in muscles}
print(", ".join(f"{name} {work:.1f} J" for name, work in works.items()))
gained = sol.energy[-1] - sol.energy[0]
assert abs(sum(works.values()) - gained) < 1e-6 * gained
sol.animate(fps=240)
