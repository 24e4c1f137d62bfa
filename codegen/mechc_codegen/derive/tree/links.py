"""Points and the links that carry them.

A link is a set of points that move as one body: a reference point and an orientation.  It is a
child of another link, relative to which it moves by its own speeds.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from sympy import Expr
from sympy.physics.mechanics import Point, ReferenceFrame

from mechc_codegen.derive.equations import Symbols
from mechc_codegen.derive.tree.frames import FrameMotion, Frames, NotATreeError
from mechc_codegen.derive.tree.tape import V3, ZERO, vanishes
from mechc_codegen.description.placement import steps_from

GROUND = -1


@dataclass(frozen=True)
class Link:
    """``offset`` leads from the reference point of the parent to that of this link.

    ``columns``: speed -> partial angular velocity and velocity of the reference point against the
    parent.  ``bias``: its accelerations relative to the parent at u' = 0.
    """

    frame: FrameMotion
    parent: int
    offset: V3
    columns: dict[int, tuple[V3, V3]]
    bias: tuple[V3, V3]
    reference: V3


@dataclass(frozen=True)
class PointMotion:
    """Position, velocity, acceleration at u' = 0; the link, and the arm from its reference."""

    position: V3
    velocity: V3
    bias: V3
    link: int
    arm: V3


class Links:
    """The links of all requested points, each after its parent."""

    def __init__(
        self, origin: Point, frames: Frames, bodies: Iterable[ReferenceFrame] = ()
    ) -> None:
        self.frames, self.tape, self.local = frames, frames.tape, frames.local
        self.links: list[Link] = []
        self._parents = steps_from(origin, lambda point: point._pos_dict)
        self._points = {origin: PointMotion(ZERO, ZERO, ZERO, GROUND, ZERO)}
        self._bodies = {frames.motion(frame).body for frame in bodies}
        self._known: dict[tuple[ReferenceFrame, int, V3], int] = {}

    def frame_of(self, link: int) -> FrameMotion:
        return self.frames.inertial if link == GROUND else self.links[link].frame

    def reference(self, link: int) -> V3:
        return ZERO if link == GROUND else self.links[link].reference

    def motion(self, point: Point) -> PointMotion:
        """The motion of a point.

        Raises
        ------
        NotATreeError
            Where it is not located, step by step, from the origin.
        """
        path = [point]
        while path[-1] not in self._points:
            if path[-1] not in self._parents:
                raise NotATreeError(f"point {path[-1].name} is not located from the origin")
            path.append(self._parents[path[-1]])
        for child in reversed(path[:-1]):
            motion = self._points[self._parents[child]]
            for entries, frame in child._pos_dict[self._parents[child]].args:
                motion = self._beyond(motion, self.frames.motion(frame), entries)
            self._points[child] = motion
        return self._points[point]

    def turning(self, at: PointMotion, frame: FrameMotion) -> PointMotion:
        """The point as a point of the link that turns with ``frame`` there."""
        if self.frame_of(at.link).body is frame.body:
            return at
        between = self._body_between(at, frame)
        if between is not None:
            at = self.turning(at, between)
        key = (frame.body, at.link, at.arm)
        if key not in self._known:
            self._known[key] = self._add_turning(at, frame)
        return PointMotion(at.position, at.velocity, at.bias, self._known[key], ZERO)

    def with_frame(self, frame: ReferenceFrame) -> int:
        """A link that turns with a frame: where a torque acts."""
        body = self.frames.motion(frame).body
        if body is self.frames.inertial.frame:
            return GROUND
        for number, link in enumerate(self.links):
            if link.frame.body is body:
                return number
        raise NotATreeError(f"no body turns with frame {frame.name}, on which a torque acts")

    def path(self, link: int) -> list[int]:
        """The link, its parent and so on to the ground."""
        found = []
        while link != GROUND:
            found.append(link)
            link = self.links[link].parent
        return found

    def _beyond(self, start: PointMotion, frame: FrameMotion, entries: list[Expr]) -> PointMotion:
        """The point at an arm, given in the axes of ``frame``, from another point."""
        tape, local = self.tape, self.local
        value = local.entries(entries)
        start = self.turning(start, frame)
        arm = tape.transform(frame.rotation, value)
        turned = tape.cross(frame.omega, arm)
        velocity = tape.total(start.velocity, turned)
        bias = tape.total(start.bias, tape.cross(frame.bias, arm), tape.cross(frame.omega, turned))
        position = tape.total(start.position, arm)
        whole = tape.total(start.arm, arm)
        if local.constant(value):
            return PointMotion(position, velocity, bias, start.link, whole)
        rate = local.rates_of(value)
        if not local.at_rest(rate):
            raise NotATreeError("a point is moved by time")
        sliding = tape.transform(frame.rotation, rate)
        beyond = tape.total(
            tape.scale(2, tape.cross(frame.omega, sliding)),
            tape.transform(frame.rotation, local.rates_of(rate)),
        )
        columns = {
            k: (ZERO, tape.transform(frame.rotation, column))
            for k, column in local.columns(rate).items()
        }
        link = self._add(
            Link(
                frame,
                start.link,
                whole,
                columns,
                (ZERO, tape.total(self._centripetal(start.link, whole), beyond)),
                position,
            )
        )
        return PointMotion(
            position, tape.total(velocity, sliding), tape.total(bias, beyond), link, ZERO
        )

    def _body_between(self, at: PointMotion, frame: FrameMotion) -> FrameMotion | None:
        """The last frame of another body on the way to ``frame``; both may turn about one point."""
        inner, step = self.frame_of(at.link).body, frame.carrier
        while step is not None and step.body is not inner:
            if step.body is not frame.body and step.body in self._bodies:
                return step
            step = step.carrier
        return None

    def _add_turning(self, at: PointMotion, frame: FrameMotion) -> int:
        parent = self.frame_of(at.link)
        columns: dict[int, tuple[V3, V3]] = {}
        step = frame
        while step.body is not parent.body:
            if step.carrier is None:
                raise NotATreeError(
                    f"{frame.frame.name} is not oriented against {parent.frame.name}, on which "
                    "it hangs"
                )
            for k, column in step.columns.items():
                angular, linear = columns.get(k, (ZERO, ZERO))
                columns[k] = (self.tape.total(angular, column), linear)
            step = step.carrier
        bias = (self.tape.difference(frame.bias, parent.bias), self._centripetal(at.link, at.arm))
        return self._add(Link(frame, at.link, at.arm, columns, bias, at.position))

    def _centripetal(self, link: int, arm: V3) -> V3:
        """Centripetal acceleration at the end of an arm on a link."""
        omega = self.frame_of(link).omega
        return self.tape.cross(omega, self.tape.cross(omega, arm))

    def _add(self, link: Link) -> int:
        self.links.append(link)
        return len(self.links) - 1


