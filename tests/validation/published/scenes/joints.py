"""The scenes of Chrono's tests of joints, written with SymPy's joints and mechc's.

A pendulum of 1 kg hangs from the ground by one joint, at a place and an attitude of the case.  A
case is a scene with values of its parameters and a start.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache

import numpy as np
from sympy import Abs, Rational, symbols
from sympy.physics.mechanics import (
    CylindricalJoint,
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

G = 9.80665
PLACE = symbols("a_x a_y a_z")
ATTITUDE = symbols("e_0 e_1 e_2 e_3")
ARM = LINE = 2  # m, from the joint to the mass centre; between the ends of a line
COS_45 = float(np.sqrt(0.5))


@dataclass(frozen=True)
class Case:
    """One case: its scene, values of the scene's parameters, and where it starts."""

    scene: Callable
    values: dict = field(default_factory=dict)
    start: dict = field(default_factory=dict)
    speeds: dict = field(default_factory=dict)


def _bodies(moments):
    ground, pendulum = RigidBody("ground"), RigidBody("pendulum", mass=1)
    pendulum.central_inertia = inertia(pendulum.frame, *map(Rational, moments))
    return ground, pendulum


def _seat(ground):
    """Where the ground carries the joint: a point, and a frame turned by a quaternion."""
    frame = ReferenceFrame("seat")
    frame.orient_quaternion(ground.frame, ATTITUDE)
    return sum((a * axis for a, axis in zip(PLACE, ground.frame, strict=True)), 0 * ground.x), frame


def _vector(name, vector, ground):
    """Its components along the ground's axes, as outputs."""
    return {f"{name}{k}": vector.dot(axis) for k, axis in enumerate(ground.frame)}


def _pose(ground, body, joint=None):
    """Outputs: the mass centre, the body's axes, and its point of the joint, from the ground."""
    place = body.masscenter.pos_from(ground.masscenter).to_matrix(ground.frame)
    axes = ground.frame.dcm(body.frame)
    outputs = {f"r{k}": place[k] for k in range(3)} | {
        f"R{k}{j}": axes[k, j] for k in range(3) for j in range(3)
    }
    if joint is not None:
        outputs |= _vector("p", joint.child_point.pos_from(ground.masscenter), ground)
    return outputs


def _compiled(name, joints, pose, values, outputs=("reactions",), **more):
    gravity = -G * joints[0].parent.z
    mechanism = mechc.from_joints(name, joints, gravity=gravity, parameters=values, **more)
    return mechc.compile(mechanism, outputs=(*outputs, pose))


def _seated(kind, moments=("0.04", "0.1", "0.1"), arm=(-ARM, 0, 0)):
    """One joint whose frame on the ground is the seat; the pendulum is turned as the seat is."""
    ground, pendulum = _bodies(moments)
    place, frame = _seat(ground)
    to_joint = sum((a * e for a, e in zip(arm, pendulum.frame, strict=True)), 0 * pendulum.x)
    points = {"parent_point": place, "child_point": to_joint, "parent_interframe": frame}
    along = {} if kind in (mechc.BallJoint, mechc.UniversalJoint) else {"joint_axis": frame.z}
    return ground, pendulum, kind("joint", ground, pendulum, **points, **along)


SEAT = dict.fromkeys([*PLACE, *ATTITUDE], 0.0) | {ATTITUDE[0]: 1.0}


@cache
def revolute():
    """A pin; with the spring and damper of the torsional cases, which the others set to zero."""
    k, n, c = symbols("k n c")
    ground, pendulum, pin = _seated(PinJoint)
    q, u = pin.coordinates[0], pin.speeds[0]
    spring = -(k + n * Abs(q)) * q - c * u
    loads = [Torque(pendulum, spring * pendulum.z), Torque(ground, -spring * pendulum.z)]
    values = SEAT | {k: 0.0, n: 0.0, c: 0.0}
    outputs = _pose(ground, pendulum, pin) | _vector("T", spring * pendulum.z, ground)
    return _compiled("revolute", [pin], outputs, values, loads=loads)


@cache
def spherical():
    ground, pendulum, ball = _seated(mechc.BallJoint)
    return _compiled("spherical", [ball], _pose(ground, pendulum, ball), SEAT)


