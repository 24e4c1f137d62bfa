"""
A crane with a swinging load
============================

A trolley carries a load on a rope.  Driven from one place to another by a push and an equal
brake, the load swings on for long; if both last as long as one period of its swing, it hangs still
at the end (W. Singhose, *Command shaping for flexible systems*, 2009).
"""

import numpy as np
import sympy as sm
import sympy.physics.mechanics as me

import mechc

t = me.dynamicsymbols._t
x, theta, v, omega, F = me.dynamicsymbols("x theta v omega F")
M, m, L, g = sm.symbols("M m L g", positive=True)
N, O = me.ReferenceFrame("N"), me.Point("O")
rope = N.orientnew("rope", "Axis", (theta, N.z))
rope.set_ang_vel(N, omega * N.z)
O.set_vel(N, 0)
trolley = O.locatenew("trolley", x * N.x)
trolley.set_vel(N, v * N.x)
load = trolley.locatenew("load", -L * rope.y)
load.v2pt_theory(trolley, N, rope)
masses = [me.Particle("trolley", trolley, M), me.Particle("load", load, m)]
kane = me.KanesMethod(N, [x, theta], [v, omega], [x.diff(t) - v, theta.diff(t) - omega])
kane.kanes_equations(masses, [(trolley, F * N.x), (load, -m * g * N.y)])

model = mechc.compile(
    kane,
    defaults={"M": 20.0, "m": 2.0, "L": 1.5, "g": 9.81},
    drawing=mechc.Drawing(ground=(O,), traced=("load",)),
    outputs=("energy", "state_jacobian"),
)

# %%
# The period of the swing is that of the linear model at rest.

A, *_ = model.with_inputs({"F": 0.0}).linearize(np.zeros(4))
period = 2 * np.pi / abs(np.linalg.eigvals(A).imag).max()
print(f"period {period:.3f} s")
assert np.isclose(period, 2 * np.pi / np.sqrt((1 + 2 / 20) * 9.81 / 1.5))


# %%
# Pushed for some time and braked for as long, over about two metres:


def moved(seconds):
    force = 22 * 2 / seconds**2
    push = mechc.Signal([0, seconds, 2 * seconds, 20], [force, -force, 0, 0], "previous")
    return model.simulate(10, np.zeros(4), inputs={"F": push})


def last_swing(sol):
    """Peak to peak, in degrees, over the last two seconds."""
    return np.degrees(np.ptp(sol(np.linspace(8, 10, 200))[:, 1]))


for seconds in (0.7 * period, period):
    print(f"{seconds:.2f} s each: swings by {last_swing(moved(seconds)):.2f}° at the end")
assert last_swing(moved(period)) < 0.1 < 5 < last_swing(moved(0.7 * period))

# %%
sol = moved(period)
sol.animate()
