"""Bodies, points and frames at rest, found by numbers instead of long expressions.

What has a velocity at random values moves; the expression is formed only where it is zero.
"""

from __future__ import annotations

from sympy.physics.mechanics import Particle, Point, ReferenceFrame, RigidBody, dynamicsymbols
from sympy.physics.vector import Vector

from mechc_codegen.description.placement import (
    ZERO,
    Number3,
    Placement,
    cross,
    plus,
    steps_from,
    way_to,
)
from mechc_codegen.description.terms import is_rigid, velocity_of

MOVES = 1e-9  # of values of the order of one


class Stationary:
    """The bodies, points and frames at rest in the inertial frame."""

    def __init__(self, frame: ReferenceFrame) -> None:
        self.frame = frame
        self._placement = Placement(frame, Point("O"), seed=0)
        self._before = steps_from(frame, lambda f: f._ang_vel_dict)
        self._spins: dict[ReferenceFrame, Number3] = {frame: ZERO}
        self._rates: dict[tuple[Point, Point], Number3] = {}

    def body(self, body: RigidBody | Particle) -> bool:
        """Whether a body neither moves nor turns."""
        return self.place(body.masscenter) and (not is_rigid(body) or self.place(body.frame))

    def place(self, place: Point | ReferenceFrame) -> bool:
        """Whether a point does not move, or a frame does not turn."""
        try:
            turning = isinstance(place, ReferenceFrame)
            rate = self._spin(place) if turning else self._velocity(place)
        except KeyError:  # not oriented step by step
            rate = ZERO
        if max(map(abs, rate)) > MOVES:
            return False
        return bool(velocity_of(place, self.frame) == 0)

    def _spin(self, frame: ReferenceFrame) -> Number3:
        for step in way_to(frame, self._before, self._spins):
            before = self._before[step]
            relative = self._placement.vector(step._ang_vel_dict[before])
            self._spins[step] = plus(self._spins[before], relative)
        return self._spins[frame]

    def _velocity(self, point: Point) -> Number3:
        """The velocity as ``velocity_of`` returns it, found step by step."""
        before = steps_from(point, lambda p: p._pos_dict)
        at = next((p for p in (point, *before) if self.frame in p._vel_dict), None)
        if at is None:
            return ZERO
        velocity = self._placement.vector(at._vel_dict[self.frame])
        while at is not point:
            at, start = before[at], at
            if (at, start) not in self._rates:
                self._rates[at, start] = self._rate(at._pos_dict[start])
            velocity = plus(velocity, self._rates[at, start])
        return velocity

    def _rate(self, way: Vector) -> Number3:
        total = ZERO
        for matrix, frame in way.args:
            arm = self._placement.vector(Vector([(matrix, frame)]))
            sliding = self._placement.vector(Vector([(matrix.diff(dynamicsymbols._t), frame)]))
            total = plus(total, sliding, cross(self._spin(frame), arm))
        return total
