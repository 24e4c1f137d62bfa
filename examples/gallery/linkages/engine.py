"""
An engine of three cylinders
============================

One crankshaft with three throws 120° apart, three connecting rods, three pistons.  Each piston's
pin is a cut that closes a loop.  The shaft coasts: the torques of the three leave a small ripple.
"""

import numpy as np
import sympy as sm
from sympy.physics.mechanics import PinJoint, PrismaticJoint, RigidBody, inertia

import mechc

r, l, pitch, m_rod, m_piston, J, g = sm.symbols("r l pitch m_rod m_piston J g")


def body(name, mass, i_x, i_y, i_z):
    made = RigidBody(name, mass=mass)
    made.central_inertia = inertia(made.frame, i_x, i_y, i_z)
    return made


block, shaft = RigidBody("block"), body("shaft", 5, J / 2, J / 2, J)
solids = []
joints = [PinJoint("main", block, shaft, joint_axis=block.z)]
for k in range(3):
    rod = body(f"rod {k}", m_rod, m_rod * l**2 / 12, 0, m_rod * l**2 / 12)
    piston = body(f"piston {k}", m_piston, *3 * [m_piston * r**2 / 4])
    angle = 2 * sm.pi * k / 3
    along = (k - 1) * pitch
    crank_pin = r * (sm.cos(angle) * shaft.x + sm.sin(angle) * shaft.y) + along * shaft.z
    joints += [
        PinJoint(
            f"big_end_{k}",
            shaft,
            rod,
            parent_point=crank_pin,
            child_point=-l / 2 * rod.y,
            joint_axis=shaft.z,
        ),
        PrismaticJoint(
            f"bore_{k}", block, piston, parent_point=along * block.z, joint_axis=block.y
        ),
        mechc.Cut.pin(
            f"small_end_{k}", rod, piston, parent_point=l / 2 * rod.y, joint_axis=rod.z
        ),
    ]  # fmt: skip
    solids.append(
        mechc.Solid.cylinder(piston.name, piston.masscenter, piston.frame, 0.03, 0.05, axis="y")
    )

engine = mechc.from_joints(
    "engine",
    joints,
    gravity=-g * block.y,
    parameters={
        "r": 0.04, "l": 0.14, "pitch": 0.09, "m_rod": 0.4, "m_piston": 0.35, "J": 8e-3, "g": 9.81,
    },
    drawing=mechc.Drawing(solids=tuple(solids)),
)  # fmt: skip
model = mechc.compile(engine)

# %%
# The guess puts the pistons above the shaft; below it the loops would close too.

upright = {f"q_bore_{k}": 0.14 for k in range(3)}
start = model.assemble({"q_main": 0.3}, speeds={"u_main": 60.0}, guess=upright)
sol = model.simulate(0.6, start)
print(f"the shaft turns with {sol['u_main'].min():.2f} to {sol['u_main'].max():.2f} rad/s")
assert sol.closure.max() < 1e-12
assert sol.energy_drift < 1e-8
assert np.ptp(sol["u_main"]) < 0.05 * 60

# %%
sol.view()
