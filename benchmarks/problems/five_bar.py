"""The five-bar: four moving rods in a ring, two degrees of freedom."""

from __future__ import annotations

from mechc_codegen.description.joints.cuts import Cut
from mechc_codegen.description.mechanism import Mechanism
from mechc_codegen.frontend.sympy_joints import from_joints
from sympy import Expr, Integer, Rational, symbols
from sympy.physics.mechanics import PinJoint, RigidBody, dynamicsymbols, inertia
from sympy.physics.vector import Vector

FREE_FALL = Rational(981, 100)


def rod(name: str, length: Expr) -> RigidBody:
    """A rod of 1 kg along its x axis, thick enough to turn about it."""
    body = RigidBody(name, mass=1)
    about = length**2 / Integer(12)
    body.central_inertia = inertia(body.frame, length**2 / Integer(50), about, about)
    return body


def five_bar() -> Mechanism:
    """Four moving rods of lengths a, b, c, d in a ring, ground pivots g apart: two freedoms."""
    ground = at = RigidBody("ground")
    place: Vector = 0 * ground.x
    joints: list[PinJoint | Cut] = []
    for k, length in enumerate(symbols("a b c d")):
        body = rod(f"rod_{k}", length)
        joints.append(
            PinJoint(
                f"pin_{k}", at, body, *dynamicsymbols(f"q_{k} u_{k}"), place,
                -length / 2 * body.x, joint_axis=at.z,
            )
        )  # fmt: skip
        at, place = body, length / 2 * body.x
    far = symbols("g") * ground.x
    joints.append(Cut.pin("end", ground, at, far, place, joint_axis=ground.z))
    return from_joints(
        "five_bar", joints, gravity=-FREE_FALL * ground.y,
        parameters=dict.fromkeys("abcdg", 1.0), ground=ground,
    )  # fmt: skip
