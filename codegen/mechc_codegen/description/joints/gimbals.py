"""Frames that three angles turn one after the other, and where two of them turn about one axis.

Between the first axis and the last only the middle angle turns.  So the determinant of the three
axes is A cos q + B sin q + C, q the middle angle.  Where it is zero (gimbal lock) some rates of the
angles turn nothing, and the mass matrix over these rates is singular.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import reduce
from math import cos, hypot, pi, sin

from sympy import Expr, ImmutableDenseMatrix
from sympy.core.function import AppliedUndef
from sympy.physics.mechanics import Point, ReferenceFrame

from mechc_codegen.description.derivatives import Derivatives
from mechc_codegen.description.mechanism import Mechanism, is_rigid
from mechc_codegen.description.placement import Placement, cross, dot, steps_from

_ROUNDING = 1e-9  # of products of unit vectors
_SEEDS = (1, 2)

Determinant = tuple[float, float, float]


@dataclass(frozen=True)
class Gimbal:
    """Three angles that turn a frame, the middle one, and A, B, C of their axes' determinant."""

    frame: str
    angles: tuple[Expr, ...]
    middle: Expr
    determinant: Determinant


def gimbals(mechanism: Mechanism) -> Iterator[Gimbal]:
    """The gimbals of bodies, each turned relative to another body or to the inertial frame.

    Angles count whose rates, over the speeds, contain no coordinate: with others, such as angular
    velocities, the mass matrix is not singular there.
    """
    bodies = [body.frame for body in (*mechanism.bodies, *mechanism.drawn) if is_rigid(body)]
    rates = dict(zip(mechanism.q, mechanism.kinematics, strict=True))
    own = {q for q, rate in rates.items() if not rate.atoms(AppliedUndef) & rates.keys()}
    for frame in dict.fromkeys(bodies):
        turn = _turn(mechanism.frame, frame, bodies)
        angles = sorted(turn.atoms(AppliedUndef), key=str) if turn is not None else ()
        if turn is None or len(angles) != 3 or not own.issuperset(angles):
            continue
        by = Derivatives({*angles}).of
        slopes = [turn.applyfunc(lambda e, x=angle, by=by: by(e, x)) for angle in angles]
        for middle in angles:
            found = _determinant(turn, slopes, middle)
            if found is not None:
                yield Gimbal(frame.name, tuple(angles), middle, found)


def _turn(
    inertial: ReferenceFrame, frame: ReferenceFrame, bodies: Sequence[ReferenceFrame]
) -> ImmutableDenseMatrix | None:
    """The rotation from the body before this one on the way from the inertial frame."""
    before, steps = steps_from(inertial, lambda f: f._dcm_dict), list[ImmutableDenseMatrix]()
    at = frame
    while at is not inertial and (at is frame or at not in bodies):
        if at not in before:
            return None
        steps.append(at._dcm_dict[before[at]].T)
        at = before[at]
    return reduce(lambda turn, step: step * turn, steps) if steps else None


def _determinant(
    turn: ImmutableDenseMatrix, slopes: Sequence[ImmutableDenseMatrix], middle: Expr
) -> Determinant | None:
    """A, B and C of the axes' determinant, if it is such a function of this angle alone."""
    found = list[Determinant]()
    for seed in _SEEDS:
        zero, quarter, half, other = (
            _triple_product(turn, slopes, seed, {middle: at}) for at in (0.0, pi / 2, pi, 1.0)
        )
        c = (zero + half) / 2
        found.append(((zero - half) / 2, quarter - c, c))
        a, b, _ = found[-1]
        if abs(a * cos(1.0) + b * sin(1.0) + c - other) > _ROUNDING or hypot(a, b) < _ROUNDING:
            return None
    apart = max(abs(one - other) for one, other in zip(*found, strict=True))
    return found[0] if apart <= _ROUNDING else None


def _triple_product(
    turn: ImmutableDenseMatrix, slopes: Sequence[ImmutableDenseMatrix], seed: int,
    values: Mapping[Expr, float],
) -> float:  # fmt: skip
    """The determinant of the axes about which the angles turn, at random values of the others."""
    placement = Placement(ReferenceFrame("N"), Point("O"), seed)
    for symbol, value in values.items():
        placement.assume(symbol, value)
    for symbol in sorted(turn.free_symbols | turn.atoms(AppliedUndef), key=str):
        placement.value(symbol)  # in one order, whatever is asked first
    rows = [[placement.value(e) for e in row] for row in turn.tolist()]
    axes = []
    for slope in slopes:
        rate = [[placement.value(e) for e in row] for row in slope.tolist()]
        axes.append([dot(rate[i - 1], rows[i - 2]) for i in range(3)])
    return float(dot(axes[0], cross(axes[1], axes[2])))
