"""Modelica's bodies on springs, in constraints and on arms, written with joints and cuts."""

from functools import cache

import numpy as np
from scipy.spatial.transform import Rotation
from sympy import Rational, pi, symbols
from sympy.physics.mechanics import (
    Force,
    ForceActuator,
    LinearPathway,
    PinJoint,
    PrismaticJoint,
    ReferenceFrame,
    RigidBody,
    Torque,
    inertia,
)

import mechc

from .loops import CYCLIC, Example, G, box, member, vector
from .wheels import ELEMENTARY

CONSTRAINTS = "Modelica/Mechanics/MultiBody/Examples/Constraints/"
EFFECTS = "Modelica/Mechanics/MultiBody/Examples/Rotational3DEffects/"
SEAT = (0.2, -0.3, 0.2)
SEAT_TURN = Rotation.from_euler("XYZ", (10, 55, 68), degrees=True)


def _spring(world, place, point, stiffness, relaxed=0, damping=0):
    """A spring and damper from a place of the world to a point of a body."""
    held = world.masscenter.locatenew(f"held_{point.name}", place)
    held.set_vel(world.frame, 0)
    path = LinearPathway(held, point)
    pull = -stiffness * (path.length - relaxed)
    if damping != 0:
        pull -= damping * path.extension_velocity
    return ForceActuator(pull, path).to_loads()


def _turned_as(rotation, joint):
    """A quaternion as a start of the joint."""
    quaternion = rotation.as_quat()[[3, 0, 1, 2]]
    return {f"q{k}_{joint}": float(e) for k, e in enumerate(quaternion)}


def _unit_body(moment=1):
    world, body = RigidBody("world"), RigidBody("body", mass=1)
    body.central_inertia = inertia(body.frame, moment, moment, moment)
    return world, body


@cache
def sprung():
    """A free body on a spring and damper at its first frame, and a spring 0.4 m along x."""
    c_x, c_y, moment, p, k1, l1, d1, k2 = symbols("c_x c_y J p k1 l1 d1 k2")
    world, body = _unit_body(moment)
    to_frame = -c_x * body.x - c_y * body.y
    free = mechc.FreeJoint("free", world, body, child_point=to_frame)
    first = body.masscenter.locatenew("first", to_frame)
    second = body.masscenter.locatenew("second", to_frame + Rational(2, 5) * body.x)
    mechanism = mechc.from_joints(
        "sprung",
        [free],
        gravity=-G * world.y,
        loads=[
            *_spring(world, p * world.x, first, k1, l1, d1),
            *_spring(world, Rational(4, 5) * world.x, second, k2),
        ],
        parameters=dict.fromkeys((c_x, c_y, moment, p, k1, l1, d1, k2), 0.0),
    )
    velocity = first.pos_from(world.masscenter).dt(world.frame).to_matrix(world.frame)
    return mechc.compile(mechanism, outputs=({f"v{n}": velocity[n] for n in range(3)},))


def _constrained(name, cut, arm=(0.4, 0, 0)):
    """A free body in a cut at its first frame, and a spring of 20 N/m to a point of it."""
    world, body = _unit_body()
    seat = ReferenceFrame("seat")
    seat.orient_body_fixed(world.frame, [float(np.deg2rad(a)) for a in (10, 55, 68)], "XYZ")
    to_frame = -body.x / 5
    free = mechc.FreeJoint("free", world, body, child_point=to_frame)
    eye = body.masscenter.locatenew("eye", to_frame + vector(body.frame, arm))
    joint = cut(world, body, vector(world.frame, SEAT), to_frame, seat)
    mechanism = mechc.from_joints(
        name,
        [free, joint],
        gravity=-G * world.y,
        loads=_spring(world, vector(world.frame, (0.8, 0, 0.3)), eye, 20),
    )
    return mechc.compile(mechanism, outputs=())


@cache
def in_a_pin():
    return _constrained(
        "in_a_pin",
        lambda world, body, place, arm, seat: mechc.Cut.pin(
            "seated",
            world,
            body,
            parent_point=place,
            child_point=arm,
            parent_interframe=seat,
            joint_axis=seat.y,
        ),
    )


@cache
def in_a_ball():
    return _constrained(
        "in_a_ball",
        lambda world, body, place, arm, seat: mechc.Cut.spherical(
            "seated", world, body, parent_point=place, child_point=arm
        ),
    )


@cache
def in_a_cross():
    def cut(world, body, place, arm, seat):
        first, second = ReferenceFrame("first"), ReferenceFrame("second")
        first.orient_dcm(seat, CYCLIC.T)  # x of the cross is z of the seat
        second.orient_dcm(body.frame, CYCLIC.T)  # y of the cross is x of the body
        return mechc.Cut.universal(
            "seated",
            world,
            body,
            parent_point=place,
            child_point=arm,
            parent_interframe=first,
            child_interframe=second,
        )

    return _constrained("in_a_cross", cut, (0.5, 0.15, 0.2))


