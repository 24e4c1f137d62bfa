"""A robot as plain data, whatever its file is written in: links and the graph of its joints.

SI units, in the order of the file.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field

from mechc_codegen.description.joints.kinds import KINDS, JointKind

Number = int | float
V3 = tuple[Number, Number, Number]
ORIGIN: V3 = (0, 0, 0)


@dataclass(frozen=True)
class Pose:
    """A place and an orientation: x, y, z in m, and roll, pitch, yaw in rad about fixed axes."""

    xyz: V3 = ORIGIN
    rpy: V3 = ORIGIN


@dataclass(frozen=True)
class Visual:
    """A shape: ``"box"`` by its sides, ``"cylinder"`` by radius and length, ``"ball"``, ``"mesh"``.

    The sizes of a mesh are m per unit along its axes, negative where it is mirrored; ``path``: its
    file, as the robot's file has it; ``triangles``: without a file, corners in single precision.
    """

    kind: str
    label: str
    sizes: tuple[Number, ...]
    pose: Pose
    path: str = ""
    triangles: bytes = field(default=b"", repr=False)


@dataclass(frozen=True)
class RobotLink:
    """A link of the robot.

    ``inertia``: Ixx, Ixy, Ixz, Iyy, Iyz, Izz about the mass centre, in the axes of ``centre``.
    ``share``: the part of mass and inertia that this is, where loops cut a link in two.
    """

    name: str
    mass: Number = 0
    centre: Pose = Pose()
    inertia: tuple[Number, ...] = (0,) * 6
    visuals: tuple[Visual, ...] = ()
    share: float = 1


@dataclass(frozen=True)
class Mimic:
    """A position that follows another joint: ``multiplier`` times its position plus ``offset``.

    ``powers``: further coefficients, of its square, its third power, and so on.  ``beside``: others
    whose positions are added.
    """

    joint: str
    multiplier: Number = 1
    offset: Number = 0
    powers: tuple[Number, ...] = ()
    beside: tuple[Mimic, ...] = ()

    @property
    def terms(self) -> tuple[Mimic, ...]:
        """Itself and those beside it."""
        return (self, *self.beside)

    @property
    def coefficients(self) -> tuple[Number, ...]:
        """The coefficients of the polynomial, the constant first."""
        return (self.offset, self.multiplier, *self.powers)

    def of(self, inner: Mimic) -> Mimic:
        """The mimic of what the followed joint mimics, which is no sum."""
        offset, multiplier, *powers = substitute(self.coefficients, inner.coefficients)
        return Mimic(inner.joint, multiplier, offset, tuple(powers))


def substitute(outer: Sequence[Number], inner: Sequence[Number]) -> list[Number]:
    """The coefficients of outer(inner(x)) of two polynomials, the constant first; at least two."""
    found: list[Number] = [0]
    for coefficient in reversed(outer):  # Horner's scheme
        times: list[Number] = [0] * (len(found) + len(inner) - 1)
        for i, one in enumerate(found):
            for j, other in enumerate(inner):
                times[i + j] += one * other
        found = [times[0] + coefficient, *times[1:]]
    while len(found) > 2 and found[-1] == 0:
        found.pop()
    return found


@dataclass(frozen=True)
class RobotJoint:
    """A joint between two links, or a constraint that holds them as such a joint does.

    Attributes
    ----------
    kind
        One of ``KINDS``, the table of joint kinds.
    origin, child_origin
        The joint's frame on the parent and on the child; they coincide where its coordinates are
        zero.
    axis
        Of length one, in the joint's frame.
    limits
        Those that it has of ``lower`` and ``upper`` position, ``velocity`` and ``effort``.
    damping, friction
        Viscous damping, and the greatest torque or force of dry friction.
    stops, saturates
        Whether it stops at its limits, and whether its motors have at most its effort.
    mimic
        What its position follows, if anything.
    stiffness, rest
        Of a spring on its coordinate, and the coordinate at which this is relaxed.
    armature
        Of the rotor that turns with its coordinate, as the motor's gear lets the joint feel it.
    length
        Of a ``"distance"``; None: as far apart as the two points are where all coordinates are
        zero.
    closes
        Whether the file says that it closes a loop: it is cut before others.
    """

    name: str
    kind: str
    parent: str
    child: str
    origin: Pose = Pose()
    axis: V3 = (1, 0, 0)
    limits: Mapping[str, Number] = field(default_factory=dict)
    damping: Number = 0
    friction: Number = 0
    mimic: Mimic | None = None
    child_origin: Pose = Pose()
    stiffness: Number = 0
    rest: Number = 0
    armature: Number = 0
    length: Number | None = None
    closes: bool = False
    stops: bool = False
    saturates: bool = True

    @property
    def row(self) -> JointKind:
        """The row of the kind."""
        return KINDS[self.kind]

    @property
    def leads_on(self) -> bool:
        """Whether the child may be placed by this joint, and not only be held by it."""
        return not self.closes and self.kind != "distance"


@dataclass(frozen=True)
class RobotMotor:
    """A motor at a joint with one coordinate, which an input of the mechanism drives.

    ``gear`` times the input ``name`` is its torque or force on the child; ``control`` and
    ``force``: the bounds of the input and of that, where there are any.
    """

    name: str
    joint: str
    gear: Number = 1
    control: tuple[Number, Number] | None = None
    force: tuple[Number, Number] | None = None


@dataclass(frozen=True)
class Robot:
    """Links, and joints between any two of them: a tree, or a graph with loops.

    ``root``: the link that is the ground; "": the one that no joint has for a child, but those that
    close loops.  ``skipped``: what the file has and this does not.  ``gravity``: in m/s^2, along
    the axes of the root.
    """

    name: str
    links: dict[str, RobotLink]
    joints: tuple[RobotJoint, ...]
    root: str = ""
    motors: tuple[RobotMotor, ...] = ()
    skipped: tuple[str, ...] = ()
    gravity: V3 = (0, 0, -9.81)


def unused_name(name: str, taken: Collection[str]) -> str:
    """This name, with underscores while another part has it."""
    while name in taken:
        name += "_"
    return name
