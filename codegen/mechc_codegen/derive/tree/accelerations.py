"""Accelerations of links and points once the motion is solved, from the ground outwards."""

from __future__ import annotations

from mechc_codegen.derive.equations import Symbols
from mechc_codegen.derive.tree.links import GROUND, Links, PointMotion
from mechc_codegen.derive.tree.tape import V3, ZERO


class LinkAccelerations:
    """The part of each link's acceleration that depends on u'."""

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