@cache
def universal():
    ground, pendulum, cross = _seated(
        mechc.UniversalJoint, moments=("0.1", "0.1", "0.04"), arm=(0, 0, ARM)
    )
    return _compiled("universal", [cross], _pose(ground, pendulum, cross), SEAT)


@cache
def cylindrical():
    ground, pendulum, sleeve = _seated(CylindricalJoint)
    return _compiled("cylindrical", [sleeve], _pose(ground, pendulum, sleeve), SEAT)


@cache
def prismatic():
    ground, pendulum, slide = _seated(PrismaticJoint)
    return _compiled("prismatic", [slide], _pose(ground, pendulum, slide), SEAT)


@cache
def actuator():
    """A plate whose slide is driven at a speed: the drive is part of the joint's reaction."""
    v = symbols("v")
    ground, plate, slide = _seated(PrismaticJoint, moments=("1", "1", "1"), arm=(0, 0, 0))
    return _compiled(
        "actuator",
        [slide],
        _pose(ground, plate, slide),
        SEAT | {v: 1.0},
        motion_constraints=[mechc.Constraint("drive", slide.speeds[0] - v, "m/s")],
    )


@cache
def rod():
    """A pin on the ground, a massless rod, a ball on the pendulum."""
    ground, pendulum = _bodies(("0.1", "0.04", "0.1"))
    link = RigidBody("link", mass=0)
    link.central_inertia = inertia(link.frame, 0, 0, 0)
    place, frame = _seat(ground)
    pin = PinJoint(
        "pin",
        ground,
        link,
        parent_point=place,
        parent_interframe=frame,
        joint_axis=frame.z,
    )
    ball = mechc.BallJoint(
        "ball",
        link,
        pendulum,
        parent_point=ARM * link.x,
        child_point=-ARM * pendulum.y,
    )
    return _compiled("rod", [pin, ball], _pose(ground, pendulum), SEAT)


def _hung_at_a_distance():
    """A free pendulum and the line from the seat to its point of attachment, s along its x."""
    s = symbols("s")
    ground, pendulum = _bodies(("0.04", "0.1", "0.1"))
    free = mechc.FreeJoint("free", ground, pendulum)
    place, _ = _seat(ground)
    held = ground.masscenter.locatenew("held", place)
    eye = pendulum.masscenter.locatenew("eye", s * pendulum.x)
    held.set_vel(ground.frame, 0)
    return ground, pendulum, free, held, eye, dict.fromkeys(PLACE, 0.0) | {s: 0.0}


@cache
def distance():
    """The distance as a constraint in metres, whose multiplier is the tension."""
    ground, pendulum, free, held, eye, values = _hung_at_a_distance()
    line = eye.pos_from(held).to_matrix(ground.frame)
    stretch = (line.dot(line) - LINE**2) / (2 * LINE)  # its slopes are those of the length
    tension = {f"F{k}": mechc.multiplier(0) * line[k] / LINE for k in range(3)}
    return _compiled(
        "distance",
        [free],
        _pose(ground, pendulum) | tension,
        values,
        outputs=("multipliers",),
        configuration_constraints=[mechc.Constraint("line", stretch, "m")],
    )


@cache
def spring():
    """A spring and damper along the line, 2 m when relaxed."""
    ground, pendulum, free, held, eye, values = _hung_at_a_distance()
    k, n, c = symbols("k n c")
    path = LinearPathway(held, eye)
    stretch = path.length - LINE
    pull = -k * stretch - n * Abs(stretch) * stretch - c * path.extension_velocity
    on_ground = _vector("F", -pull * eye.pos_from(held) / path.length, ground)
    return _compiled(
        "spring",
        [free],
        _pose(ground, pendulum) | on_ground,
        values | {k: 0.0, n: 0.0, c: 0.0},
        outputs=(),
        loads=ForceActuator(pull, path).to_loads(),
    )


