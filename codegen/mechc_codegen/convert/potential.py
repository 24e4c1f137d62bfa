"""The potential energy of a mechanism whose loads come as forces, where it can be known.

A force that is constant in the inertial frame has V = -F . r.  Of any other load that depends on
the configuration it is not known whether it has a potential, unless the bodies say: then theirs
is taken for all.  Loads that depend on speeds, time or inputs alone have none.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from sympy import Expr, S, sympify
from sympy.core.function import AppliedUndef
from sympy.physics.mechanics import Particle, Point, ReferenceFrame, RigidBody, dynamicsymbols
from sympy.physics.vector import Vector

from mechc_codegen.convert.stationary import Stationary
from mechc_codegen.description.source import Source


@dataclass(frozen=True)
class Potential:
    """``value`` of the loads that have one; ``unknown`` names those of which it is not known."""

    value: Expr
    unknown: tuple[str, ...] = ()


def gravity_apart(
    source: Source, bodies: Sequence[RigidBody | Particle]
) -> tuple[Vector | None, Source]:
    """One uniform gravity in place of the weights of all moving bodies, where there are joints.

    So described it costs no more in a long chain than in a short one.  None where the weights are
    not all alike, or the bodies say a potential energy themselves.
    """
    weights = [load for load in source.loads if load[0] in {b.masscenter for b in bodies}]
    places = [place for place, _ in weights]
    if not (source.joints and bodies) or any(b.potential_energy != 0 for b in bodies):
        return None, source
    if len(places) != len(bodies) or set(places) != {b.masscenter for b in bodies}:
        return None, source
    mass = {b.masscenter: b.mass for b in bodies}
    found = {tuple(c / mass[p] for c in w.to_matrix(source.frame)) for p, w in weights}
    (components, *others) = found
    if others or any(c.has(AppliedUndef, dynamicsymbols._t) for c in components):
        return None, source
    axes = (source.frame.x, source.frame.y, source.frame.z)
    gravity = sum((c * axis for c, axis in zip(components, axes, strict=True)), Vector(0))
    return gravity, replace(source, loads=tuple(x for x in source.loads if x not in weights))


def potential_of(
    source: Source,
    bodies: Sequence[RigidBody | Particle],
    origin: Point | None,
    stationary: Stationary,
) -> Potential:
    """The potential energy, as far as it can be known."""
    said = sum((sympify(b.potential_energy) for b in bodies), S.Zero)
    if said != 0:
        return Potential(said)
    total, unknown = S.Zero, []
    for place, vector in source.loads:
        value = _of_load(source, place, vector, origin, stationary)
        if value is None:
            unknown.append(f"the load on {place.name}")
        else:
            total += value
    return Potential(total, tuple(unknown))


def _of_load(
    source: Source,
    place: Point | ReferenceFrame,
    vector: Vector,
    origin: Point | None,
    stationary: Stationary,
) -> Expr | None:
    """V of one load, 0 where it has none, None where it is not known."""
    at_rest = [_at_rest(source, c) for c in vector.to_matrix(source.frame)]
    if all(c == 0 for c in at_rest) or stationary.place(place):
        return S.Zero
    if any(c.has(*source.q) for c in at_rest):
        return None
    if any(c.has(dynamicsymbols._t) for c in at_rest):
        return S.Zero
    return (
        None
        if isinstance(place, ReferenceFrame)
        else _constant_force(source, place, at_rest, origin)
    )


def _at_rest(source: Source, component: Expr) -> Expr:
    """What of a load is left when nothing moves and no input acts."""
    time = dynamicsymbols._t
    still = {q.diff(time): S.Zero for q in source.q} | dict.fromkeys(source.u, S.Zero)
    other = component.atoms(AppliedUndef) - {*source.q, *source.u}
    return component.xreplace(still).xreplace(dict.fromkeys(other, S.Zero))


def _constant_force(
    source: Source, place: Point, components: Sequence[Expr], origin: Point | None
) -> Expr | None:
    try:
        arm = place.pos_from(origin) if origin is not None else None
    except ValueError:  # positions unknown
        return None
    axes = (source.frame.x, source.frame.y, source.frame.z)
    force = sum((c * axis for c, axis in zip(components, axes, strict=True)), Vector(0))
    return None if arm is None else -force.dot(arm)
