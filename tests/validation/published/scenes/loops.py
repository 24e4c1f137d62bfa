"""Modelica's mechanisms with loops, written with SymPy's joints and mechc's cuts."""

from dataclasses import dataclass, field
from functools import cache

import numpy as np
from sympy import Matrix, Rational, cos, exp, sin, sqrt, symbols
from sympy.physics.mechanics import (
    PinJoint,
    PrismaticJoint,
    ReferenceFrame,
    RigidBody,
    Torque,
    dynamicsymbols,
    inertia,
)

import mechc

G = 9.80665
CYCLIC = Matrix([[0, 1, 0], [0, 0, 1], [1, 0, 0]])  # x, y, z of the new frame are y, z, x
STEEL = 7700  # kg/m³, Modelica's default
SPIN = 5.235987755982989  # rad/s: 300 degrees in a second


@dataclass(frozen=True)
class Example:
    """A model of Modelica: scene, values, start, and what its recorded signals are here.

    ``signals`` gives, for each recorded name, a coordinate, a speed or an output of the scene.
    """

    path: str
    scene: object
    signals: dict
    end: float
    values: dict = field(default_factory=dict)
    start: dict = field(default_factory=dict)
    speeds: dict = field(default_factory=dict)
    guess: dict = field(default_factory=dict)
    inputs: dict = field(default_factory=dict)


def cylinder(length, diameter):
    """Mass, moment along the axis and across it, of a cylinder of steel."""
    mass = STEEL * np.pi * diameter**2 / 4 * length
    return mass, mass * diameter**2 / 8, mass * (length**2 / 12 + diameter**2 / 16)


def box(length, height, width):
    """Mass, and moments about the length, the height and the width, of a box of steel."""
    mass = STEEL * length * height * width
    a, b, c = length**2 / 12, height**2 / 12, width**2 / 12
    return mass, mass * (b + c), mass * (a + c), mass * (a + b)


def rod_inertia(frame, line, moments):
    """The inertia dyadic of a body of revolution about a line, a vector of numbers in m."""
    _, along, across = moments
    size = sqrt(sum(Rational(str(x)) ** 2 for x in line))
    e = [Rational(str(x)) / size for x in line]
    entries = [[across * int(i == j) + (along - across) * e[i] * e[j] for j in range(3)]
               for i in range(3)]  # fmt: skip
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = entries
    return inertia(frame, xx, yy, zz, xy, yz, xz)


def vector(frame, numbers):
    return sum((Rational(str(x)) * e for x, e in zip(numbers, frame, strict=True)), 0 * frame.x)


def member(name, line, diameter):
    """A cylinder of steel from its first frame to its second, `line` in m apart."""
    body = RigidBody(name)
    moments = cylinder(np.linalg.norm(line), diameter)
    body.mass = moments[0]
    body.central_inertia = rod_inertia(body.frame, line, moments)
    return body, vector(body.frame, line) / 2


def _turning_and_sliding():
    """A turning and a sliding bar: the world, and of each the body, half of it and its joint."""
    world = RigidBody("world")
    b1, half1 = member("b1", (0, 0.5, 0.1), 0.05)
    b2, half2 = member("b2", (0, 0.2, 0), 0.05)
    j1 = PinJoint("j1", world, b1, child_point=-half1, joint_axis=world.x)
    j2 = PrismaticJoint(
        "j2",
        world,
        b2,
        parent_point=Rational(6, 5) * world.x,
        child_point=-half2,
        joint_axis=world.x,
    )
    return world, (b1, half1, j1), (b2, half2, j2)


