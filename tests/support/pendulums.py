"""The smallest mechanisms there are, quick to compile, with names and numbers of one's choice."""

from mechc_codegen.description.mechanism import Coordinate, Mechanism, Parameter, Quantity, Speed
from sympy import Function, Symbol
from sympy.physics.mechanics import Particle, Point, ReferenceFrame, dynamicsymbols

from benchmarks.problems.particle import particle

t = dynamicsymbols._t


def bob_on_a_rod(q, u, m, l, g):
    """A point mass on a massless rod: the inertial frame, the rod's, the pivot and the bob."""
    r = ReferenceFrame("r")
    e = r.orientnew("e", "Axis", (q, r.z))
    e.set_ang_vel(r, u * r.z)
    origin = Point("O")
    origin.set_vel(r, 0)
    tip = origin.locatenew("P", l * e.x)
    tip.v2pt_theory(origin, r, e)
    bob = Particle("bob", tip, m)
    bob.potential_energy = m * g * tip.pos_from(origin).dot(r.y)
    return r, e, origin, bob


def pendulum(gravity=9.81, name="pendulum", angle="q", speed="u", mass="m", length="l"):
    """A point mass on a massless rod; ``gravity`` is folded into the code."""
    q, u = Function(angle)(t), Function(speed)(t)  # dynamicsymbols would split some names
    m, l = Symbol(mass), Symbol(length)
    r, _, origin, bob = bob_on_a_rod(q, u, m, l, gravity)
    return Mechanism(
        name=name,
        title="A pendulum",
        frame=r,
        origin=origin,
        coordinates=(Coordinate(q, Quantity("rad", "angle from the horizontal")),),
        speeds=(Speed(u, Quantity("rad/s", "angular speed")),),
        kinematics=(u,),
        parameters=(
            Parameter(m, 1.0, Quantity("kg", "mass", 0)),
            Parameter(l, 1.0, Quantity("m", "length", 0)),
        ),
        bodies=(bob,),
        loads=((bob.point, -m * gravity * r.y),),
        points=(origin, bob.point),
    )


def pushed_mass(force=None):
    """A mass m on a spring k, pushed by the input F, by Kane's method; ``force``: of q and u alone,
    in place of both."""
    q, u, push = dynamicsymbols("q u F")
    force = push - Symbol("k") * q if force is None else force
    return particle([q], [u], [force], potential=Symbol("k") * q**2 / 2)
