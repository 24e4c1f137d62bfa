"""Objects of ``sympy.physics.mechanics`` -> Source, whether or not their equations are formed.

Nothing is formed: only what a method is given is read.  The object itself is not changed.
"""

from __future__ import annotations

from collections.abc import Iterable
from copy import copy
from dataclasses import replace
from typing import Any

from sympy import Add, Derivative, Expr, Function
from sympy.core.function import AppliedUndef
from sympy.physics.mechanics import (
    KanesMethod,
    LagrangesMethod,
    Point,
    ReferenceFrame,
    System,
    dynamicsymbols,
)
from sympy.physics.mechanics.loads import Force, Torque

from mechc_codegen.description.drawing import muscles_in
from mechc_codegen.description.joints.tree import joint_of
from mechc_codegen.description.source import Source
from mechc_codegen.description.terms import Load, printed_name
from mechc_codegen.errors import MechanismError

METHODS = {"kane": KanesMethod, "lagrange": LagrangesMethod}


def readable(thing: object) -> bool:
    """Whether there is a reader for an object."""
    return isinstance(_inner_method(thing), (*METHODS.values(), System))


def read(thing: Any, form: str | None = None) -> Source:
    """Read a mechanics object.

    ``form``: the method, ``"kane"`` or ``"lagrange"``, of one whose equations are not formed.

    Raises
    ------
    MechanismError
        If its equations are not formed, and ``form`` is not given; the message says what to do.
    """
    inner = _inner_method(thing)
    _check_form(inner, form)
    if isinstance(inner, KanesMethod):
        joints = getattr(thing, "_joints", ())  # of a JointsMethod
        return replace(_read_kane(inner, form), joints=tuple(map(joint_of, joints)))
    return (
        _read_lagrange(inner, form)
        if isinstance(inner, LagrangesMethod)
        else _read_system(inner, form)
    )


def _inner_method(thing: Any) -> Any:
    """The real object inside a JointsMethod, which SymPy has deprecated."""
    return thing.method if type(thing).__name__ == "JointsMethod" else thing


def _check_form(thing: Any, form: str | None) -> None:
    """Refuse a method that does not exist or does not fit the object.

    Raises
    ------
    MechanismError
        The message names what can be asked for.
    """
    if form is None:
        return
    if not isinstance(form, str) or form not in METHODS:
        raise MechanismError(f"form is 'kane' or 'lagrange', not {form!r}")
    if not isinstance(thing, (System, METHODS[form])):
        raise MechanismError(
            f"form={form!r} is for a System or a {METHODS[form].__name__}, not for a "
            f"{type(thing).__name__}"
        )


# -- KanesMethod ----------------------------------------------------------------------------------


def _read_kane(method: KanesMethod, form: str | None = None) -> Source:
    """Read a KanesMethod, whose equations need not be formed if ``form`` is given.

    Its mass matrix is never read: with dependent speeds it is reduced by a symbolic inverse that is
    0/0 at the dead points of the choice of dependent speeds.  Bodies, loads and constraints are.

    Raises
    ------
    MechanismError
        If ``kanes_equations`` was not called, so that bodies or loads may be missing.
    """
    formed = method._fr is not None and method._frstar is not None
    if not formed and (form is None or not method.bodies):
        raise MechanismError(
            "the equations of this KanesMethod are not formed: call "
            "kanes_equations(bodies, loads) first, which sets the bodies and loads; or make it "
            "with KanesMethod(..., bodies=bodies, forcelist=loads), and compile it with form='kane'"
        )
    return Source(
        kind="KanesMethod",
        frame=method._inertial,
        q=tuple(method.q),
        u=tuple(method.u),
        kinematics=_kinematics(method),
        bodies=tuple(method.bodies),
        loads=plain_loads(method.loads or ()),
        configuration=tuple(method._f_h),
        motion=_affine(method._k_nh, method.u, method._f_nh),
        mixed=True,
        auxiliary=tuple(method._uaux),
    )


def _kinematics(method: Any) -> tuple[Expr, ...]:
    """The implicit form: the explicit one comes from a symbolic inverse and may contain 0/0."""
    rates = [q.diff(dynamicsymbols._t) for q in method.q]
    speeds = _affine(method._k_ku_implicit, method.u, method._f_k_implicit)
    return tuple(
        a + b for a, b in zip(_affine(method._k_kqdot_implicit, rates, ()), speeds, strict=True)
    )


def _affine(matrix: Any, vector: Any, rest: Iterable[Expr]) -> tuple[Expr, ...]:
    """Rows of ``matrix vector + rest``; products with zero are not formed."""
    terms = [[constant] for constant in rest] or [[] for _ in range(matrix.rows)]
    entries = list(vector)
    for (i, k), factor in matrix.todok().items():
        terms[i].append(factor * entries[k])
    return tuple(Add(*row) for row in terms)


# -- LagrangesMethod ------------------------------------------------------------------------------


class _Given(LagrangesMethod):  # type: ignore[misc]  # SymPy has no types
    """A LagrangesMethod as a System makes it, without equations."""

    def _form_eoms(self) -> None:
        pass


