"""A Stewart platform: six legs, each a universal joint, a slider and a ball on the platform.

The tree goes up the first leg; the other five end in cut balls: 21 coordinates, 15 constraints.
"""

from __future__ import annotations

from math import cos, pi, sin

import numpy as np
from mechc_codegen.description.joints.cuts import Cut
from mechc_codegen.description.mechanism import Mechanism
from mechc_codegen.frontend.sympy_joints import from_joints
from numpy.typing import NDArray
from sympy import Float, Rational
from sympy.physics.mechanics import (
    PinJoint,
    PrismaticJoint,
    RigidBody,
    SphericalJoint,
    dynamicsymbols,
    inertia,
)
from sympy.physics.vector import Vector

BASE, TOP = 1.0, 0.6  # m, radii of the joints' circles
BASE_ANGLES = [pi / 3 * (2 * (k // 2)) + (0.2 if k % 2 else -0.2) for k in range(6)]
TOP_ANGLES = [pi / 3 * (2 * (k // 2)) + (0.8 if k % 2 else -0.8) for k in range(6)]
LEG = Rational(1, 2)  # m, from the universal joint to the middle of the cylinder


def on_circle(body: RigidBody, radius: float, angle: float) -> Vector:
    return Float(radius * cos(angle)) * body.x + Float(radius * sin(angle)) * body.y


def stewart() -> Mechanism:
    ground = RigidBody("ground")
    platform = RigidBody("platform", mass=10)
    platform.central_inertia = inertia(platform.frame, 1, 1, 2)
    joints: list[PinJoint | PrismaticJoint | SphericalJoint | Cut] = []
    for k in range(6):
        cross, cylinder, rod = (RigidBody(f"{n}_{k}", mass=1) for n in ("cross", "cylinder", "rod"))
        for body in (cross, cylinder, rod):
            body.central_inertia = inertia(body.frame, *[Rational(1, 20)] * 3)
        foot = on_circle(ground, BASE, BASE_ANGLES[k])
        head = on_circle(platform, TOP, TOP_ANGLES[k])
        joints += [
            PinJoint(
                f"a_{k}", ground, cross, *dynamicsymbols(f"a_{k} da_{k}"), foot, 0 * cross.x,
                joint_axis=ground.x,
            ),
            PinJoint(
                f"b_{k}", cross, cylinder, *dynamicsymbols(f"b_{k} db_{k}"), 0 * cross.x,
                -LEG * cylinder.z, joint_axis=cross.y,
            ),
            PrismaticJoint(
                f"s_{k}", cylinder, rod, *dynamicsymbols(f"s_{k} ds_{k}"), 0 * cylinder.x,
                0 * rod.x, joint_axis=cylinder.z,
            ),
        ]  # fmt: skip
        if k:
            joints.append(Cut.spherical(f"ball_{k}", rod, platform, 0 * rod.x, head))
        else:
            q = dynamicsymbols("q_0:3")
            u = dynamicsymbols("u_0:3")
            joints.append(SphericalJoint("ball_0", rod, platform, q, u, 0 * rod.x, head))
    return from_joints(
        "stewart", joints, gravity=-Rational(981, 100) * ground.z, parameters={}, ground=ground
    )


def pose(height: float = 1.2, turn: float = 0.1, tilt: float = 0.15) -> dict[str, float]:
    """Coordinates by name with the platform turned about z, tilted about x, and at a height."""
    place = np.array([0.05, -0.03, height])
    platform = _about(2, turn) @ _about(0, tilt)
    found: dict[str, float] = {}
    for k in range(6):
        foot, head = (
            radius * np.array([cos(angle), sin(angle), 0.0])
            for radius, angle in ((BASE, BASE_ANGLES[k]), (TOP, TOP_ANGLES[k]))
        )
        leg = place + platform @ head - foot
        length = float(np.linalg.norm(leg))
        a, b = float(np.arctan2(-leg[1], leg[2])), float(np.arcsin(leg[0] / length))
        found |= {f"a_{k}": a, f"b_{k}": b, f"s_{k}": length - float(LEG)}
        if not k:
            ball = (_about(0, a) @ _about(1, b)).T @ platform
            found["q_0"] = float(np.arctan2(-ball[1, 2], ball[2, 2]))
            found["q_1"] = float(np.arcsin(ball[0, 2]))
            found["q_2"] = float(np.arctan2(-ball[0, 1], ball[0, 0]))
    return found


def _about(axis: int, angle: float) -> NDArray[np.float64]:
    """The rotation matrix about a coordinate axis."""
    first, second = (axis + 1) % 3, (axis + 2) % 3
    turned = np.eye(3)
    turned[first, first] = turned[second, second] = cos(angle)
    turned[second, first], turned[first, second] = sin(angle), -sin(angle)
    return turned
