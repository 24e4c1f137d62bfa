"""Loops that move though the count of their constraints says they cannot, and loops in a row."""

from __future__ import annotations

from collections.abc import Sequence

from mechc_codegen.description.joints.cuts import Cut
from mechc_codegen.description.mechanism import Mechanism
from mechc_codegen.frontend.sympy_joints import from_joints
from sympy import Expr, Integer, Rational, pi, symbols
from sympy.physics.mechanics import (
    PinJoint,
    RigidBody,
    SphericalJoint,
    dynamicsymbols,
)
from sympy.physics.vector import Vector

from benchmarks.problems.five_bar import FREE_FALL, rod

Link = tuple[Expr, Expr]  # length, and the angle between the axes at its ends


def single_loop(name: str, links: Sequence[Link], gravity: Sequence[int | Expr]) -> Mechanism:
    """Links in a ring, joined by pins; the last link is the ground, its far pin is cut."""
    ground = at = RigidBody("ground")
    length, angle = links[-1]
    place: Vector = length * ground.x
    joints: list[PinJoint | Cut] = []
    for k, link in enumerate(links[:-1]):
        body = rod(f"rod_{k}", link[0])
        axis = at.frame.orientnew(f"axis_{k}", "Axis", (angle, at.x))
        joints.append(
            PinJoint(
                f"pin_{k}", at, body, *dynamicsymbols(f"q_{k} u_{k}"), place,
                -link[0] / 2 * body.x, parent_interframe=axis, joint_axis=axis.z,
            )
        )  # fmt: skip
        at, place, (length, angle) = body, link[0] / 2 * body.x, link
    axis = at.frame.orientnew("axis", "Axis", (angle, at.x))
    joints.append(
        Cut.pin(
            "last", at, ground, place, 0 * ground.x, joint_axis=axis.z,
            parent_interframe=axis, child_interframe=ground.frame,
        )
    )  # fmt: skip
    weight = sum((g * e for g, e in zip(gravity, (ground.x, ground.y, ground.z), strict=True)), 0)
    return from_joints(name, joints, gravity=weight, parameters={}, ground=ground)


def bennett() -> Mechanism:
    """Four links; lengths 2 and 1 as the sines of the angles of their axes, 90 and 30 degrees."""
    links = [(Integer(2), pi / 2), (Integer(1), pi / 6)] * 2
    return single_loop("bennett", links, (0, -FREE_FALL, -1))


def spatial_four_bar() -> Mechanism:
    """Crank and rocker on skew axes, and between them a coupler on two balls, which may spin."""
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
        SphericalJoint(
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


def bricard() -> Mechanism:
    """Six links of length 1 between axes at right angles, to the left and to the right in turn."""
    links = [(Integer(1), pi / 2), (Integer(1), -pi / 2)] * 3
    return single_loop("bricard", links, (0, -FREE_FALL, 0))


def parallel_cranks(count: int) -> Mechanism:
    """Cranks of length c on pivots d apart, their ends on one bar: a pendulum."""
    ground = RigidBody("ground")
    c, d = symbols("c d")
    bar = rod("bar", (count - 1) * d)
    cranks = [rod(f"crank_{k}", c) for k in range(count)]

    def pin(name: str, parent: RigidBody, child: RigidBody, at: Vector, of: Vector) -> PinJoint:
        q, u = dynamicsymbols(f"q_{name} u_{name}")
        return PinJoint(name, parent, child, q, u, at, of, joint_axis=parent.z)

    joints: list[PinJoint | Cut] = [
        pin(crank.name, ground, crank, k * d * ground.x, -c / 2 * crank.x)
        for k, crank in enumerate(cranks)
    ]
    along = [(k - Rational(count - 1, 2)) * d * bar.x for k in range(count)]
    joints.append(pin("bar", cranks[0], bar, c / 2 * cranks[0].x, along[0]))
    for k in range(1, count):
        joints.append(
            Cut.pin(
                f"end_{k}", cranks[k], bar, c / 2 * cranks[k].x, along[k], joint_axis=cranks[k].z
            )
        )
    return from_joints(
        "cranks", joints, gravity=-FREE_FALL * ground.y, parameters={"c": 1.0, "d": 1.0},
        ground=ground,
    )  # fmt: skip
