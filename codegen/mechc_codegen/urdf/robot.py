"""The content of a URDF file as plain data: links, joints, shapes, in SI units and file order."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

Number = int | float
V3 = tuple[Number, Number, Number]
ORIGIN: V3 = (0, 0, 0)
TURNING = ("revolute", "continuous")
SINGLE = (*TURNING, "prismatic")
KINDS = (*SINGLE, "fixed", "floating", "planar")


@dataclass(frozen=True)
class Pose:
    """A place and an orientation: x, y, z in m, and roll, pitch, yaw in rad about fixed axes."""

    xyz: V3 = ORIGIN
    rpy: V3 = ORIGIN


@dataclass(frozen=True)
class Visual:
    """A simple shape: ``"box"`` by its sides, ``"cylinder"`` by radius and length, ``"ball"``."""

    kind: str
    label: str
    sizes: tuple[Number, ...]
    pose: Pose


@dataclass(frozen=True)
class RobotLink:
    """A link of the robot.

    ``inertia``: Ixx, Ixy, Ixz, Iyy, Iyz, Izz about the mass centre, in the axes of ``centre``.
    """

    name: str
    mass: Number = 0
    centre: Pose = Pose()
    inertia: tuple[Number, ...] = (0,) * 6
    visuals: tuple[Visual, ...] = ()


@dataclass(frozen=True)
class Mimic:
    """A position that follows another joint: ``multiplier`` times its position plus ``offset``."""

    joint: str
    multiplier: Number = 1
    offset: Number = 0


@dataclass(frozen=True)
class RobotJoint:
    """A joint; ``axis`` has length one, in the axes of ``origin``, the place on the parent.

    ``limits``: those that it has of ``lower`` and ``upper`` position, ``velocity`` and ``effort``.
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


@dataclass(frozen=True)
class Robot:
    """A robot: a tree of links, ``joints`` from its root outwards."""

    name: str
    links: dict[str, RobotLink]
    joints: tuple[RobotJoint, ...]
    root: str = ""
