"""Bodies that slide along a straight line of another body or of the ground.

Input: the places of a mechanism, the points of its lines.  Output: for each such body its mass
centre and the direction of the line, in a frame that it is at rest in.  They are found from the
steps between points alone, so that joints, a KanesMethod and frames by hand are drawn alike.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

from sympy import Dummy, Expr, S
from sympy.physics.mechanics import Particle, Point, ReferenceFrame, RigidBody

from mechc_codegen.description.placement import Placement, cross, dot
from mechc_codegen.description.terms import is_rigid
from mechc_codegen.drawing.places import Places, Way

CONSTANT = 1e-9  # of the product of the lengths
Components = tuple[Expr, Expr, Expr]


@dataclass(frozen=True)
class Slider:
    """A body whose mass centre slides along a line, with this direction in ``frame``.

    ``base`` is at rest relative to the line.  ``is_block``: whether a block stands for the body; a
    bead that no link leads to is a point.
    """

    label: str
    base: Point
    at: Point
    frame: ReferenceFrame
    along: Components
    is_block: bool


def sliders(places: Places, linked: Collection[Point]) -> list[Slider]:
    """The bodies that slide and do not turn relative to their line.

    A particle on a line of the ground that no link leads to is none: it falls or flies.
    """
    found: dict[str, Slider] = {}
    for way in places.ways:
        line = _line(places, way)
        body = None if line is None else _body(places, way[1], line[0])
        if line is None or body is None:
            continue
        frame, along = line
        held = {places.same[way[1]], places.same[body.masscenter]} & {*linked}
        is_block = is_rigid(body) or bool(held)
        if is_block or places.group_of(frame) is not places.mechanism.frame:
            found.setdefault(
                body.name, Slider(body.name, way[0], body.masscenter, frame, along, is_block)
            )
    return list(found.values())


def _line(places: Places, way: Way) -> tuple[ReferenceFrame, Components] | None:
    """The frame and the direction in it along which a step becomes longer or shorter, if one."""
    _, _, vector = way
    if len(vector.args) != 1:
        return None
    matrix, frame = vector.args[0]
    state = {x: Dummy() for x in (*places.mechanism.q, *places.mechanism.x)}
    entries = [places.expression(entry).xreplace(state) for entry in matrix]
    varying = set().union(*(entry.free_symbols for entry in entries)) - {*places.parameters}
    rates = [[entry.diff(x) for entry in entries] for x in sorted(varying, key=str)]
    rates = [rate for rate in rates if any(rate)]
    if not rates:
        return None
    moving = [any(rate[k] != 0 for rate in rates) for k in range(3)]
    if sum(moving) == 1:  # along an axis, by any law
        x, y, z = (S.One if moves else S.Zero for moves in moving)
        return frame, (x, y, z)
    steady = next((rate for rate in rates if all(map(places.is_constant, rate))), None)
    if steady is None:
        return None
    at = Placement(places.mechanism.frame, places.mechanism.origin, 1)
    first = [at.value(x) for x in steady]
    for rate in rates:
        other = [at.value(x) for x in rate]
        across = cross(first, other)
        if dot(across, across) > CONSTANT**2 * dot(first, first) * dot(other, other):
            return None
    return frame, (steady[0], steady[1], steady[2])


def _body(places: Places, point: Point, frame: ReferenceFrame) -> RigidBody | Particle | None:
    """The body that a point belongs to, if it does not turn relative to a frame."""
    group = places.group_of(frame)
    members = places.connected_points(point, places.near(group))
    for body in places.bodies:
        if places.same.get(body.masscenter) in members:
            centre = places.same[body.masscenter]
            if not is_rigid(body) and centre is places.same[point]:
                return body
            if is_rigid(body) and places.group_of(body.frame) is group:
                return body
    return None
