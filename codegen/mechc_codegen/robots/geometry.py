"""Rotations, places and inertia with entries that are numbers or expressions.

Matrices are lists of rows.  Entries that are exactly 0 or 1 stay so: products with them vanish from
the equations.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import sympy
from sympy import Expr

from mechc_codegen.description.placement import apply, cross, dot, plus, product
from mechc_codegen.robots.robot import Pose, RobotJoint

Entry = Any  # int, float or Expr
Vec = Sequence[Entry]
Mat = Sequence[Vec]
IDENTITY: Mat = ((1, 0, 0), (0, 1, 0), (0, 0, 1))
_QUARTER = math.pi / 2
_ROUNDING = 4 * math.ulp(1.0)  # of products of a quaternion of length one


def cos_sin(angle: Entry) -> tuple[Entry, Entry]:
    """Cosine and sine; exact where a number is a multiple of a right angle to its last bits."""
    if isinstance(angle, Expr) and not angle.is_number:
        return sympy.cos(angle), sympy.sin(angle)
    value = float(angle)
    turns = round(value / _QUARTER)
    if abs(value - turns * _QUARTER) <= 2 * math.ulp(value):
        return ((1, 0), (0, 1), (-1, 0), (0, -1))[turns % 4]
    return math.cos(value), math.sin(value)


def about(axis: Vec, angle: Entry) -> Mat:
    """The rotation by an angle about an axis of length one (Rodrigues)."""
    c, s = cos_sin(angle)
    x, y, z = axis
    skew = ((0, -z, y), (z, 0, -x), (-y, x, 0))
    return [
        [axis[i] * axis[j] + c * (IDENTITY[i][j] - axis[i] * axis[j]) + s * skew[i][j]
         for j in range(3)]
        for i in range(3)
    ]  # fmt: skip


def of_angles(rpy: Vec) -> Mat:
    """Rotation by roll about x, then pitch about y, then yaw about z, all fixed axes: Rz Ry Rx."""
    roll, pitch, yaw = rpy
    turned = product(about((0, 1, 0), pitch), about((1, 0, 0), roll))
    return product(about((0, 0, 1), yaw), turned)


def of_quaternion(w: float, x: float, y: float, z: float) -> Mat:
    """The rotation of a quaternion of length one, exact where it turns by right angles."""
    entries = (
        (w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z),
    )
    rounded = tuple(tuple(_round(entry) for entry in row) for row in entries)
    return IDENTITY if rounded == IDENTITY else rounded


def _round(entry: float) -> int | float:
    """-1, 0 or 1 where rounding alone parts the entry from it."""
    nearest = round(entry)
    return nearest if abs(entry - nearest) <= _ROUNDING else entry


def transpose(matrix: Mat) -> Mat:
    return list(zip(*matrix, strict=True))


def across(axis: Vec) -> tuple[Vec, Vec]:
    """Two directions that form a right-handed system with the axis as the third."""
    least = min(range(3), key=lambda k: abs(axis[k]))
    first = [IDENTITY[least][k] - axis[least] * axis[k] for k in range(3)]
    length = math.sqrt(dot(first, first))
    first = [x if length == 1 else x / length for x in first]
    return first, cross(axis, first)


@dataclass(frozen=True)
class Place:
    """Orientation and origin of one frame in another."""

    rotation: Mat = IDENTITY
    origin: Vec = (0, 0, 0)

    @property
    def is_identity(self) -> bool:
        rows = [list(row) for row in self.rotation]
        return rows == [list(row) for row in IDENTITY] and not any(self.origin)

    def then(self, other: Place) -> Place:
        """The place in the outer frame of a place that is given in this frame."""
        rotation = product(self.rotation, other.rotation)
        return Place(rotation, plus(self.origin, apply(self.rotation, other.origin)))

    def inverse(self) -> Place:
        """The place of the outer frame in this one."""
        rotation = transpose(self.rotation)
        return Place(rotation, [-x for x in apply(rotation, self.origin)])


def place_of(pose: Pose) -> Place:
    return Place(of_angles(pose.rpy), pose.xyz)


def axes_of(joint: RobotJoint) -> Mat:
    """The axis of a joint and two across it, or x, y and z, in the joint's frame."""
    return (joint.axis, *across(joint.axis)) if joint.row.has_axis else IDENTITY


def moved_to(joint: RobotJoint, position: Entry) -> Place:
    """The place of the child's side on the parent's, of a joint with one coordinate or none."""
    if joint.row.unit == "rad":
        return Place(about(joint.axis, position))
    return Place(IDENTITY, [position * x for x in joint.axis])


def pose_of(place: Place) -> Pose:
    """The pose of a place of numbers.

    Pitch and yaw are those of the rotation after the roll, which is inaccurate where the pitch is a
    right angle; together they are accurate.
    """
    roll = math.atan2(place.rotation[2][1], place.rotation[2][2])
    r = product(place.rotation, about((1, 0, 0), -roll))
    pitch = math.atan2(-r[2][0], math.hypot(r[0][0], r[1][0]))
    x, y, z = place.origin
    return Pose((x, y, z), (roll, pitch, math.atan2(-r[0][1], r[1][1])))


@dataclass(frozen=True)
class Inertia:
    """Mass, mass centre, and inertia about the mass centre."""

    mass: Entry = 0
    centre: Vec = (0, 0, 0)
    about: Mat = ((0, 0, 0), (0, 0, 0), (0, 0, 0))

    @property
    def vanishes(self) -> bool:
        return self.mass == 0 and not any(entry != 0 for row in self.about for entry in row)

    def share(self, part: float) -> Inertia:
        """The inertia of this part of the body, in the same place."""
        if part == 1:
            return self
        about = [[part * entry for entry in row] for row in self.about]
        return Inertia(part * self.mass, self.centre, about)

    def transform(self, place: Place) -> Inertia:
        """The inertia in the frame in which this frame has the given place."""
        rotation = place.rotation
        turned = product(product(rotation, self.about), transpose(rotation))
        return Inertia(
            self.mass, plus(place.origin, apply(rotation, self.centre)), _symmetric(turned)
        )


def combine(parts: Iterable[Inertia]) -> Inertia:
    """The inertia of bodies that are fixed to each other, as one (Huygens and Steiner)."""
    present = [part for part in parts if not part.vanishes]
    if len(present) < 2:
        return present[0] if present else Inertia()
    mass = sum(part.mass for part in present)
    if mass == 0:
        centre: Vec = (0, 0, 0)
    else:
        moments = ([part.mass * x for x in part.centre] for part in present)
        centre = [sum(entries) / mass for entries in zip(*moments, strict=True)]
    about = [_about(part, centre) for part in present]
    return Inertia(
        mass, centre, [[sum(m[i][j] for m in about) for j in range(3)] for i in range(3)]
    )


def _about(part: Inertia, point: Vec) -> Mat:
    arm = [x - y for x, y in zip(part.centre, point, strict=True)]
    square = dot(arm, arm)
    return [
        [
            part.about[i][j] + part.mass * (square * IDENTITY[i][j] - arm[i] * arm[j])
            for j in range(3)
        ]
        for i in range(3)
    ]


def _symmetric(matrix: Mat) -> Mat:
    """The matrix with its upper half copied to the lower one, against rounding differences."""
    return [[matrix[min(i, j)][max(i, j)] for j in range(3)] for i in range(3)]
