"""The potential energy of a mechanism whose loads are given as forces, as far as it is known.

A force that is constant in the inertial frame has V = -F . r.  For all other loads that depend on
the configuration, springs for instance, V is sought with dV = -(F . dr + T . dphi) of all of them
together.  Where none is found it is not known whether there is one, unless the bodies have a
``potential_energy``: it is then that of all loads.  Loads that depend only on speeds, time or
inputs have none.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from sympy import Add, Dummy, Expr, ImmutableDenseMatrix, S, sympify
from sympy.core.function import AppliedUndef
from sympy.physics.mechanics import Particle, Point, ReferenceFrame, RigidBody, dynamicsymbols
from sympy.physics.vector import Vector

from mechc_codegen.convert.antiderivative import antiderivative
from mechc_codegen.convert.stationary import Stationary
from mechc_codegen.description.source import Source
from mechc_codegen.description.terms import vector_along


@dataclass(frozen=True)
class Potential:
    """``value``: potential of the loads that have one; ``unknown``: loads where it is not known."""

    value: Expr
    unknown: tuple[str, ...] = ()


def gravity_apart(
    source: Source, bodies: Sequence[RigidBody | Particle]
) -> tuple[Vector | None, Source]:
    """Uniform gravity in place of the weights of all moving bodies, if there are joints.

    Its cost does not grow with the length of a chain.  None where the weights are not all equal, or
    bodies have a potential energy.
    """
    weights = [load for load in source.loads if load[0] in {b.masscenter for b in bodies}]
    places = [place for place, _ in weights]
    if not (source.joints and bodies) or any(b.potential_energy != 0 for b in bodies):
        return None, source
    if len(places) != len(bodies) or set(places) != {b.masscenter for b in bodies}:
        return None, source
    mass = {b.masscenter: b.mass for b in bodies}
    found = {tuple(c / mass[p] for c in w.to_matrix(source.frame)) for p, w in weights}
    (components, *different) = found
    if different or any(c.has(AppliedUndef, dynamicsymbols._t) for c in components):
        return None, source
    others = tuple(load for load in source.loads if load not in weights)
    return vector_along(components, source.frame), replace(source, loads=others)


def potential_of(
    source: Source,
    bodies: Sequence[RigidBody | Particle],
    origin: Point | None,
    stationary: Stationary,
    rates: Sequence[Expr],
) -> Potential:
    """The potential energy, as far as it can be known; ``rates``: q' of each coordinate."""
    said = sum((sympify(b.potential_energy) for b in bodies), S.Zero)
    if said != 0:
        return Potential(said)
    total, others = S.Zero, []
    for place, vector in source.loads:
        value = _of_load(source, place, vector, origin, stationary)
        if value is None:
            others.append((place, vector))
        else:
            total += value
    elastic = _of_loads(source, others, origin, rates) if others else S.Zero
    if elastic is None:
        return Potential(total, tuple(f"the load on {place.name}" for place, _ in others))
    return Potential(total + elastic)


def _of_load(
    source: Source,
    place: Point | ReferenceFrame,
    vector: Vector,
    origin: Point | None,
    stationary: Stationary,
) -> Expr | None:
    """Potential energy of one load: 0 where it has none, None where it is not known."""
    at_rest = [_at_rest(source, c) for c in vector.to_matrix(source.frame)]
    if all(c == 0 for c in at_rest) or stationary.place(place):
        return S.Zero
    if any(c is S.NaN or c.has(*source.q) for c in at_rest):
        return None
    if any(c.has(dynamicsymbols._t) for c in at_rest):
        return S.Zero
    if isinstance(place, ReferenceFrame):
        return None
    arm = _arm(place, origin)
    return None if arm is None else -vector_along(at_rest, source.frame).dot(arm)


def _of_loads(
    source: Source,
    loads: Sequence[tuple[Point | ReferenceFrame, Vector]],
    origin: Point | None,
    rates: Sequence[Expr],
) -> Expr | None:
    """The potential energy of loads that depend on the configuration; None where none is found."""
    slopes = [S.Zero] * len(source.q)
    for place, vector in loads:
        components = [_at_rest(source, c) for c in vector.to_matrix(source.frame)]
        moved = _displacements(source, place, origin, rates)
        if moved is None or any(_of_time(source, c) for c in (*components, *moved)):
            return None
        for j in range(len(source.q)):
            slopes[j] -= sum((f * d for f, d in zip(components, moved.col(j), strict=True)), S.Zero)
    return antiderivative(slopes, source.q)


def _of_time(source: Source, value: Expr) -> bool:
    """Whether an expression depends, or may depend, on time other than through the coordinates."""
    plain = value.xreplace({q: Dummy() for q in source.q})
    return value is S.NaN or bool(plain.has(dynamicsymbols._t))


def _displacements(
    source: Source, place: Point | ReferenceFrame, origin: Point | None, rates: Sequence[Expr]
) -> ImmutableDenseMatrix | None:
    """Displacement of a point, or rotation of a frame, by each coordinate (3, nq)."""
    if isinstance(place, ReferenceFrame):
        if tuple(rates) != tuple(source.u):
            return None
        turning = dict(zip((q.diff(dynamicsymbols._t) for q in source.q), source.u, strict=True))
        turned = place.ang_vel_in(source.frame).to_matrix(source.frame).xreplace(turning)
        return ImmutableDenseMatrix(turned.jacobian(list(source.u)))
    arm = _arm(place, origin)
    if arm is None:
        return None
    return ImmutableDenseMatrix(arm.to_matrix(source.frame).jacobian(list(source.q)))


def _arm(place: Point, origin: Point | None) -> Vector | None:
    try:
        return place.pos_from(origin) if origin is not None else None
    except ValueError:  # positions unknown
        return None


def _at_rest(source: Source, component: Expr) -> Expr:
    """The load at zero speeds and zero inputs; NaN where that is not known."""
    time = dynamicsymbols._t
    moving = [*source.u, *(q.diff(time) for q in source.q)]
    other = component.atoms(AppliedUndef) - {*source.q, *source.u}
    still = dict.fromkeys((*moving, *other), S.Zero)
    return sum((_term_at_rest(term, moving, still) for term in Add.make_args(component)), S.Zero)


def _term_at_rest(term: Expr, moving: Sequence[Expr], still: Mapping[Expr, Expr]) -> Expr:
    """A term at rest: where it is 0/0, zero if it is odd in the speeds, otherwise NaN."""
    value = term.xreplace(dict(still))
    if not value.has(S.NaN, S.ComplexInfinity, S.Infinity, S.NegativeInfinity):
        return value
    odd = term.xreplace({u: -u for u in moving}) == -term
    return S.Zero if odd else S.NaN
