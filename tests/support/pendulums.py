"""The smallest mechanisms there are, quick to compile; among them some whose cycles are known."""

from functools import cache
from math import pi

from mechc_codegen.description.mechanism import Coordinate, Mechanism, Parameter, Quantity, Speed
from sympy import Function, Symbol, cos, sin, symbols
from sympy.physics.mechanics import KanesMethod, Particle, Point, ReferenceFrame, dynamicsymbols

import mechc
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


def bob_of_a_moved_pivot():
    """A bob in Cartesian coordinates at a distance l from a pivot that moves as r."""
    x, y, u, v, r = dynamicsymbols("x y u v r")
    m, l = Symbol("m"), Symbol("l")
    frame, origin = ReferenceFrame("N"), Point("O")
    origin.set_vel(frame, 0)
    bob = origin.locatenew("P", x * frame.x + y * frame.y)
    bob.set_vel(frame, u * frame.x + v * frame.y)
    gap = (x - r) ** 2 + y**2 - l**2
    rates = {x.diff(t): u, y.diff(t): v}
    method = KanesMethod(
        frame, [x], [u], kd_eqs=[x.diff(t) - u, y.diff(t) - v], q_dependent=[y], u_dependent=[v],
        configuration_constraints=[gap], velocity_constraints=[gap.diff(t).subs(rates)],
    )  # fmt: skip
    method.kanes_equations([Particle("bob", bob, m)], [(bob, -9.81 * m * frame.y)])
    return method, {"lean": (x - r) / l}


def pushed_mass(force=None):
    """A mass m on a spring k, pushed by the input F, by Kane's method; ``force``: of q and u alone,
    in place of both."""
    q, u, push = dynamicsymbols("q u F")
    force = push - Symbol("k") * q if force is None else force
    return particle([q], [u], [force], potential=Symbol("k") * q**2 / 2)


# -- whose cycles are known ------------------------------------------------------------------------


def _of_one_coordinate(name, acceleration, defaults):
    q, u = dynamicsymbols("q u")
    equations = mechc.from_equations(
        [q], [u], None, [acceleration(q, u)], name=name, defaults=defaults
    )
    return mechc.compile(equations)


@cache
def van_der_pol():
    """q'' = mu (1 - q^2) q' - q, driven by A cos(Omega t) where A is given."""
    mu, A, Omega = symbols("mu A Omega")
    defaults = {mu: 1.0, A: 0.0, Omega: 1.0}
    return _of_one_coordinate(
        "van_der_pol", lambda q, u: mu * (1 - q**2) * u - q + A * cos(Omega * t), defaults
    )


@cache
def driven_pendulum():
    """Taylor's (Classical Mechanics, 2005, chapter 12): q'' = -2 beta q' - w0^2 (sin q - gamma
    cos(Omega t)) with w0 = 3 pi, beta = w0/4, Omega = 2 pi, all 1/s; without beta and gamma a
    plain one."""
    gamma, Omega, w0, beta = symbols("gamma Omega w0 beta")
    defaults = {gamma: 1.06, Omega: 2 * pi, w0: 3 * pi, beta: 0.75 * pi}
    return _of_one_coordinate(
        "driven_pendulum",
        lambda q, u: -2 * beta * u - w0**2 * (sin(q) - gamma * cos(Omega * t)), defaults,
    )  # fmt: skip


@cache
def walker():
    """The simplest walker (Garcia, Chatterjee, Ruina and Coleman 1998, J. Biomech. Eng. 120): the
    stance leg's angle theta, phi between the legs, on a slope gamma; and its heel strike."""
    theta, phi, w, v = dynamicsymbols("theta phi w v")
    gamma = symbols("gamma")
    falls = sin(theta - gamma)
    swings = falls + w**2 * sin(phi) - cos(theta - gamma) * sin(phi)
    equations = mechc.from_equations(
        [theta, phi], [w, v], None, [falls, swings], kinematics={theta: w, phi: v}, name="walker",
        defaults={gamma: 0.009},
    )  # fmt: skip
    strike = mechc.Event("phi - 2*theta", direction=1, reset={
        "theta": "-theta", "phi": "-2*theta", "w": "cos(2*theta)*w",
        "v": "cos(2*theta)*(1 - cos(2*theta))*w",
    })  # fmt: skip
    return mechc.compile(equations), strike
