"""Check that velocities set by the user are the rates of the positions.

M follows from the velocities of mass centres, the potential energy from their positions: where the
two do not agree on the constraints, energy is not kept.  This happens where ``v2pt_theory`` is used
from a point that is not fixed in the body, such as the place at which a disc touches a road.

A velocity of zero is that of a place at rest, or of the point of a wheel that touches the ground
there: one mass centre may be explained by either.  All others move relative to that one as their
positions say.  So do points with loads, unless they move as points of a body.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from math import hypot
from typing import Any

from sympy import Expr
from sympy.physics.mechanics import Particle, Point, ReferenceFrame, RigidBody
from sympy.physics.vector import Vector

from mechc_codegen.convert.checks.angular_velocities import SAME, Rotations, motions, turns_in
from mechc_codegen.convert.classify_constraints import Rates
from mechc_codegen.description.mechanism import is_rigid
from mechc_codegen.description.placement import (
    ZERO,
    Number3,
    cross,
    minus,
    plus,
    reachable,
    steps_from,
    way_to,
)
from mechc_codegen.description.source import Source
from mechc_codegen.errors import MechanismError

_ROUNDING = 1e-13  # of the largest velocity or position, in their differences


def refuse_other_velocities(
    source: Source, bodies: Sequence[RigidBody | Particle], rates: Rates, motion: Sequence[Expr]
) -> None:
    """Compare the velocities set for mass centres and points with loads with their positions.

    Most agree at any motion, which one random motion shows; the others are compared at random
    motions on the constraints.  Points are compared with those that positions join them to, unless
    specified functions of time move them.

    Raises
    ------
    MechanismError
        With the point's name, both velocities and what to do.
    """
    centres = [body.masscenter for body in bodies]
    loaded = [place for place, _ in source.loads if isinstance(place, Point)]
    left = [p for p in dict.fromkeys([*centres, *loaded]) if source.frame in p._vel_dict]
    while left:
        joined = reachable([left[0]])
        points = _Points(source, [p for p in left if p in joined], bodies, _still(source, joined))
        left = [p for p in left if p not in joined]
        anywhere = points.moving(rates, {})
        if anywhere is not None and points.fault([anywhere]) is None:
            continue
        turns = turns_in(source, *points.frames_and_vectors())
        if turns is not None:
            every = motions(source, rates, motion, turns.values())
            found = (points.moving(rates, values) for values in every)
            fault = points.fault([moving for moving in found if moving is not None])
            if fault is not None:
                fault.refuse()


def _still(source: Source, points: Sequence[Point]) -> list[Point]:
    """The points whose velocity was set to zero, or to auxiliary speeds."""
    zero = dict.fromkeys(source.auxiliary, 0)
    given = ((point, point._vel_dict.get(source.frame)) for point in points)
    return [point for point, v in given if v is not None and v.xreplace(zero) == 0]


@dataclass(frozen=True)
class _MotionSample:
    """Numbers of one motion: velocities as set, positions and their rates, angular velocities."""

    said: Mapping[Point, Number3]
    position: Mapping[Point, Number3]
    rate: Mapping[Point, Number3]
    spin: Mapping[ReferenceFrame, Number3]

    @property
    def largest(self) -> float:
        """The largest number in velocities and positions, whose differences have its rounding."""
        every = (self.said, self.position, self.rate)
        return max(abs(x) for of in every for vector in of.values() for x in vector)


@dataclass(frozen=True)
class _Fault:
    """A point whose velocity differs from what its position relative to another point says."""

    point: Point
    other: Point
    said: Number3
    derived: Number3

    def refuse(self) -> None:
        name, other = self.point.name, self.other.name
        raise MechanismError(
            f"the velocity that was set for point {name} is not the rate of its position: relative "
            f"to {other}, in a random motion, the velocity set is {hypot(*self.said):.3g} and the "
            f"position changes at {hypot(*self.derived):.3g}, vectors that are "
            f"{hypot(*minus(self.said, self.derived)):.3g} apart. Where the position is right, "
            f"omit the velocity of {name}, which then follows from it: v2pt_theory holds from a "
            "point that is fixed in the same frame, v1pt_theory from others. Where the velocity is "
            "right, as of a point of a belt, give a position that moves with it: along a "
            "coordinate whose rate is the belt's speed"
        )


class _Points:
    """Points joined by positions: ``claimed``, whose velocities are judged, and those at rest."""

    def __init__(
        self,
        source: Source,
        claimed: Sequence[Point],
        bodies: Sequence[RigidBody | Particle],
        still: Sequence[Point],
    ) -> None:
        self.source, self.claimed, self.still = source, claimed, still
        own = [body for body in bodies if body.masscenter in claimed]
        self.centres = [body.masscenter for body in own]
        self.turning = [(body.masscenter, body.frame) for body in own if is_rigid(body)]
        self.before = steps_from(claimed[0], lambda p: p._pos_dict)

    def frames_and_vectors(self) -> tuple[list[ReferenceFrame], list[Vector]]:
        """The frames that turn bodies, and all vectors of positions and velocities."""
        steps = [s for p in (*self.claimed, *self.still) for s in self._way(p, {})]
        vectors = [step._pos_dict[self.before[step]] for step in dict.fromkeys(steps)]
        vectors += [p._vel_dict[self.source.frame] for p in self.claimed]
        return [frame for _, frame in self.turning], vectors

    def moving(self, rates: Rates, values: Mapping[Expr, float]) -> _MotionSample | None:
        """The numbers of a motion; None where a frame is not oriented, or a root not real."""
        turning = Rotations(self.source, rates, values)
        vector, position, rate = turning.placement.vector, {}, {}
        position[self.claimed[0]] = rate[self.claimed[0]] = ZERO
        try:
            for point in (*self.claimed, *self.still):
                for step in self._way(point, position):
                    before = self.before[step]
                    way = step._pos_dict[before]
                    position[step] = plus(position[before], vector(way))
                    rate[step] = plus(rate[before], turning.rate(way))
            said = {p: vector(p._vel_dict[self.source.frame]) for p in self.claimed}
            spin = {frame: turning.spin(frame) for _, frame in self.turning}
        except (KeyError, ValueError, ZeroDivisionError, OverflowError, TypeError):
            return None
        return _MotionSample(said, position, rate, spin) if turning.placement.is_real else None

    def _way(self, point: Point, known: Mapping[Point, Number3]) -> list[Point]:
        return list(way_to(point, self.before, {self.claimed[0]: ZERO, **known}))

    def fault(self, every: Sequence[_MotionSample]) -> _Fault | None:
        """The first contradiction that all these motions show, None if there is none."""
        if not every or not self.centres:
            return None
        base = next(self._explained(every), None)
        at_rest = [point for point in self.still if point is not self.centres[0]]
        if base is None and at_rest:
            return _Fault(
                self.centres[0], at_rest[0], *_from(every[0], self.centres[0], at_rest[0])
            )
        base = base or self.centres[0]
        for point in self.claimed:
            if not (_hold(every, _relative, point, base) or self._is_carried(every, point)):
                return _Fault(point, base, *_relative(every[0], point, base))
        return None

    def _explained(self, every: Sequence[_MotionSample]) -> Iterator[Point]:
        """Mass centres whose velocity is explained by a place at rest, then by a point of its body
        that is at rest now."""
        for centre, still in product(self.centres, self.still):
            if still is not centre and _hold(every, _from, centre, still):
                yield centre
        for (centre, frame), still in product(self.turning, self.still):
            if still is not centre and _hold(every, _carried, still, centre, frame):
                yield centre

    def _is_carried(self, every: Sequence[_MotionSample], point: Point) -> bool:
        """Whether a point that is no mass centre moves as one of a body, or of the ground, does."""
        if point in self.centres:
            return False
        return _hold(every, _at_rest, point) or any(
            _hold(every, _carried, point, *body) for body in self.turning
        )


Pair = tuple[Number3, Number3]  # a velocity as set, and as derived


def _hold(every: Sequence[_MotionSample], pair: Callable[..., Pair], *of: Any) -> bool:
    """Whether two velocities are one in all motions."""
    for moving in every:
        said, derived = pair(moving, *of)
        allowed = SAME * max(1.0, hypot(*said), hypot(*derived)) + _ROUNDING * moving.largest
        if not hypot(*minus(said, derived)) <= allowed:
            return False
    return True


def _from(moving: _MotionSample, point: Point, still: Point) -> Pair:
    """The velocity of a point, and the rate of its position from a place at rest."""
    return moving.said[point], minus(moving.rate[point], moving.rate[still])


def _relative(moving: _MotionSample, point: Point, base: Point) -> Pair:
    """The velocity of a point relative to another, and the rate of the position between them."""
    said = minus(moving.said[point], moving.said[base])
    return said, minus(moving.rate[point], moving.rate[base])


def _carried(moving: _MotionSample, point: Point, centre: Point, frame: ReferenceFrame) -> Pair:
    """The velocity of a point relative to a mass centre, and that of turning with its body."""
    arm = minus(moving.position[point], moving.position[centre])
    said = moving.said.get(point, ZERO)
    return minus(said, moving.said[centre]), cross(moving.spin[frame], arm)


def _at_rest(moving: _MotionSample, point: Point) -> Pair:
    return moving.said[point], ZERO