@cache
def fourbar():
    """A turning bar, a sliding bar, and between their ends a rod on a universal joint and a ball.

    The rod has the mass m, the moment J_l along it and J_c across.
    """
    m, along, across = symbols("m J_l J_c")
    world, (b1, half1, j1), (b2, half2, j2) = _turning_and_sliding()
    line = (-1, 0.3, 0.1)
    b3 = RigidBody("b3", mass=m)
    b3.central_inertia = rod_inertia(b3.frame, line, (m, along, across))
    half3 = vector(b3.frame, line) / 2
    first, second = ReferenceFrame("first"), ReferenceFrame("second")
    first.orient_dcm(b2.frame, CYCLIC)
    second.orient_dcm(b3.frame, CYCLIC)
    cross = mechc.UniversalJoint(
        "cross",
        b2,
        b3,
        parent_point=half2,
        child_point=-half3,
        parent_interframe=first,
        child_interframe=second,
    )
    ball = mechc.Cut.spherical("ball", b3, b1, parent_point=half3, child_point=half1)
    mechanism = mechc.from_joints(
        "fourbar",
        [j1, j2, cross, ball],
        gravity=-G * world.y,
        parameters={m: 0.0, along: 0.0, across: 0.0},
    )
    return mechc.compile(mechanism, outputs=())


@cache
def fourbar_with_a_distance():
    """The same with a rod without mass: the distance of the ends is a constraint."""
    world, (b1, half1, j1), (b2, half2, j2) = _turning_and_sliding()
    first = b1.masscenter.locatenew("first", half1)
    second = b2.masscenter.locatenew("second", half2)
    line = first.pos_from(second).to_matrix(world.frame)
    length = sqrt(line.dot(line)) - sqrt(Rational(11, 10))
    mechanism = mechc.from_joints(
        "fourbar_with_a_distance",
        [j1, j2],
        gravity=-G * world.y,
        configuration_constraints=[mechc.Constraint("rod", length, "m")],
    )
    return mechc.compile(mechanism, outputs=())


@cache
def planar_fourbar():
    """Four boxes of steel and pins along z; a damper at the first."""
    world, ends = RigidBody("world"), {}
    lines = {"body1": (0.4, 0.0), "body2": (0.1, 1.1), "body4": (0.65, 0.1)}
    bodies = {}
    for name, line in lines.items():
        body = bodies[name] = RigidBody(name)
        mass, _, _, moment = box(np.hypot(*line), 0.05, 0.05)
        body.mass, body.central_inertia = mass, inertia(body.frame, 0, 0, moment)
        ends[name] = vector(body.frame, (*line, 0)) / 2
    b1, b2, b4 = bodies.values()
    first = PinJoint("first", world, b1, child_point=-ends["body1"], joint_axis=world.z)
    second = PinJoint(
        "second",
        b1,
        b2,
        parent_point=ends["body1"],
        child_point=-ends["body2"],
        joint_axis=b1.z,
    )
    third = PinJoint(
        "third",
        world,
        b4,
        parent_point=vector(world.frame, (-0.15, 1, 0)),
        child_point=-ends["body4"],
        joint_axis=world.z,
    )
    fourth = mechc.Cut.pin(
        "fourth",
        b4,
        b2,
        parent_point=ends["body4"],
        child_point=ends["body2"],
        joint_axis=b4.z,
    )
    mechanism = mechc.from_joints(
        "planar_fourbar",
        [first, second, third, fourth],
        gravity=-G * world.y,
        loads=[Torque(b1, -Rational(1, 10) * first.speeds[0] * world.z)],
    )
    return mechc.compile(mechanism, outputs=())


def filtered_sine(t, sine, cosine, exponential):
    """The angle that Modelica's source makes of 0.7 sin 2πt: a Bessel filter at rest at first."""
    w, af, bf, rate = 100 * np.pi, 1.3617, 0.6180, 2 * np.pi
    steady = 0.7 / complex(1 - bf * (rate / w) ** 2, af * rate / w)
    decay = af * w / (2 * bf)
    own = np.sqrt(w**2 / bf - decay**2)
    a = -steady.imag
    b = (decay * a - rate * steady.real) / own
    fading = exponential(-decay * t) * (a * cosine(own * t) + b * sine(own * t))
    return steady.real * sine(rate * t) + steady.imag * cosine(rate * t) + fading


