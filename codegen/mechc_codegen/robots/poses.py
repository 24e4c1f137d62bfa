"""Poses of a file -> places, and places of numbers -> poses."""

from __future__ import annotations

from math import atan2, hypot

from mechc_codegen.description.placement import product
from mechc_codegen.robots.geometry import Place, about, of_angles
from mechc_codegen.robots.robot import Pose


def place_of(pose: Pose) -> Place:
    return Place(of_angles(pose.rpy), pose.xyz)


def pose_of(place: Place) -> Pose:
    """The pose of a place of numbers.

    Pitch and yaw are those of the rotation after the roll, which is inaccurate where the pitch is a
    right angle; together they are accurate.
    """
    roll = atan2(place.rotation[2][1], place.rotation[2][2])
    r = product(place.rotation, about((1, 0, 0), -roll))
    pitch = atan2(-r[2][0], hypot(r[0][0], r[1][0]))
    x, y, z = place.origin
    return Pose((x, y, z), (roll, pitch, atan2(-r[0][1], r[1][1])))
