"""Loops of rods: the five-bar, and loops that move though the count of their constraints says they
cannot."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType

from mechc_codegen.description.joints.cuts import Cut
from mechc_codegen.description.mechanism import Mechanism
from mechc_codegen.frontend.sympy_joints import from_joints
from sympy import Expr, Integer, Rational, pi, symbols
from sympy.physics.mechanics import PinJoint, RigidBody, dynamicsymbols, inertia
from sympy.physics.vector import Vector

FREE_FALL = Rational(981, 100)
Link = tuple[Expr, Expr]  # length, and the angle between the axes at its ends
BENNETT: Sequence[Link] = [(Integer(2), pi / 2), (Integer(1), pi / 6)] * 2
BRICARD: Sequence[Link] = [(Integer(1), pi / 2), (Integer(1), -pi / 2)] * 3
BENNETT_WEIGHT, BRICARD_WEIGHT = (0, -FREE_FALL, -1), (0, -FREE_FALL, 0)


def bennett() -> Mechanism:
    """Four links; lengths 2 and 1 as the sines of the angles of their axes, 90 and 30 degrees."""
    return single_loop("bennett", BENNETT, BENNETT_WEIGHT)


def bricard() -> Mechanism:
    """Six links of length 1 between axes at right angles, to the left and to the right in turn."""
    return single_loop("bricard", BRICARD, BRICARD_WEIGHT)


def five_bar() -> Mechanism:
    """Four moving rods of lengths a, b, c, d in a ring, ground pivots g apart: two freedoms."""
    *rods, g = symbols("a b c d g")
    links = [(length, Integer(0)) for length in (*rods, -g)]
    return single_loop("five_bar", links, BRICARD_WEIGHT, dict.fromkeys("abcdg", 1.0))


def rod(name: str, length: Expr) -> RigidBody:
    """A rod of 1 kg along its x axis, thick enough to turn about it."""
    body = RigidBody(name, mass=1)
    about = length**2 / Integer(12)
    body.central_inertia = inertia(body.frame, length**2 / Integer(50), about, about)
    return body


def single_loop(
    name: str, links: Sequence[Link], gravity: Sequence[int | Expr],
    parameters: Mapping[str, float] = MappingProxyType({}),
) -> Mechanism:  # fmt: skip
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
    return from_joints(name, joints, gravity=weight, parameters=dict(parameters), ground=ground)


def parallel_cranks(count: int) -> Mechanism:
    """Cranks of length c on pivots d apart, their ends on one bar: a pendulum."""
    ground = RigidBody("ground")
    c, d = symbols("c d")
    cranks = [rod(f"crank_{k}", c) for k in range(count)]
    joints = [
        _pin(crank, ground, k * d * ground.x, -c / 2 * crank.x) for k, crank in enumerate(cranks)
    ]
    bar = rod("bar", (count - 1) * d)
    joints += _joined(bar, cranks, [c / 2 * crank.x for crank in cranks], d)
    return _together("cranks", ground, joints)


def locomotive(count: int) -> Mechanism:
    """Wheels of radius c on axles d apart, with two rods, whose pins are a right angle apart.

    Where one rod is in line with its cranks, the other one takes the wheels on.
    """
    ground = RigidBody("ground")
    c, d = symbols("c d")
    wheels = [_wheel(f"wheel_{k}", c) for k in range(count)]
    joints = [_pin(wheel, ground, k * d * ground.x) for k, wheel in enumerate(wheels)]
    for side in range(2):
        bar, pins = rod(f"rod_{side}", (count - 1) * d), []
        for wheel in wheels:
            pins.append(c * (wheel.y if side else wheel.x))
        joints += _joined(bar, wheels, pins, d)
    return _together("locomotive", ground, joints)


def _wheel(name: str, radius: Expr) -> RigidBody:
    """A disc of 1 kg."""
    body, across = RigidBody(name, mass=1), radius**2 / Integer(4)
    body.central_inertia = inertia(body.frame, across, across, 2 * across)
    return body


def _pin(
    child: RigidBody, parent: RigidBody, at: Vector, of: Vector | None = None
) -> PinJoint | Cut:
    q, u = dynamicsymbols(f"q_{child.name} u_{child.name}")
    return PinJoint(child.name, parent, child, q, u, at, of, joint_axis=parent.z)


def _joined(
    bar: RigidBody, bodies: Sequence[RigidBody], pins: Sequence[Vector], apart: Expr
) -> list[PinJoint | Cut]:
    """A bar that hangs on the first of the bodies; its other pins are cut."""
    count = len(bodies)
    along = [(k - Rational(count - 1, 2)) * apart * bar.x for k in range(count)]
    cuts = [
        Cut.pin(f"{bar.name}_{k}", bodies[k], bar, pins[k], along[k], joint_axis=bodies[k].z)
        for k in range(1, count)
    ]
    return [_pin(bar, bodies[0], pins[0], along[0]), *cuts]


def _together(name: str, ground: RigidBody, joints: Sequence[PinJoint | Cut]) -> Mechanism:
    return from_joints(
        name, joints, gravity=-FREE_FALL * ground.y, parameters={"c": 1.0, "d": 1.0}, ground=ground
    )
