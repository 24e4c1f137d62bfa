"""Rows of the cuts that close a tree's loops.

A row is a wrench of unit force on one end of a cut, and the opposite one on the other: a force
along an axis, at a point of each link, for two points that coincide along the axis; a moment a x b
for axes a and b, each fixed on one side, that stay perpendicular.  An axis that turns with one side
acts on both links at the point of the other side.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

from sympy import Expr, S
from sympy.physics.mechanics import ReferenceFrame
from sympy.physics.vector import Vector

from mechc_codegen.derive.tree.frames import FrameMotion, NotATreeError
from mechc_codegen.derive.tree.links import LinkAccelerations, Links, PointMotion
from mechc_codegen.derive.tree.tape import V3, ZERO, Tape
from mechc_codegen.description.constraints import Closure
from mechc_codegen.description.mechanism import Mechanism


@dataclass(frozen=True)
class Accelerations:
    """Those of points, angular ones of frames, and u': all of them, or what is free of u'."""

    of_point: Callable[[PointMotion], V3]
    of_frame: Callable[[FrameMotion, int], V3]
    of_speed: Callable[[int], Expr]


AT_REST = Accelerations(  # u' = 0
    lambda point: point.bias, lambda frame, _: frame.bias, lambda _: S.Zero
)


def solved(moving: LinkAccelerations) -> Accelerations:
    """Those of the motion that is solved."""
    return Accelerations(moving.of_point, lambda _, link: moving.of_frame(link), moving.of_speed)


@dataclass(frozen=True)
class Pair:
    """A force and a moment on one end, and the opposite ones on the other; ``ends``: the links and
    the places at which the force acts."""

    ends: tuple[tuple[int, V3], tuple[int, V3]]
    force: V3
    moment: V3 = ZERO


@dataclass(frozen=True)
class CutRow:
    """Two points that coincide along an axis, which does not turn."""

    label: str
    point: PointMotion
    target: PointMotion
    axis: V3

    @property
    def pairs(self) -> tuple[Pair, ...]:
        """The wrenches of a unit of force along the row."""
        ends = (self.point.link, self.point.position), (self.target.link, self.target.position)
        return (Pair(ends, self.axis),)

    def value(self, tape: Tape) -> Expr:
        """The constraint."""
        return tape.dot(self._gap(tape), self.axis)

    def rate(self, tape: Tape) -> Expr:
        """Its rate."""
        return tape.dot(self._gap_rate(tape), self.axis)

    def rate_at_rest(self, tape: Tape) -> Expr:
        """Its rate where all speeds are zero."""
        return S.Zero

    def second_rate(self, tape: Tape, by: Accelerations) -> Expr:
        """The rate of its rate."""
        gap = tape.difference(by.of_point(self.point), by.of_point(self.target))
        return tape.dot(gap, self.axis)

    def _gap(self, tape: Tape) -> V3:
        return tape.difference(self.point.position, self.target.position)

    def _gap_rate(self, tape: Tape) -> V3:
        return tape.difference(self.point.velocity, self.target.velocity)


@dataclass(frozen=True)
class RodRow(CutRow):
    """Two points a length apart; the axis is the vector between them over the length."""

    length: Expr

    def value(self, tape: Tape) -> Expr:
        return (super().value(tape) - self.length) / 2

    def second_rate(self, tape: Tape, by: Accelerations) -> Expr:
        rate = self._gap_rate(tape)
        return super().second_rate(tape, by) + tape.keep(tape.dot(rate, rate) / self.length)


@dataclass(frozen=True)
class TurningRow(CutRow):
    """Two points that coincide along an axis fixed in a frame that turns with the link ``carrier``,
    one of the two."""

    frame: FrameMotion
    carrier: int

    @property
    def pairs(self) -> tuple[Pair, ...]:
        at = self.point if self.carrier == self.target.link else self.target
        ends = (self.point.link, at.position), (self.target.link, at.position)
        return (Pair(ends, self.axis),)

    def rate(self, tape: Tape) -> Expr:
        turned = tape.cross(self.frame.omega, self.axis)
        return tape.keep(super().rate(tape) + tape.dot(self._gap(tape), turned))

    def second_rate(self, tape: Tape, by: Accelerations) -> Expr:
        omega, angular = self.frame.omega, by.of_frame(self.frame, self.carrier)
        turned = tape.cross(omega, self.axis)
        turning = tape.total(tape.cross(angular, self.axis), tape.cross(omega, turned))
        along = 2 * tape.dot(self._gap_rate(tape), turned) + tape.dot(self._gap(tape), turning)
        return super().second_rate(tape, by) + tape.keep(along)


@dataclass(frozen=True)
class DirectionRow(CutRow):
    """Two axes that stay perpendicular: ``first`` in a frame of the point's side, ``second`` in one
    of the target's; ``links`` turn with these, ``places`` are their reference points."""

    frames: tuple[FrameMotion, FrameMotion]
    links: tuple[int, int]
    places: tuple[V3, V3]
    first: V3
    second: V3
    turn: V3

    @property
    def pairs(self) -> tuple[Pair, ...]:
        ends = (self.links[0], self.places[0]), (self.links[1], self.places[1])
        return (Pair(ends, ZERO, self.turn),)

    def value(self, tape: Tape) -> Expr:
        return tape.dot(self.first, self.second)

    def rate(self, tape: Tape) -> Expr:
        return tape.dot(self._turning(tape), self.turn)

    def second_rate(self, tape: Tape, by: Accelerations) -> Expr:
        one, other = self.frames
        angular = (by.of_frame(f, link) for f, link in zip(self.frames, self.links, strict=True))
        beyond = tape.total(
            tape.cross(tape.cross(one.omega, self.first), self.second),
            tape.cross(self.first, tape.cross(other.omega, self.second)),
        )
        along = tape.dot(self._turning(tape), beyond)
        return tape.keep(tape.dot(tape.difference(*angular), self.turn) + along)

    def _turning(self, tape: Tape) -> V3:
        one, other = self.frames
        return tape.difference(one.omega, other.omega)