@cache
def planar_loops():
    """A turned crank and three rods in a row; the end of each is held at a distance."""
    world, crank = RigidBody("world"), RigidBody("crank", mass=0)
    crank.central_inertia = inertia(crank.frame, 0, 0, 0)
    joints = [PinJoint("rev", world, crank, joint_axis=world.z)]
    constraints = []
    parent, point = crank, crank.y / 2
    for k, (line, foot, far) in enumerate(_ROWS):
        rod = RigidBody(f"rod{k}", mass=1)
        rod.central_inertia = inertia(rod.frame, 0, 0, Rational(1, 1000))
        half = vector(rod.frame, (*line, 0)) / 2
        joints.append(
            PinJoint(
                f"pin{k}",
                parent,
                rod,
                parent_point=point,
                child_point=-half,
                joint_axis=parent.z,
            )
        )
        parent, point = rod, half
        end = rod.masscenter.locatenew(f"end{k}", half)
        gap = end.pos_from(world.masscenter) - foot * world.x
        stretch = gap.dot(gap) - sum(Rational(str(c)) ** 2 for c in far)
        distance = stretch / (2 * float(np.hypot(*far)))
        constraints.append(mechc.Constraint(f"strut{k}", distance, "m"))
    angle = filtered_sine(dynamicsymbols._t, sin, cos, exp)
    drive = joints[0].coordinates[0] - angle
    mechanism = mechc.from_joints(
        "planar_loops",
        joints,
        gravity=-G * world.y,
        configuration_constraints=[*constraints, mechc.Constraint("drive", drive, "rad")],
    )
    return mechc.compile(mechanism, outputs=())


_ROWS = (  # of each rod: from end to end, the foot of its strut, from there to its end, in m
    ((0.6, 0.0), Rational(1, 2), (0.1, 0.5)),
    ((0.5, 0.1), 1, (0.1, 0.6)),
    ((0.4, -0.05), Rational(3, 2), (0.0, 0.55)),
)


LOOPS = "Modelica/Mechanics/MultiBody/Examples/Loops/"
VARIANTS = "ModelicaTest/MultiBody/FourbarVariants/"
_ROD = cylinder(np.linalg.norm((-1, 0.3, 0.1)), 0.05)


def _fourbar(path, m=0.0, along=0.0, across=0.0):
    """With a rod without mass, whose angles have no motion of their own, as a distance."""
    massive = m > 0
    return Example(
        path,
        fourbar if massive else fourbar_with_a_distance,
        {"j1.phi": "q_j1", "j1.w": "u_j1"},
        5.0,
        {"m": m, "J_l": along, "J_c": across} if massive else {},
        {"q_j1": 0.0},
        {"u_j1": SPIN},
        {"q_j2": -0.2, "q0_cross": 0.0, "q1_cross": 0.0} if massive else {"q_j2": -0.2},
    )


EXAMPLES = [
    _fourbar(LOOPS + "Fourbar1", *_ROD),
    _fourbar(LOOPS + "Fourbar2"),
    _fourbar(LOOPS + "Fourbar_analytic"),
    _fourbar(VARIANTS + "SphericalAndUniversal"),
    _fourbar(VARIANTS + "UniversalSpherical"),
    _fourbar(VARIANTS + "SphericalSpherical", 1.0),
    Example(
        LOOPS + "PlanarFourbar",
        planar_fourbar,
        {"revolute1.phi": "q_first", "revolute1.w": "u_first"},
        5.0,
        start={"q_first": 0.0},
        speeds={"u_first": 0.0},
        guess={"q_second": 0.0, "q_third": 0.0},
    ),
    Example(
        LOOPS + "PlanarLoops_analytic",
        planar_loops,
        {"rev.phi": "q_rev", "rev.w": "u_rev"},
        5.0,
        guess={"q_rev": 0.0, "q_pin0": 0.0, "q_pin1": 0.0, "q_pin2": 0.0},
    ),
]
