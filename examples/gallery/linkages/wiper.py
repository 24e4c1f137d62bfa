"""
A windscreen wiper
==================

A motor turns a crank at constant speed; a coupler moves the rocker that carries the blade.  How
far does the blade wipe, and what power does the friction on the glass take?
"""

import numpy as np
import sympy as sm
import sympy.physics.mechanics as me

import mechc

r, l, b, d = 0.05, 0.36, 0.067, 0.37  # crank, coupler, lever of the rocker, between pivots, in m
omega, dry, wet = sm.symbols("omega dry wet")
car = me.RigidBody("car")
crank, coupler, blade = (
    me.RigidBody(name, mass=mass)
    for name, mass in (("crank", 0.1), ("coupler", 0.3), ("blade", 0.4))
)
for body, inertia in ((crank, 2e-5), (coupler, 0.3 * l**2 / 12), (blade, 8e-3)):
    body.central_inertia = me.inertia(body.frame, 0, 0, inertia)

# %%
# The blade's mass centre is 0.2 m beyond its pivot, the lever's end at the other side of it.

shaft = me.PinJoint("shaft", car, crank, child_point=-r / 2 * crank.x, joint_axis=car.z)
knuckle = me.PinJoint(
    "knuckle", crank, coupler,
    parent_point=r / 2 * crank.x, child_point=-l / 2 * coupler.x, joint_axis=crank.z,
)  # fmt: skip
pivot = me.PinJoint(
    "pivot", car, blade, parent_point=d * car.x, child_point=-0.2 * blade.x, joint_axis=car.z
)
end = mechc.Cut.pin(
    "end", coupler, blade, l / 2 * coupler.x, -(0.2 + b) * blade.x, joint_axis=coupler.z
)
tip = blade.masscenter.locatenew("tip", 0.3 * blade.x)

# %%
# Friction of the rubber, dry and wet; the sign of the speed is made smooth.

rate = pivot.speeds[0]
friction = dry * sm.tanh(rate / 0.1) + wet * rate
wiper = mechc.from_joints(
    "wiper",
    [shaft, knuckle, pivot, end],
    loads=[me.Torque(blade, -friction * car.z)],
    motors=[mechc.Motor(shaft, speed=omega)],
    parameters={omega: 2 * sm.pi, dry: 2.0, wet: 0.3},
    drawing=mechc.Drawing(links=(("blade", (pivot.child_point, tip)),), traced=(tip,)),
)
model = mechc.compile(wiper, outputs=("energy", {"loss": friction * rate}))
start = model.assemble({"q_shaft": 0.0}, guess={"q_pivot": 1.2, "q_knuckle": 5.0})
sol = model.simulate(2.0, start, events="u_pivot")

# %%
# The blade turns back where crank and coupler are in line: then the lever's end is at the
# distances l + r and l - r from the shaft, and the law of cosines gives its angles.

far, near = np.degrees([np.arccos((b**2 + d**2 - s**2) / (2 * b * d)) for s in (l + r, l - r)])
ends = np.degrees(sol.events[0].y[:, model.coordinates.index("q_pivot")])
print(f"the blade wipes {np.ptp(ends):.3f}°, the dead centres are {far - near:.3f}° apart")
assert abs(np.ptp(ends) - (far - near)) < 1e-6

# %%
# Over a turn the motor does the work that friction takes.

turn = np.linspace(1, 2, 1000, endpoint=False)
given, taken = sol.output("shaft_power", turn), sol.output("loss", turn)
print(f"the motor gives {given.mean():.4f} W, at most {given.max():.1f} W")
assert abs(given.mean() - taken.mean()) < 1e-9 * taken.mean()
sol.animate()