@cache
def on_two_slides():
    """The body slides along x and y of the seat, between them a massless carriage."""
    world, body = _unit_body()
    carriage = RigidBody("carriage", mass=0)
    carriage.central_inertia = inertia(carriage.frame, 0, 0, 0)
    seat = ReferenceFrame("seat")
    seat.orient_body_fixed(world.frame, [float(np.deg2rad(a)) for a in (10, 55, 68)], "XYZ")
    along_x = PrismaticJoint(
        "along_x",
        world,
        carriage,
        parent_point=vector(world.frame, SEAT),
        parent_interframe=seat,
        joint_axis=seat.x,
    )
    along_y = PrismaticJoint(
        "along_y", carriage, body, child_point=-body.x / 5, joint_axis=carriage.y
    )
    eye = body.masscenter.locatenew("eye", body.x / 5)
    mechanism = mechc.from_joints(
        "on_two_slides",
        [along_x, along_y],
        gravity=-G * world.y,
        loads=_spring(world, vector(world.frame, (0.8, 0, 0.3)), eye, 20),
    )
    frame = body.masscenter.locatenew("frame", -body.x / 5)
    place = frame.pos_from(world.masscenter)
    outputs = {f"r{n}": place.dot(e) for n, e in enumerate(world.frame)}
    outputs |= {f"v{n}": place.dt(world.frame).dot(e) for n, e in enumerate(world.frame)}
    return mechc.compile(mechanism, outputs=(outputs,))


@cache
def gyroscope():
    """An arm on a ball, and a rotor on it whose axis is 45 degrees aslant."""
    world = RigidBody("world")
    arm, half = member("arm", (0.25, 0, 0), 0.05)
    rotor, _ = member("rotor", (0.2, 0, 0), 0.1)
    aslant = ReferenceFrame("aslant")
    aslant.orient_axis(arm.frame, pi / 4, arm.y)
    ball = mechc.BallJoint("ball", world, arm, child_point=-half)
    axle = PinJoint(
        "axle",
        arm,
        rotor,
        parent_point=half,
        parent_interframe=aslant,
        joint_axis=aslant.x,
    )
    mechanism = mechc.from_joints("gyroscope", [ball, axle], gravity=-G * world.y)
    spin = rotor.frame.ang_vel_in(world.frame)
    outputs = {f"w{n}": spin.dot(e) for n, e in enumerate(rotor.frame)}
    return mechc.compile(mechanism, outputs=(outputs,))


def _bar(name, length, width):
    body = RigidBody(name)
    mass, _, _, moment = box(length, width, width)
    body.mass, body.central_inertia = mass, inertia(body.frame, 0, 0, moment)
    return body


@cache
def double_pendulum():
    """Two boxes of steel and a damper at the first pin."""
    world, first, second = RigidBody("world"), _bar("first", 0.5, 0.06), _bar("second", 0.5, 0.06)
    upper = PinJoint("upper", world, first, child_point=-first.x / 4, joint_axis=world.z)
    lower = PinJoint(
        "lower",
        first,
        second,
        parent_point=first.x / 4,
        child_point=-second.x / 4,
        joint_axis=first.z,
    )
    damper = Torque(first, -Rational(1, 10) * upper.speeds[0] * world.z)
    mechanism = mechc.from_joints(
        "double_pendulum", [upper, lower], gravity=-G * world.y, loads=[damper]
    )
    return mechc.compile(mechanism, outputs=())


@cache
def sprung_pendulum():
    """A body that slides along a massless arm, on a spring and a damper."""
    world, body = _unit_body()
    arm = RigidBody("arm", mass=0)
    arm.central_inertia = inertia(arm.frame, 0, 0, 0)
    pin = PinJoint("pin", world, arm, joint_axis=world.z)
    slide = PrismaticJoint("slide", arm, body, joint_axis=arm.x)
    pull = -20 * (slide.coordinates[0] - Rational(1, 5)) - slide.speeds[0]
    loads = [Force(body.masscenter, pull * arm.x)]  # its other end is at rest
    mechanism = mechc.from_joints(
        "sprung_pendulum", [pin, slide], gravity=-G * world.y, loads=loads
    )
    return mechc.compile(mechanism, outputs=())


@cache
def telescope():
    """An arm of steel on a damper of two tubes, each a mass of 1 kg 0.2 m from its end."""
    world, arm = RigidBody("world"), _bar("arm", 0.7, 0.035)
    lower, upper = RigidBody("lower", mass=1), RigidBody("upper", mass=1)
    for tube in (lower, upper):
        tube.central_inertia = inertia(tube.frame, 0, 0, 0)
    shoulder = PinJoint(
        "shoulder",
        world,
        arm,
        parent_point=Rational(3, 10) * world.y,
        child_point=-Rational(7, 20) * arm.x,
        joint_axis=world.z,
    )
    foot = PinJoint(
        "foot",
        world,
        lower,
        parent_point=-Rational(9, 10) * world.y,
        child_point=-lower.x / 5,
        joint_axis=world.z,
    )
    stroke = PrismaticJoint("stroke", lower, upper, joint_axis=lower.x)
    hand = mechc.Cut.pin(
        "hand",
        upper,
        arm,
        parent_point=upper.x / 5,
        child_point=Rational(7, 20) * arm.x,
        joint_axis=upper.z,
    )
    pull = -3 * stroke.speeds[0] * lower.x
    mechanism = mechc.from_joints(
        "telescope",
        [shoulder, foot, stroke, hand],
        gravity=-G * world.y,
        loads=[Force(upper.masscenter, pull), Force(lower.masscenter, -pull)],
    )
    return mechc.compile(mechanism, outputs=())


