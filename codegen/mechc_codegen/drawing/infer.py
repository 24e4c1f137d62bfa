"""The links, the ground and the paths of a mechanism whose description has no drawing.

Input: the points and frames of a mechanism.  Output: a Drawing.  The points of one body are one
link; two points that keep their distance, as a particle on a massless rod, are one too, and so
are the ends of a rod that closes a loop.  The ground is where a point of a link is fixed; the free
ends of links are traced.
"""

from __future__ import annotations

from collections.abc import Mapping

from sympy.physics.mechanics import Particle, Point, RigidBody

from mechc_codegen.description.drawing import Drawing
from mechc_codegen.description.terms import is_rigid
from mechc_codegen.drawing.places import Neighbours, Places

MOST_TRACED = 4


def infer_drawing(places: Places) -> Drawing:
    """A drawing inferred from the mechanism alone."""
    found = _Polylines(places)
    name = {point: name for name, point in reversed(places.names.items())}
    links = tuple((label, tuple(name[p] for p in line)) for label, line in found.links)
    at_rest = tuple(name[p] for p in found.at_rest)
    # The ends of polylines that no other link has, and particles on no link at all.
    held = [name for _, line in links for name in set(line)]
    ends = [n for _, line in links for n in dict.fromkeys((line[0], line[-1]))]
    ends = [n for n in ends if held.count(n) == 1 and n not in at_rest]
    return Drawing(links=links, ground=at_rest, traced=tuple(ends[-MOST_TRACED:]))


class _Polylines:
    """The polylines of a mechanism's bodies."""

    def __init__(self, places: Places) -> None:
        self.places, self.same = places, places.same
        self._used: set[int] = set()
        bodies = [b for b in places.bodies if b.masscenter in self.same]
        lines = [(body.name, self._line(body)) for body in bodies]
        struts = self._struts({self.same[b.masscenter]: b.name for b in bodies})
        drawn = {p for _, line in (*lines, *struts) if len(line) > 1 for p in line}
        kept = [(label, line) for label, line in lines if len(line) > 1 or line[0] not in drawn]
        self.links = [*kept, *struts, *((name, (a, b)) for name, a, b in places.rods)]

    @property
    def at_rest(self) -> list[Point]:
        """The points of links that do not move."""
        ground = self.places.mechanism.frame
        fixed = self.places.connected_points(self.places.mechanism.origin, self.places.near(ground))
        several = [line for _, line in self.links if len(line) > 1]
        return list(dict.fromkeys(p for line in several for p in line if p in fixed))

    def _line(self, body: RigidBody | Particle) -> tuple[Point, ...]:
        """A polyline through the points fixed to a body, along the steps that place them."""
        centre = self.same[body.masscenter]
        if not is_rigid(body):
            return (centre,)
        group = self.places.group_of(body.frame)
        near = self.places.near(group)
        members = self.places.connected_points(centre, near)
        self._used |= {
            k
            for k, ((a, b, _), carrier) in enumerate(self.places.steps)
            if carrier is group and {self.same[a], self.same[b]} <= {*members}
        }
        if len(members) > 2 and len(near[centre]) == 1:
            members.remove(centre)  # beside the line, at its middle as a rule
        return _walk([p for p in self.same if p in members], near)

    def _struts(self, bodies: Mapping[Point, str]) -> list[tuple[str, tuple[Point, ...]]]:
        """Pairs of points at a constant distance that are on no rigid body."""
        ground = self.places.mechanism.frame
        left = [
            way for k, (way, carrier) in enumerate(self.places.steps)
            if k not in self._used and carrier is not ground
        ]  # fmt: skip
        ends = [(self.same[a], self.same[b]) for a, b, w in left if self.places.keeps_its_length(w)]
        return [(bodies.get(b) or bodies.get(a) or f"{a.name} {b.name}", (a, b)) for a, b in ends]


def _walk(members: list[Point], near: Neighbours) -> tuple[Point, ...]:
    """One polyline over all steps, from one end, going back where it branches."""
    own = {p: [x for x in near.get(p, ()) if x in members] for p in members}
    line = [next((p for p in members if len(own[p]) < 2), members[0])]
    way, seen = list(line), set(line)
    while way:
        further = next((x for x in own[way[-1]] if x not in seen), None)
        if further is None:
            way.pop()
            line += way[-1:]
        else:
            way.append(further)
            seen.add(further)
            line.append(further)
    return tuple(line[: max(line.index(p) for p in seen) + 1])
