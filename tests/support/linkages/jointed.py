"""Mechanisms described by SymPy's joints and cuts: chains, and a four-bar cut at any joint."""

from __future__ import annotations

from mechc_codegen.description.joints.cuts import Cut
from mechc_codegen.description.mechanism import Mechanism
from mechc_codegen.frontend.sympy_joints import from_joints
from sympy import Symbol, symbols
from sympy.physics.mechanics import (
    PinJoint,
    PrismaticJoint,
    RigidBody,
    SphericalJoint,
    dynamicsymbols,
    inertia,
)

m, l, g = Symbol("m"), Symbol("l"), Symbol("g")
CHAIN = {"m": 1.3, "l": 0.7, "g": 9.81}


def rod(name: str, mass: Symbol = m, length: Symbol = l) -> RigidBody:
    """A rod along its x axis, thick enough to turn about it."""
    body = RigidBody(name, mass=mass)
    about = mass * length**2 / 12
    body.central_inertia = inertia(body.frame, mass * length**2 / 50, about, about)
    return body


def chain_joints(count: int, *, spatial: bool = False) -> tuple[RigidBody, list[PinJoint]]:
    """The ground, and pins from rod to rod; spatial: about y and z in turn."""
    ground = at = RigidBody("ground")
    joints = []
    for k in range(count):
        body = rod(f"rod_{k}")
        joints.append(
            PinJoint(
                f"pin_{k}", at, body, *dynamicsymbols(f"q_{k} u_{k}"),
                parent_point=None if at is ground else l / 2 * at.x,
                child_point=-l / 2 * body.x,
                joint_axis=at.y if spatial and k % 2 else at.z,
            )
        )  # fmt: skip
        at = body
    return ground, joints


def tree(branches: int, depth: int) -> Mechanism:
    """A hub that slides along x, and chains of rods on it about axes in turn."""
    ground = RigidBody("ground")
    hub = rod("hub")
    q, u = dynamicsymbols("q_h u_h")
    joints: list[PinJoint | PrismaticJoint] = [
        PrismaticJoint("slide", ground, hub, q, u, joint_axis=ground.x)
    ]
    for b in range(branches):
        at, place = hub, (b + 1) * l / 4 * hub.y
        for k in range(depth):
            body = rod(f"rod_{b}{k}")
            q, u = dynamicsymbols(f"q_{b}{k} u_{b}{k}")
            joints.append(
                PinJoint(
                    f"pin_{b}{k}", at, body, q, u, place, -l / 2 * body.x,
                    joint_axis=(at.x, at.y, at.z)[(b + 2 * k) % 3],
                )
            )  # fmt: skip
            at, place = body, l / 2 * body.x
    return from_joints("tree", joints, gravity=-g * ground.y, parameters=CHAIN)


def chain(count: int, *, spatial: bool = False) -> Mechanism:
    ground, joints = chain_joints(count, spatial=spatial)
    return from_joints("chain", joints, gravity=-g * ground.y, parameters=CHAIN)


# -- the four-bar ---------------------------------------------------------------------------------

LENGTHS, MASSES = symbols("l_0:4"), symbols("m_0:3")
FOUR_BAR = (
    {"g": 9.81} | {f"l_{k}": k + 1.0 for k in range(4)} | {f"m_{k}": k + 1.0 for k in range(3)}
)
PINS = ("J_0", "J_1", "J_2", "J_3")


def four_bar(cut: int = 3) -> Mechanism:
    """Rods 0, 1, 2 between the ground pivots J_0 and J_3, in relative angles, cut at one pin.

    Whichever is cut, pin k has rod k for its child, and J_3 has rod 2.
    """
    ground = RigidBody("ground")
    rods = [rod(f"rod_{k}", MASSES[k], LENGTHS[k]) for k in range(3)]
    start = [-LENGTHS[k] / 2 * rods[k].x for k in range(3)]
    end = [LENGTHS[k] / 2 * rods[k].x for k in range(3)]
    sides = [
        (ground, rods[0], None, start[0]),
        (rods[0], rods[1], end[0], start[1]),
        (rods[1], rods[2], end[1], start[2]),
        (ground, rods[2], LENGTHS[3] * ground.x, end[2]),
    ]

    def joint(k: int) -> PinJoint | Cut:
        parent, child, *points = sides[k]
        if k == cut:
            return Cut.pin(PINS[k], parent, child, *points, joint_axis=parent.z)
        q, u = dynamicsymbols(f"q_{k} u_{k}")
        return PinJoint(PINS[k], parent, child, q, u, *points, joint_axis=parent.z)

    # From the ground outwards on both sides of the cut, as SymPy orients frames.
    joints = [joint(k) for k in (*range(cut), *range(3, cut, -1), cut)]
    return from_joints(
        f"four_bar_{cut}", sorted(joints, key=lambda j: j.name),
        gravity=-g * ground.y, parameters=FOUR_BAR, ground=ground,
    )  # fmt: skip


# -- a loop in space ------------------------------------------------------------------------------


def spatial_four_bar() -> Mechanism:
    """Two levers on skew pins and a rod between balls; the second pin is cut, five rows."""
    ground, lever, coupler, rocker = (RigidBody("ground"), rod("lever"), rod("rod"), rod("rocker"))
    near = {body: -l / 2 * body.x for body in (lever, coupler, rocker)}
    far = {body: l / 2 * body.x for body in (lever, coupler, rocker)}
    pivot, skew = l * ground.x + l / 3 * ground.y, ground.z + ground.x
    joints = [
        PinJoint("first", ground, lever, child_point=near[lever], joint_axis=ground.z),
        SphericalJoint("ball_1", lever, coupler, None, None, far[lever], near[coupler]),
        SphericalJoint("ball_2", coupler, rocker, None, None, far[coupler], far[rocker]),
        Cut.pin("second", ground, rocker, pivot, near[rocker], skew, rocker.z),
    ]
    return from_joints("spatial", joints, gravity=-g * ground.y, parameters=CHAIN)