def cut_rows(mechanism: Mechanism, links: Links, plain: Callable[[Expr], Expr]) -> Iterator[CutRow]:
    """The rows of a mechanism's closures; ``plain``: writes a length in symbols of the state.

    Raises
    ------
    NotATreeError
        Where an axis is fixed in neither of the bodies that the cut joins.
    """
    for closure in mechanism.closures:
        point, target = links.motion(closure.point), links.motion(closure.target)
        names = iter(closure.names)
        for vector in closure.axes:
            yield _along(next(names), links, point, target, vector)
        if closure.length is not None:
            tape, length = links.tape, plain(closure.length)
            gap = tape.difference(point.position, target.position)
            yield RodRow(next(names), point, target, tape.scale(1 / length, gap), length)
        yield from _directions(names, links, closure, point, target)


def _along(
    name: str, links: Links, point: PointMotion, target: PointMotion, vector: Vector
) -> CutRow:
    axis, frame = links.frames.along(vector), _fixed_in(name, links, vector)
    if frame.body is links.frames.inertial.body:
        return CutRow(name, point, target, axis)
    for end in (target, point):
        if links.frame_of(end.link).body is frame.body:
            return TurningRow(name, point, target, axis, frame, end.link)
    raise NotATreeError(f"the axis of {name} turns with neither body")


def _directions(
    names: Iterator[str], links: Links, closure: Closure, point: PointMotion, target: PointMotion
) -> Iterator[CutRow]:
    for (one, other), name in zip(closure.perpendicular, names, strict=True):
        frames = (_fixed_in(name, links, one), _fixed_in(name, links, other))
        on = (links.with_frame(frames[0].frame), links.with_frame(frames[1].frame))
        first, second = links.frames.along(one), links.frames.along(other)
        turn = links.tape.cross(first, second)
        places = (links.reference(on[0]), links.reference(on[1]))
        yield DirectionRow(name, point, target, ZERO, frames, on, places, first, second, turn)


def _fixed_in(name: str, links: Links, vector: Vector) -> FrameMotion:
    """The frame in which a vector is fixed."""
    frames: set[ReferenceFrame] = {frame for _, frame in vector.args}
    bodies = {links.frames.motion(frame).body: frame for frame in frames}
    still = all(links.local.constant(links.local.entries(matrix)) for matrix, _ in vector.args)
    if len(bodies) != 1 or not still:
        raise NotATreeError(f"an axis of {name} is fixed in no frame")
    return links.frames.motion(next(iter(bodies.values())))