def _spins(body, *axes):
    names = {1: "wx_free", 2: "wy_free", 3: "wz_free"}
    return {f"{body}.body.w_a[{n}]": names[n] for n in axes or names}


def _in_constraint(name, scene):
    start = dict(zip(("x_free", "y_free", "z_free"), SEAT, strict=True))
    start |= _turned_as(SEAT_TURN, "free")
    return Example(CONSTRAINTS + name, scene, _spins("bodyOfConstraint"), 10.0, start=start)


_FRAME = {f"frame_a.r_0[{n + 1}]": f"{axis}_free" for n, axis in enumerate("xyz")}  # of a free body
_SPEEDS = {f"v_0[{n + 1}]": f"v{n}" for n in range(3)}
_SPIN = {f"w_a[{n + 1}]": f"w{axis}_free" for n, axis in enumerate("xyz")}

EXAMPLES = [
    Example(
        ELEMENTARY + "FreeBody",
        sprung,
        {"body.body." + name: here for name, here in (_FRAME | _SPIN).items()}
        | {"body." + name: here for name, here in _SPEEDS.items()},
        10.0,
        {"c_x": 0.2, "J": 1.0, "p": 0.0, "k1": 20.0, "k2": 20.0},
        {"x_free": 0.2, "y_free": -0.5, "z_free": 0.1}
        | _turned_as(Rotation.from_euler("XYZ", 3 * [0.174532925199433]), "free"),
    ),
    Example(
        ELEMENTARY + "SpringDamperSystem",
        sprung,
        {"body1." + name: here for name, here in (_FRAME | _SPIN | _SPEEDS).items()},
        10.0,
        {"c_y": -0.2, "J": 0.1, "p": 0.3, "k1": 30.0, "l1": 0.1, "d1": 2.0},
        {"x_free": 0.3, "y_free": -0.2, "z_free": 0.0} | _turned_as(Rotation.identity(), "free"),
        {"wz_free": 0.03490658503988659},
    ),
    _in_constraint("RevoluteConstraint", in_a_pin),
    _in_constraint("SphericalConstraint", in_a_ball),
    _in_constraint("UniversalConstraint", in_a_cross),
    Example(
        CONSTRAINTS + "PrismaticConstraint",
        on_two_slides,
        {f"bodyOfConstraint.r_0[{n + 1}]": f"r{n}" for n in range(3)}
        | {f"bodyOfConstraint.v_0[{n + 1}]": f"v{n}" for n in range(3)}
        | {f"jointPrismatic_{x}.s": f"q_along_{x}" for x in "xy"}
        | {f"jointPrismatic_{x}.v": f"u_along_{x}" for x in "xy"},
        10.0,
    ),
    Example(
        EFFECTS + "GyroscopicEffects",
        gyroscope,
        {f"bodyCylinder2.body.w_a[{n + 1}]": f"w{n}" for n in range(3)}
        | {f"bodyCylinder3.body.w_a[{n + 1}]": f"w{axis}_ball" for n, axis in enumerate("xyz")}
        | {"revolute.phi": "q_axle", "revolute.w": "u_axle"},
        5.0,
        speeds={"u_axle": 10.0},
    ),
    Example(
        ELEMENTARY + "DoublePendulum",
        double_pendulum,
        {"revolute1.phi": "q_upper", "revolute1.w": "u_upper"}
        | {"revolute2.phi": "q_lower", "revolute2.w": "u_lower"},
        3.0,
    ),
    Example(
        ELEMENTARY + "PendulumWithSpringDamper",
        sprung_pendulum,
        {"revolute.phi": "q_pin", "revolute.w": "u_pin"}
        | {"prismatic.s": "q_slide", "prismatic.v": "u_slide"},
        10.0,
        start={"q_slide": 0.5},
    ),
    Example(
        ELEMENTARY + "LineForceWithTwoMasses",
        telescope,
        {"revolute1.phi": "q_shoulder", "revolute1.w": "u_shoulder"}
        | {"revolute2.phi": "q_shoulder", "revolute2.w": "u_shoulder"},
        3.0,
        start={"q_shoulder": 0.0},
        speeds={"u_shoulder": 0.0},
        guess={
            "q_foot": float(np.arctan2(1.2, 0.7)),
            "q_stroke": float(np.hypot(0.7, 1.2)) - 0.4,
        },
    ),
]
