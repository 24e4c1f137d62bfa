"""Loads with accelerations: their part linear in accelerations joins the mass matrix.

A force -m_a dv/dt on a point, as that of the water which a hull moves, has no place in F: the
speeds' rates are what is solved for.  Its generalized forces are those of its part without
accelerations, less A u' with A_rs = -v_r . df/du_s', which M takes up where A is symmetric.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from sympy import Expr, S
from sympy.physics.mechanics import Point, ReferenceFrame, dynamicsymbols
from sympy.physics.vector import Vector

from mechc_codegen.convert.algebra import evaluator, random_point
from mechc_codegen.convert.classify_constraints import Rates
from mechc_codegen.description.mechanism import AddedInertia
from mechc_codegen.description.source import Source
from mechc_codegen.description.terms import Load, velocity_of
from mechc_codegen.errors import MechanismError

_SAME = 1e-9


def split_accelerations(
    source: Source, rates: Rates
) -> tuple[Source, tuple[AddedInertia, ...], tuple[str, ...]]:
    """The source with loads free of accelerations, their inertia, and a name of each such load.

    Raises
    ------
    MechanismError
        For loads that are not linear in accelerations, act between joints, or whose inertia is
        not symmetric: these are not those of a body.
    """
    time = dynamicsymbols._t
    accelerations = [u.diff(time) for u in source.u]
    auxiliary = {u.diff(time): S.Zero for u in source.auxiliary}
    first = rates.moving
    second = {q.diff(time): rate.diff(time).xreplace(first) for q, rate in first.items()}
    loads: list[Load] = []
    added: list[AddedInertia] = []
    for place, vector in source.loads:
        plain = vector.xreplace(second).xreplace(auxiliary)
        if not any(matrix.has(*accelerations) for matrix, _ in plain.args):
            loads.append((place, vector))
            continue
        if source.joints:
            _refuse(place, "acts on bodies with joints")
        free, parts = _linear(place, plain, accelerations)
        loads.append((place, free))
        added.append(AddedInertia(place, tuple(parts)))
    if not added:
        return source, (), ()
    _refuse_asymmetric(source, rates, added)
    names = tuple(f"the load on {each.place.name}, which holds accelerations" for each in added)
    return replace(source, loads=tuple(loads)), tuple(added), names


def _linear(
    place: Point | ReferenceFrame, vector: Vector, accelerations: Sequence[Expr]
) -> tuple[Vector, list[Vector]]:
    """The part free of accelerations, and the coefficient of each."""
    still = dict.fromkeys(accelerations, S.Zero)
    for matrix, _ in vector.args:
        for entry in matrix:
            if any(entry.diff(a).has(*accelerations) for a in accelerations):
                _refuse(place, "is not linear in them")
    free = vector.xreplace(still)
    return free, [vector.xreplace(still | {a: S.One}) - free for a in accelerations]


def _refuse_asymmetric(source: Source, rates: Rates, added: Sequence[AddedInertia]) -> None:
    size = len(source.u)
    matrix = [[S.Zero] * size for _ in range(size)]
    for each in added:
        velocity = velocity_of(each.place, source.frame).xreplace(rates.moving)
        for r, u in enumerate(source.u):
            partial = velocity.diff(u, source.frame, var_in_dcm=False)
            for s, part in enumerate(each.per_acceleration):
                matrix[r][s] += partial.dot(part)
    gaps = [matrix[r][s] - matrix[s][r] for r in range(size) for s in range(r)]
    plain = [rates.in_symbols(gap.xreplace(rates.moving)) for gap in gaps if gap != 0]
    symbols = [*rates.symbols, *rates.u]
    point = random_point(None, len(symbols), seed=6) or []
    if any(abs(gap) > _SAME for gap in evaluator(symbols, plain)(*point)):
        _refuse(added[0].place, "makes the mass matrix asymmetric, as no body's inertia does")


def _refuse(place: Point | ReferenceFrame, why: str) -> None:
    raise MechanismError(
        f"the load on {place.name} holds accelerations and {why}: write it as a body of its own "
        "(an added mass or inertia), so that it is part of the mass matrix"
    )
