"""Spatial loops with balls."""

from __future__ import annotations

from mechc_codegen.description.constraints import Constraint
from mechc_codegen.description.joints.cuts import Cut
from mechc_codegen.description.mechanism import Mechanism
from mechc_codegen.frontend.sympy_joints import from_joints
from sympy import Float, Integer, Rational, Symbol
from sympy.physics.mechanics import PinJoint, RigidBody, SphericalJoint, dynamicsymbols, inertia

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


def platform_on_a_ball() -> Mechanism:
    """A platform on a ball and three rods, one of length r, in m, from a crank about z."""
    ground, crank, platform = (RigidBody(name) for name in ("ground", "crank", "platform"))
    for body in (crank, platform):
        body.mass = Float(2)
        body.central_inertia = inertia(body.frame, *3 * [Rational(1, 20)])
    joints = [
        PinJoint("crank", ground, crank, *dynamicsymbols("a da"), ground.x, joint_axis=ground.z),
        BallJoint("ball", ground, platform),
    ]
    from_joints("platform", joints, ground=ground)  # its points, for the rods
    length = Symbol("r")
    ends = [
        (crank.masscenter, 0.9 * crank.y, platform.x, length),
        (ground.masscenter, ground.z, platform.y, Float(1.3)),
        (ground.masscenter, ground.x + ground.y, platform.z, Float(1.6)),
    ]
    rods, loads = [], []
    for number, (at, place, held, size) in enumerate(ends):
        here = at.locatenew(f"from_{number}", place)
        there = platform.masscenter.locatenew(f"to_{number}", held)
        between = there.pos_from(here)
        gap = (between.dot(between) - size**2) / (2 * size)
        rods.append(Constraint(f"rod {number}", gap, "m"))
        loads.append((there, -ground.y))
    return from_joints(
        "platform",
        joints,
        loads=loads,
        parameters={length: 0.7},
        ground=ground,
        configuration_constraints=rods,
    )
