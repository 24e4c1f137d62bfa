"""Springs and dampers among the loads of a mechanism.

Input: a mechanism's loads.  Output: (kind, label, the two points).  Two points with opposite forces
along the line between them are joined by one; it is a damper if nothing acts at rest.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator

from sympy import Derivative
from sympy.physics.mechanics import Point
from sympy.physics.vector import Vector

from mechc_codegen.description.placement import Placement, cross, dot
from mechc_codegen.drawing.places import Places

Strut = tuple[str, str, tuple[Point, Point]]
ALONG = 1e-9  # of the product of the lengths
MOST_LOADS = 60  # pairs are looked for


def inferred_struts(places: Places, taken: Collection[frozenset[Point]]) -> list[Strut]:
    """The springs and dampers, each pair of points once; those with a spring are springs.

    Between the pairs that are ``taken``, of points that never coincide, there are none.
    """
    found: dict[frozenset[Point], Strut] = {}
    at_random = Placement(places.mechanism.frame, places.mechanism.origin, 1)
    for a, b, force in _opposite(places):
        pair = frozenset((a, b))
        same = frozenset(places.same[point] for point in pair)
        if same in taken or (pair in found and found[pair][0] == "spring"):
            continue
        if _acts_along(at_random, a, b, force):
            kind = "spring" if _acts_at_rest(places, force) else "damper"
            found[pair] = (kind, f"{kind} {a.name} {b.name}", (a, b))
    return list(found.values())


def _opposite(places: Places) -> Iterator[tuple[Point, Point, Vector]]:
    """Pairs of different points with opposite forces."""
    loads = [(p, v) for p, v in places.mechanism.loads if isinstance(p, Point) and v != 0]
    loads = [(p, v) for p, v in loads if p in places.same][:MOST_LOADS]
    for k, (a, force) in enumerate(loads):
        for b, other in loads[k + 1 :]:
            if places.same[a] is not places.same[b] and force + other == 0:
                yield a, b, force


def _acts_along(at: Placement, a: Point, b: Point, force: Vector) -> bool:
    first, second = at.position(a), at.position(b)
    way = [y - x for x, y in zip(first, second, strict=True)]
    f = at.vector(force)
    across, size = cross(way, f), dot(way, way) * dot(f, f)
    return bool(size > 0.0 and dot(across, across) <= ALONG**2 * size)


def _acts_at_rest(places: Places, force: Vector) -> bool:
    mechanism = places.mechanism
    at = Placement(mechanism.frame, mechanism.origin, 1)
    entries = [entry for matrix, _ in force.args for entry in matrix]
    rates = {d for entry in entries for d in entry.atoms(Derivative)}
    for rate in (*mechanism.u, *rates):
        at.assume(rate, 0.0)
    return any(x != 0.0 for x in at.vector(force))
