"""The smallest mechanism there is, quick to compile, with names and numbers of one's choice."""

from mechc_codegen.description.mechanism import Coordinate, Mechanism, Parameter, Quantity, Speed
from sympy import Function, Symbol
from sympy.physics.mechanics import Particle, Point, ReferenceFrame, dynamicsymbols


def pendulum(gravity=9.81, name="pendulum", angle="q", speed="u", mass="m", length="l"):
    """A point mass on a massless rod; ``gravity`` is folded into the code."""
    t = dynamicsymbols._t
    q, u = Function(angle)(t), Function(speed)(t)  # dynamicsymbols would split some names
    m, l = Symbol(mass), Symbol(length)
    r = ReferenceFrame("r")
    e = r.orientnew("e", "Axis", (q, r.z))
    e.set_ang_vel(r, u * r.z)
    origin = Point("O")
    origin.set_vel(r, 0)
    tip = origin.locatenew("P", l * e.x)
    tip.v2pt_theory(origin, r, e)
    bob = Particle("bob", tip, m)
    bob.potential_energy = m * gravity * tip.pos_from(origin).dot(r.y)
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
        loads=((tip, -m * gravity * r.y),),
        points=(origin, tip),
    )
