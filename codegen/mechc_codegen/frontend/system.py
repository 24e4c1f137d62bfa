"""System -> Source, whether or not its equations are formed.

A System keeps holonomic and nonholonomic constraints apart and allows redundant ones until its
equations are formed by Kane's method, so it is read itself, not its method; only the choice between
Kane and Lagrange, which decides whether potential energies act, is taken from the method.
"""

from __future__ import annotations

from dataclasses import replace

from sympy import Derivative
from sympy.physics.mechanics import LagrangesMethod, System, dynamicsymbols

from mechc_codegen.description.joints.tree import joint_of
from mechc_codegen.description.source import Source
from mechc_codegen.errors import MechanismError
from mechc_codegen.frontend.form import by_lagrange
from mechc_codegen.frontend.lagrange import read_lagrange, speed_of
from mechc_codegen.frontend.loads import plain_loads


def read_system(system: System, form: str | None = None) -> Source:
    """Read a System; ``form``: the method, whether or not it was formed by another.

    Raises
    ------
    MechanismError
        If neither is known and a body has a potential energy: Kane's method ignores it, Lagrange's
        makes it a force.
    """
    if form == "lagrange" or (form is None and isinstance(system.eom_method, LagrangesMethod)):
        method = by_lagrange(system) if form else system.eom_method
        source = read_lagrange(method, form)
        return replace(source, kind="System", origin=system.fixed_point)
    if form is None and system.eom_method is None:
        _refuse_potentials(system)
    overridden = system._vel_constrs is not None
    given = system.velocity_constraints if overridden else system.nonholonomic_constraints
    return _with_speeds(
        Source(
            kind="System",
            frame=system.frame,
            q=tuple(system.q),
            u=tuple(system.u),
            kinematics=tuple(system.kdes),
            bodies=tuple(system.bodies),
            loads=plain_loads((*system.loads, *system.actuators)),
            configuration=tuple(system.holonomic_constraints),
            motion=tuple(given),
            mixed=overridden,
            auxiliary=tuple(system.u_aux),
            origin=system.fixed_point,
            joints=tuple(joint_of(joint) for joint in system.joints),
        )
    )


def _refuse_potentials(system: System) -> None:
    for body in system.bodies:
        if body.potential_energy != 0:
            raise MechanismError(
                f"the body {body.name} has a potential energy, which acts by Lagrange's method "
                "and does not by Kane's: choose the method with form='kane' or form='lagrange', "
                "or call form_eoms() or form_eoms(LagrangesMethod) first"
            )


def _with_speeds(source: Source) -> Source:
    """The source with own symbols for speeds that are the coordinates' derivatives themselves."""
    time = dynamicsymbols._t
    if not any(isinstance(u, Derivative) for u in source.u) and source.u:
        return source
    named = tuple(speed_of(q) for q in source.q)
    rates = tuple(q.diff(time) for q in source.q)
    if source.u and source.u != rates:
        raise MechanismError(
            "the speeds of this System are in part derivatives of coordinates: give symbols for "
            "all of them, with kinematic differential equations"
        )
    kinematics = tuple(rate - u for rate, u in zip(rates, named, strict=True))
    symbol = dict(zip(rates, named, strict=True))
    joints = tuple(
        replace(joint, speeds=tuple(symbol.get(u, u) for u in joint.speeds))
        for joint in source.joints
    )
    return replace(source, u=named, kinematics=kinematics, joints=joints)
