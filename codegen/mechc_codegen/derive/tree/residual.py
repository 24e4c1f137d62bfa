"""Residuals of a tree's motion, R = M u' + J^T lambda - F and S = J u' - gamma.

By Newton and Euler from link to link, outwards and back, so that Jacobians of the motion need no
mass matrix: inverse dynamics (Featherstone 2008, section 5.3) with the forces of the cuts.
"""

from __future__ import annotations

from collections.abc import Sequence

from sympy import Expr, S

from mechc_codegen.derive.equations import Symbols
from mechc_codegen.derive.tree.bodies import LinkBodies
from mechc_codegen.derive.tree.cuts import solved
from mechc_codegen.derive.tree.links import GROUND, LinkAccelerations
from mechc_codegen.derive.tree.tape import V3, ZERO, vanishes
from mechc_codegen.derive.tree.written_rows import Row


class Residual:
    """Motions of the links outwards, wrenches inwards."""

    def __init__(self, loaded: LinkBodies, rows: Sequence[Row], symbols: Symbols) -> None:
        self.loaded, self.rows, self.symbols = loaded, rows, symbols
        self.links, self.tape = loaded.links, loaded.tape

    def elements(self) -> list[Expr]:
        """R over the speeds, then S over the rows."""
        return [*self._balance(), *self._openings()]

    def _openings(self) -> list[Expr]:
        """The second rates of the constraints."""
        by = solved(LinkAccelerations(self.links, self.symbols))
        return [self.tape.keep(row.second_rate(self.tape, by)) for row in self.rows]

    def _balance(self) -> list[Expr]:
        tape, found = self.tape, dict[int, Expr]()
        wrenches = self._needed_wrenches(self._motions())
        self._add_rows(wrenches)
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

    def _add_rows(self, wrenches: list[tuple[V3, V3]]) -> None:
        """Add J^T lambda: opposite forces and moments on the links of each row."""
        tape = self.tape
        rows = zip(self.rows, self.symbols.multipliers, strict=True)
        for pair, multiplier in ((pair, each) for row, each in rows for pair in row.pairs):
            for (link, place), sign in zip(pair.ends, (1, -1), strict=True):
                if link != GROUND:
                    force = tape.scale(sign * multiplier, pair.force)
                    arm = tape.difference(place, self.links.reference(link))
                    moment = tape.cross(arm, force)
                    if not vanishes(pair.moment):
                        moment = tape.total(moment, tape.scale(sign * multiplier, pair.moment))
                    self._add(wrenches, link, moment, force)

    def _add(self, wrenches: list[tuple[V3, V3]], link: int, moment: V3, force: V3) -> None:
        own = wrenches[link]
        wrenches[link] = self.tape.total(own[0], moment), self.tape.total(own[1], force)
