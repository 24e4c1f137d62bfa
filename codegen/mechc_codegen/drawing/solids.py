"""The solids of a picture in space: given solids, and solids inferred from the bodies' inertia.

Input: the places of a mechanism and its drawing.  Output: shapes at points and frames, with the
expressions of their sizes.  A body to which no given solid is fixed has the one with its inertia:
for it the entries are those of the central inertia, divided by the mass.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from sympy import Expr
from sympy.physics.mechanics import Particle, Point, ReferenceFrame, RigidBody
from sympy.physics.vector import Dyadic, Vector

from mechc_codegen.description.solid import Solid
from mechc_codegen.description.terms import is_rigid
from mechc_codegen.drawing.places import Places
from mechc_codegen.errors import MechanismError

UPPER = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))


@dataclass(frozen=True)
class Shape:
    """A solid at a placed point: ``kind`` as of :class:`Solid`, ``"inertia"`` or ``"mass"``."""

    kind: str
    label: str
    at: Point
    frame: ReferenceFrame
    entries: tuple[Expr, ...] = ()
    axis: str = "z"
    path: str = ""
    triangles: bytes = b""


def shapes(places: Places, solids: Iterable[Solid]) -> list[Shape]:
    """Every solid that can be placed.

    Raises
    ------
    MechanismError
        If a given solid has a point or frame that is not placed, or sizes that are not known.
    """
    solids = list(solids)
    given = [_shape_of_solid(places, solid) for solid in solids]
    bodies = [body for body in places.bodies if body.masscenter in places.same]
    bodies = [body for body in bodies if not _has_solid(places, body, solids)]
    return [*given, *filter(None, (_of_body(places, body) for body in bodies))]


def _has_solid(places: Places, body: RigidBody | Particle, solids: Iterable[Solid]) -> bool:
    """Whether one is at the mass centre of a body, or at another point and turns with it."""
    at = {places.same.get(solid.at, solid.at) for solid in solids}
    if places.same[body.masscenter] in at or not is_rigid(body):
        return places.same[body.masscenter] in at
    group = places.group_of(body.frame)
    turning = [solid for solid in solids if solid.frame and places.group_of(solid.frame) is group]
    fixed = places.connected_points(body.masscenter, places.near(group)) if turning else []
    return any(places.same.get(solid.at, solid.at) in fixed for solid in turning)


def _shape_of_solid(places: Places, solid: Solid) -> Shape:
    frame = solid.frame or places.mechanism.frame
    if not places.is_placed(solid.at) or places.group_of(frame) is None:
        raise MechanismError(
            f"solid {solid.label}: it is not known where {solid.at.name} or {frame.name} is; "
            f"locate and orient them from {places.mechanism.origin.name} and "
            f"{places.mechanism.frame.name}"
        )
    if not all(places.is_constant(size) for size in solid.sizes):
        raise MechanismError(f"solid {solid.label}: its sizes may contain parameters only")
    return Shape(
        solid.kind, solid.label, solid.at, frame, solid.sizes, solid.axis, solid.path,
        solid.triangles,
    )  # fmt: skip


def _of_body(places: Places, body: RigidBody | Particle) -> Shape | None:
    if not is_rigid(body):
        return Shape("mass", body.name, body.masscenter, places.mechanism.frame)
    inertia = body.central_inertia
    if inertia == 0 or body.mass == 0:  # a rotor has inertia alone, which no solid shows
        return None
    for frame in dict.fromkeys((body.frame, _own_frame(inertia) or body.frame)):
        if places.group_of(frame) is not None:
            matrix = inertia.to_matrix(frame)
            entries = tuple(matrix[row, column] / body.mass for row, column in UPPER)
            if all(map(places.is_constant, entries)):
                return Shape("inertia", body.name, body.masscenter, frame, entries)
            if places.keep_their_values(entries):  # a wheel's, written in its holder's frame
                at_zero = tuple(places.at_zero(entry) for entry in entries)
                return Shape("inertia", body.name, body.masscenter, frame, at_zero)
    return None


def _own_frame(inertia: Dyadic) -> ReferenceFrame | None:
    """The one frame that a dyadic is written in; for a wheel it may be the holder's frame."""
    vectors = [v for _, *pair in inertia.args for v in pair] if inertia != 0 else []
    frames = {frame for vector in vectors for _, frame in vector.args}
    return frames.pop() if len(frames) == 1 else None


def weight(places: Places) -> tuple[Expr, Expr, Expr] | None:
    """Components of the acceleration of free fall in the inertial frame, if there is one."""
    mechanism = places.mechanism
    given = [] if mechanism.gravity is None else [mechanism.gravity]
    centres = {body.masscenter: body for body in places.bodies}
    given += [_per_mass(v, centres[p].mass) for p, v in mechanism.loads if p in centres]
    for vector in given:
        if vector != 0 and {frame for _, frame in vector.args} == {mechanism.frame}:
            x, y, z = vector.to_matrix(mechanism.frame)
            if all(map(places.is_constant, (x, y, z))):
                return x, y, z
    return None


def _per_mass(force: Vector, mass: Expr) -> Vector:
    """A force divided by a mass; zero if the mass does not cancel, as it is no weight then."""
    found = Vector([((matrix / mass), frame) for matrix, frame in force.args])
    entries = [entry for matrix, _ in found.args for entry in matrix]
    return Vector(0) if any(e.has(*mass.free_symbols) for e in entries) else found
