"""Residuals of a tree's motion, R = M u' + J^T lambda - F and S = J u' - gamma.

By Newton and Euler from link to link, outwards and back, so that Jacobians of the motion need no
mass matrix: inverse dynamics (Featherstone 2008, section 5.3) with the forces of the cuts.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from sympy import Expr, S

from mechc_codegen.derive.equations import Symbols
from mechc_codegen.derive.tree.bodies import LinkBodies
from mechc_codegen.derive.tree.links import GROUND, LinkAccelerations, PointMotion
from mechc_codegen.derive.tree.tape import V3, ZERO, Tape


@dataclass(frozen=True)
class CutRow:
    """One row of a closure: two points that coincide along an axis, which does not turn.

    Of a rod with a ``length`` the axis is the vector between the points over the length.
    """

    label: str
    point: PointMotion
    target: PointMotion
    axis: V3
    length: Expr | None = None

    def opened(self, gap: Expr) -> Expr:
        """The constraint, with the product of the points' gap and the axis."""
        return gap if self.length is None else (gap - self.length) / 2

    def turning(self, tape: Tape) -> Expr:
        """Its second derivative because the axis turns."""
        if self.length is None:
            return S.Zero
        rate = tape.difference(self.point.velocity, self.target.velocity)
        return tape.keep(tape.dot(rate, rate) / self.length)


class Residual:
    """Motions of the links outwards, wrenches inwards."""

    def __init__(self, loaded: LinkBodies, cuts: Sequence[CutRow], symbols: Symbols) -> None:
        self.loaded, self.cuts, self.symbols = loaded, cuts, symbols
        self.links, self.tape = loaded.links, loaded.tape

    def elements(self) -> list[Expr]:
        """R over the speeds, then S over the cuts."""
        return [*self._balance(), *self._openings()]

    def _openings(self) -> list[Expr]:
        """The relative acceleration of the two ends of each cut along its axis."""
        tape, moving = self.tape, LinkAccelerations(self.links, self.symbols)
        ends = [(moving.of_point(c.point), moving.of_point(c.target)) for c in self.cuts]
        gaps = [tape.difference(one, other) for one, other in ends]
        return [
            tape.keep(tape.dot(gap, cut.axis) + cut.turning(tape))
            for gap, cut in zip(gaps, self.cuts, strict=True)
        ]

    def _balance(self) -> list[Expr]:
        tape, found = self.tape, dict[int, Expr]()
        wrenches = self._needed_wrenches(self._motions())
        self._add_cuts(wrenches)
        for number, link in reversed(list(enumerate(self.links.links))):
            moment, force = wrenches[number]
            for k, (angular, linear) in link.columns.items():
                along = tape.dot(angular, moment) + tape.dot(linear, force)
                found[k] = tape.keep(found.get(k, S.Zero) + along)
            if link.parent != GROUND:
                carried = tape.total(moment, tape.cross(link.offset, force))
                self._add(wrenches, link.parent, carried, force)
        return [found[k] for k in range(len(self.symbols.u))]

    def _motions(self) -> list[tuple[V3, V3]]:
        """Angular acceleration, and acceleration of the reference point, of every link."""
        tape, motions = self.tape, list[tuple[V3, V3]]()
        for link in self.links.links:
            angular, linear = motions[link.parent] if link.parent != GROUND else (ZERO, ZERO)
            turns, slides = [link.bias[0]], [link.bias[1], tape.cross(angular, link.offset)]
            for k, (turning, sliding) in link.columns.items():
                turns.append(tape.scale(self.symbols.accelerations[k], turning))
                slides.append(tape.scale(self.symbols.accelerations[k], sliding))
            motions.append((tape.total(angular, *turns), tape.total(linear, *slides)))
        return motions

    def _needed_wrenches(self, motions: Sequence[tuple[V3, V3]]) -> list[tuple[V3, V3]]:
        """Wrench of each link for its motion minus its loads, about its reference point."""
        tape, found = self.tape, list[tuple[V3, V3]]()
        for number, (angular, linear) in enumerate(motions):
            mass, arm, about = self.loaded.inertia(number)
            moment, force = self.loaded.wrench(number)
            turning = tape.total(tape.transform(about, angular), tape.cross(arm, linear))
            pushing = tape.total(tape.scale(mass, linear), tape.cross(angular, arm))
            found.append((tape.difference(turning, moment), tape.difference(pushing, force)))
        return found

    def _add_cuts(self, wrenches: list[tuple[V3, V3]]) -> None:
        """Add J^T lambda: opposite forces along the axis at the two ends of each cut."""
        tape = self.tape
        for cut, multiplier in zip(self.cuts, self.symbols.multipliers, strict=True):
            for end, sign in ((cut.point, 1), (cut.target, -1)):
                if end.link != GROUND:
                    force = tape.scale(sign * multiplier, cut.axis)
                    arm = tape.difference(end.position, self.links.reference(end.link))
                    self._add(wrenches, end.link, tape.cross(arm, force), force)

    def _add(self, wrenches: list[tuple[V3, V3]], link: int, moment: V3, force: V3) -> None:
        own = wrenches[link]
        wrenches[link] = self.tape.total(own[0], moment), self.tape.total(own[1], force)