@cache
def short_spring():
    """The spring without length when relaxed: along the vertical it pulls as a bushing does."""
    ground, pendulum, free, *_ = _hung_at_a_distance()
    k, c = symbols("k c")
    place = pendulum.masscenter.pos_from(ground.masscenter)
    pull = -k * place - c * place.dt(ground.frame)
    return _compiled(
        "short_spring",
        [free],
        _pose(ground, pendulum) | _vector("F", -pull, ground),
        {k: 0.0, c: 0.0},
        outputs=(),
        loads=[Force(pendulum.masscenter, pull)],
    )


def _turned(axis, angle):
    axis = np.array(axis) / np.linalg.norm(axis)
    quaternion = np.cos(angle / 2), *(np.sin(angle / 2) * axis)
    return {f"e_{k}": float(e) for k, e in enumerate(quaternion)}


def _at(x, y, z):
    return {"a_x": x, "a_y": y, "a_z": z}


DOWN, SLANTED = _turned((1, 0, 0), -np.pi / 2), _turned((1, 0, 0), -np.pi / 4)
ASIDE = _at(1.0, 2.0, 3.0)
UPRIGHT = {"q0_ball": SLANTED["e_0"], "q1_ball": -SLANTED["e_1"]}  # back to the ground's axes
ALONG = {"x_free": -1.0, "y_free": 4.0, "z_free": 3.0}  # across the line
STRETCHED = {"y_free": 4.0, "q0_free": COS_45, "q3_free": -COS_45}  # on from the line
LEVEL = dict.fromkeys(("x_free", "z_free", "q1_free", "q2_free"), 0.0)
BENT_SPRING = {"s": 2.0, "k": 50.0, "n": 10.0, "c": 5.0}

CASES = {
    "Revolute_Case01": Case(revolute, DOWN),
    "Revolute_Case02": Case(revolute, SLANTED | ASIDE),
    "Spherical_Case01": Case(spherical),
    "Spherical_Case02": Case(spherical, SLANTED | ASIDE),
    "Universal_Case01": Case(universal, _turned((1, 0, 0), np.pi / 2)),
    "Universal_Case02": Case(universal, _turned((0, 1, 0), np.pi / 2)),
    "Universal_Case03": Case(universal, _turned((1, -1, 0), np.pi / 2)),
    "Cylindrical_Case01": Case(cylindrical),
    "Cylindrical_Case02": Case(cylindrical, DOWN),
    "Cylindrical_Case03": Case(cylindrical, SLANTED | ASIDE),
    "Prismatic_Case01": Case(prismatic),
    "Prismatic_Case02": Case(prismatic, SLANTED | ASIDE),
    "Prismatic_Case03": Case(prismatic, DOWN | ASIDE),
    "Distance_Case01": Case(distance, {"s": 0.0}, {"y_free": 2.0}),
    "Distance_Case02": Case(distance, ASIDE | {"s": 2.0}, ALONG),
    "Distance_Case03": Case(distance, {"s": 2.0}, LEVEL | STRETCHED),
    "RevSpherical_Case01": Case(rod),
    "RevSpherical_Case02": Case(rod, ASIDE | SLANTED, UPRIGHT),
    "RotSpring_Case01": Case(revolute, DOWN | {"k": 200.0, "c": 10.0}),
    "RotSpring_Case02": Case(revolute, DOWN | {"k": 50.0, "n": 10.0, "c": 10.0}),
    "TranSpring_Case01": Case(short_spring, {"k": 10.0, "c": 0.5}),
    "TranSpring_Case02": Case(spring, {"k": 100.0, "c": 5.0}, {"y_free": 2.0}),
    "TranSpringCB_Case01": Case(short_spring, {"k": 10.0, "c": 0.5}),
    "TranSpringCB_Case02": Case(spring, {"k": 100.0, "c": 5.0}, {"y_free": 2.0}),
    "TranSpringCB_Case03": Case(spring, ASIDE | BENT_SPRING, ALONG),
    "TranSpringCB_Case04": Case(spring, BENT_SPRING, STRETCHED),
    "LinActuator_Case01": Case(actuator, {"v": 1.0}, {}, {"u_joint": 1.0}),
    "LinActuator_Case02": Case(
        actuator, _turned((0, 1, 0), np.pi / 4) | {"v": 0.5}, {}, {"u_joint": 0.5}
    ),
}
