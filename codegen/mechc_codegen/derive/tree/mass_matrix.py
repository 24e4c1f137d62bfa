"""M and F of a tree of links, written out: by composite bodies, and by inverse dynamics at u' = 0.

Input: links with their inertia and loads.  Output: the entries of M and F over statements that are
computed once.  Invariant: a speed may move several links against their parents, as that of a joint
which others mimic does.

The links beyond a joint move as one composite body when only its speed changes; the wrench which
that needs, projected on the columns of the links between it and the ground, is M (Featherstone
2008, section 6.2).
"""

from __future__ import annotations

from dataclasses import replace

from sympy import Expr, S

from mechc_codegen.derive.equations import Output, Symbols
from mechc_codegen.derive.outputs import equations_of_motion
from mechc_codegen.derive.tree.bodies import LinkBodies, Symmetric3
from mechc_codegen.derive.tree.links import GROUND
from mechc_codegen.derive.tree.residual import Residual
from mechc_codegen.derive.tree.tape import V3
from mechc_codegen.description.placement import dot

Composite = tuple[Expr, V3, Symmetric3]


def composite_equations(loaded: LinkBodies, symbols: Symbols) -> list[Output]:
    """``mass_matrix`` and ``forcing``, in the form that Kane's method written out has."""
    mass = _MassMatrix(loaded, len(symbols.u)).rows
    entries = [loaded.tape.keep(entry) for row in mass for entry in row]
    still = replace(symbols, accelerations=(S.Zero,) * len(symbols.accelerations))
    needed = Residual(loaded, (), still).elements()  # at u' = 0
    equation = "M, of the composite bodies beyond each joint"
    return equations_of_motion(loaded.mechanism, equation, entries, (-entry for entry in needed))


class _MassMatrix:
    def __init__(self, loaded: LinkBodies, size: int) -> None:
        self.loaded, self.links, self.tape = loaded, loaded.links.links, loaded.tape
        self.rows: list[list[Expr]] = [[S.Zero] * size for _ in range(size)]
        composites: dict[int, Composite] = {}
        for number in reversed(range(len(self.links))):
            own = composites[number] = self._composite(number, composites)
            self._project(number, own)

    def _composite(self, number: int, composites: dict[int, Composite]) -> Composite:
        """The composite body of a link and all links beyond it, about its reference point."""
        mass, moment, about = self.loaded.inertia(number)
        for child, link in enumerate(self.links):
            if link.parent == number:
                more = self._shift(composites[child], link.offset)
                mass += more[0]
                moment = self.tape.total(moment, more[1])
                about = [self.tape.total(a, b) for a, b in zip(about, more[2], strict=True)]
        return self.tape.keep(mass), moment, about

    def _shift(self, body: Composite, arm: V3) -> Composite:
        """The composite body about another point, from which its reference point is at ``arm``."""
        mass, moment, about = body
        tape = self.tape
        both = tape.total(tape.scale(mass, arm), tape.scale(2, moment))
        square = tape.dot(arm, both)
        mixed = tape.total(tape.scale(mass, arm), moment)

        def entry(i: int, j: int) -> Expr:
            turning = about[i][j] + (square if i == j else S.Zero)
            return turning - (arm[i] * mixed[j] + moment[i] * arm[j])

        return mass, mixed, tape.symmetric(entry)

    def _project(self, number: int, body: Composite) -> None:
        """Add the entries of M that couple a link's speeds with all speeds towards the ground."""
        tape, (mass, arm, about) = self.tape, body
        for speed, (turning, sliding) in self.links[number].columns.items():
            moment = tape.total(tape.transform(about, turning), tape.cross(arm, sliding))
            force = tape.total(tape.scale(mass, sliding), tape.cross(turning, arm))
            for other, column in self.links[number].columns.items():
                self.rows[speed][other] += dot(column[0], moment) + dot(column[1], force)
            at = number
            while self.links[at].parent != GROUND:
                moment = tape.total(moment, tape.cross(self.links[at].offset, force))
                at = self.links[at].parent
                for other, column in self.links[at].columns.items():
                    value = dot(column[0], moment) + dot(column[1], force)
                    self.rows[speed][other] += value
                    self.rows[other][speed] += value
