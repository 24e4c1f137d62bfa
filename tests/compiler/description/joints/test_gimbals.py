"""Where two of three angles turn a body about the same axis."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import pytest
from mechc_codegen.description.joints.gimbals import gimbals
from mechc_codegen.frontend.sympy_joints import from_joints
from sympy.physics.mechanics import (
    PinJoint,
    RigidBody,
    SphericalJoint,
    dynamicsymbols,
    inertia,
)

A, B, C = dynamicsymbols("a b c")


def found(*joints: Any, ground: RigidBody) -> Any:
    return list(gimbals(from_joints("turned", joints, ground=ground)))


def bodies(*masses: Any) -> list[RigidBody]:
    every = [RigidBody("ground")]
    for k, mass in enumerate(masses):
        body = RigidBody(f"body_{k}", mass=mass)
        body.central_inertia = mass * inertia(body.frame, 1, 2, 3)
        every.append(body)
    return every


@pytest.mark.parametrize(
    ("order", "determinant"), [("XYZ", (1, 0, 0)), ("ZXZ", (0, 1, 0)), ("YZY", (0, 1, 0))]
)
def test_a_ball_joint_of_three_angles(order, determinant) -> None:
    """By the textbook the lock is at cos b = 0 with three axes, at sin b = 0 with two."""
    ground, body = bodies(1)
    speeds = dynamicsymbols("u_1:4")
    joint = SphericalJoint(
        "ball", ground, body, [A, B, C], speeds, amounts=[A, B, C], rot_order=order
    )
    (gimbal,) = found(joint, ground=ground)
    assert gimbal.middle == B
    assert set(gimbal.angles) == {A, B, C}
    assert [abs(x) for x in gimbal.determinant] == pytest.approx(determinant, abs=1e-12)


def pins(*every: RigidBody) -> list[PinJoint]:
    joints = []
    for k, (parent, child) in enumerate(pairwise(every)):
        axis = (parent.z, parent.x + parent.z, parent.z)[k]
        states = (A, B, C)[k], dynamicsymbols(f"v_{k}")
        joints.append(PinJoint(f"pin_{k}", parent, child, *states, joint_axis=axis))
    return joints


def test_links_with_inertia_between_have_no_lock() -> None:
    ground, *links = bodies(1, 1, 1)
    assert not found(*pins(ground, *links), ground=ground)


def test_two_angles_have_no_lock() -> None:
    ground, *links = bodies(1, 1)
    assert not found(*pins(ground, *links), ground=ground)
