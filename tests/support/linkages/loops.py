"""A spatial loop with two balls."""

from __future__ import annotations

from mechc_codegen.description.joints.cuts import Cut
from mechc_codegen.description.mechanism import Mechanism
from mechc_codegen.frontend.sympy_joints import from_joints
from sympy import Integer, Rational
from sympy.physics.mechanics import PinJoint, RigidBody, SphericalJoint, dynamicsymbols

from benchmarks.problems.closed_loops import FREE_FALL, rod
from mechc import BallJoint


def spatial_four_bar(*, by_quaternion: bool = False) -> Mechanism:
    """Crank and rocker on skew axes, and between them a coupler on two balls, which may spin;
    ``by_quaternion``: its attitude is one, in place of three angles."""
    ground = RigidBody("ground")
    crank, coupler, rocker = (
        rod("crank", Integer(1)),
        rod("coupler", Rational(7, 2)),
        rod("rocker", Integer(2)),
    )
    middle = Rational(7, 4) * coupler.x
    joints = [
        PinJoint(
            "crank", ground, crank, *dynamicsymbols("a da"), 0 * ground.x, -crank.x / 2,
            joint_axis=ground.z,
        ),
        BallJoint("ball", crank, coupler, parent_point=crank.x / 2, child_point=-middle)
        if by_quaternion
        else SphericalJoint(
            "ball", crank, coupler, dynamicsymbols("q_0:3"), dynamicsymbols("u_0:3"), crank.x / 2,
            -middle,
        ),
        PinJoint(
            "rocker", ground, rocker, *dynamicsymbols("b db"), 2 * ground.x + ground.z, -rocker.x,
            joint_axis=ground.x + ground.z,
        ),
        Cut.spherical("end", coupler, rocker, middle, rocker.x),
    ]  # fmt: skip
    return from_joints(
        "spatial_four_bar", joints, gravity=-FREE_FALL * ground.y, parameters={}, ground=ground
    )