class LinkAccelerations:
    """The part of each link's acceleration that depends on u', once the motion is solved, from the
    ground outwards."""

    def __init__(self, links: Links, symbols: Symbols) -> None:
        self.tape, self.links = links.tape, links
        self._of_speeds = symbols.accelerations
        self._found: dict[int, tuple[V3, V3]] = {GROUND: (ZERO, ZERO)}

    def of_link(self, link: int) -> tuple[V3, V3]:
        """The terms with u' in the accelerations, angular and of the reference point."""
        for outward in reversed(self.links.path(link)):
            if outward not in self._found:
                self._found[outward] = self._next(outward)
        return self._found[link]

    def of_frame(self, link: int) -> V3:
        """The whole angular acceleration of a link."""
        return self.tape.total(self.of_link(link)[0], self.links.frame_of(link).bias)

    def of_speed(self, speed: int) -> Expr:
        """Its rate."""
        return self._of_speeds[speed]

    def of_point(self, point: PointMotion) -> V3:
        """The whole acceleration of a point."""
        angular, linear = self.of_link(point.link)
        turned = self.tape.cross(angular, point.arm)
        return self.tape.total(linear, turned, point.bias)

    def _next(self, number: int) -> tuple[V3, V3]:
        tape, link = self.tape, self.links.links[number]
        carried, at = self._found[link.parent]
        turning = [tape.scale(self._of_speeds[k], a) for k, (a, _) in link.columns.items()]
        moving = [tape.scale(self._of_speeds[k], v) for k, (_, v) in link.columns.items()]
        angular = tape.total(carried, *turning)
        return angular, tape.total(at, tape.cross(carried, link.offset), *moving)


def moving_columns(link: Link) -> dict[int, tuple[V3, V3]]:
    """The columns of the speeds that move a link relative to its parent."""
    return {k: column for k, column in link.columns.items() if not all(map(vanishes, column))}