def _by_lagrange(system: System) -> LagrangesMethod:
    """The LagrangesMethod of a System, without forming its equations.

    Raises
    ------
    MechanismError
        If speeds of the System are not the derivatives of its coordinates.
    """
    other = [u for u in system.u if not isinstance(u, Derivative)]
    if other:
        raise MechanismError(
            "Lagrange's method needs the derivatives of the coordinates as speeds; this System "
            f"has {', '.join(map(printed_name, other))}: make its joints with the speeds "
            "q.diff(t), or use form='kane'"
        )
    made = copy(system)
    made.form_eoms(_Given)
    return made.eom_method


def _read_lagrange(method: LagrangesMethod, form: str | None = None) -> Source:
    """Read a LagrangesMethod, whose equations need not be formed if ``form`` is given: L as it was
    given, with a separate symbol for every speed.

    The speeds u = q' are functions named after their coordinates: ``q_dot``.  Multipliers keep the
    sign of M u' + J^T lambda = F with J the Jacobian of the constraints as they were given.

    Raises
    ------
    MechanismError
        If ``form_lagranges_equations`` was not called.
    """
    if method.eom is None and form is None:
        raise MechanismError(
            "the equations of this LagrangesMethod are not formed: call "
            "form_lagranges_equations() first, or compile it with form='lagrange'"
        )
    q = tuple(method.q)
    u = tuple(speed_of(coordinate) for coordinate in q)
    holonomic = len(method._hol_coneqs)
    return Source(
        kind="LagrangesMethod",
        frame=method.inertial or ReferenceFrame("N"),
        q=q,
        u=u,
        kinematics=tuple(a.diff(dynamicsymbols._t) - b for a, b in zip(q, u, strict=True)),
        loads=plain_loads(method.loads or ()),
        configuration=tuple(method._hol_coneqs),
        motion=tuple(method.coneqs)[holonomic:],
        lagrangian=method._L[0],
        drawn=tuple(method.bodies or ()),
    )


def speed_of(coordinate: AppliedUndef) -> AppliedUndef:
    """The function of time for a coordinate's rate."""
    return Function(f"{printed_name(coordinate)}_dot")(dynamicsymbols._t)


# -- System ---------------------------------------------------------------------------------------


def _read_system(system: System, form: str | None = None) -> Source:
    """Read a System; ``form``: the method, whether or not it was formed by another.

    A System keeps holonomic and nonholonomic constraints apart and allows redundant ones until its
    equations are formed by Kane's method, so it is read itself, not its method; only the choice
    between Kane and Lagrange, which decides whether potential energies act, is taken from that.

    Raises
    ------
    MechanismError
        If neither is known and a body has a potential energy: Kane's method ignores it, Lagrange's
        makes it a force.
    """
    if form == "lagrange" or (form is None and isinstance(system.eom_method, LagrangesMethod)):
        method = _by_lagrange(system) if form else system.eom_method
        source = _read_lagrange(method, form)
        return replace(source, kind="System", origin=system.fixed_point)
    if form is None and system.eom_method is None:
        for body in system.bodies:
            if body.potential_energy != 0:
                raise MechanismError(
                    f"the body {body.name} has a potential energy, which acts by Lagrange's method "
                    "and does not by Kane's: choose the method with form='kane' or "
                    "form='lagrange', or call form_eoms() or form_eoms(LagrangesMethod) first"
                )
    overridden = system._vel_constrs is not None
    given = system.velocity_constraints if overridden else system.nonholonomic_constraints
    return with_speeds(
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
            muscles=muscles_in(system.actuators),
        )
    )


def with_speeds(source: Source) -> Source:
    """The source with own symbols for speeds that are the coordinates' derivatives themselves."""
    time = dynamicsymbols._t
    if not any(isinstance(u, Derivative) for u in source.u) and source.u:
        return source
    named = tuple(speed_of(q) for q in source.q)
    rates = tuple(q.diff(time) for q in source.q)
    if source.u and source.u != rates:
        raise MechanismError(
            f"the speeds of this {source.kind} are in part derivatives of coordinates: give "
            "symbols for all of them, with kinematic differential equations"
        )
    kinematics = tuple(rate - u for rate, u in zip(rates, named, strict=True))
    symbol = dict(zip(rates, named, strict=True))
    joints = tuple(
        replace(joint, speeds=tuple(symbol.get(u, u) for u in joint.speeds))
        for joint in source.joints
    )
    return replace(source, u=named, kinematics=kinematics, joints=joints)


# -- loads in every form that SymPy takes ---------------------------------------------------------


def plain_loads(loads: Iterable[Any]) -> tuple[Load, ...]:
    """``Force``, ``Torque`` and bare tuples as pairs; actuators give their own loads."""
    pairs: list[Load] = []
    for load in loads:
        if isinstance(load, Force):
            pairs.append((load.point, load.force))
        elif isinstance(load, Torque):
            pairs.append((load.frame, load.torque))
        elif hasattr(load, "to_loads"):
            pairs.extend(plain_loads(load.to_loads()))
        else:
            pairs.append(_pair(load))
    return tuple(pairs)


def _pair(load: Any) -> Load:
    try:
        place, vector = load
    except (TypeError, ValueError):
        raise MechanismError(f"{load!r} is not a load, a pair (Point or frame, vector)") from None
    if not isinstance(place, (Point, ReferenceFrame)):
        named = getattr(place, "name", None) or repr(place)[:60]
        raise MechanismError(
            f"a load acts on a Point or a ReferenceFrame, not on {named}: of a body, use "
            "Force(body, vector) or Torque(body, vector) of sympy.physics.mechanics"
        )
    return place, vector
