"""The motion of each joint: coordinates, speeds, the place of the child's frame, and its limits.

Input: a joint, and the place of its frame on the body that carries it.  Output: a JointMotion.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from sympy import Expr, Function, Matrix, S, Symbol, cos, sin, sympify
from sympy.core.function import AppliedUndef
from sympy.physics.mechanics import Point, ReferenceFrame, dynamicsymbols

from mechc_codegen.description.mechanism import Coordinate, Quantity, Speed
from mechc_codegen.description.placement import apply, plus, product
from mechc_codegen.description.terms import vector_along
from mechc_codegen.joints.attitude import attitude_matrix, quaternion_rates
from mechc_codegen.robots.geometry import Mat, Place, Vec, about, across, transpose
from mechc_codegen.robots.robot import TURNING, RobotJoint


def orient(child: ReferenceFrame, parent: ReferenceFrame, rotation: Mat) -> None:
    """Set the orientation, without the angular velocity that SymPy would derive from it."""
    child._dcm(parent, Matrix(rotation).applyfunc(sympify).as_immutable())


@dataclass
class JointMotion:
    """How a joint moves its child.

    Attributes
    ----------
    rotation, way
        Of the child's frame in the joint's, and of its origin.
    turning
        Its angular velocity, in components of the child's frame.
    position, rate
        Of a joint with one coordinate: the coordinate and the speed, or what mimics those.
    """

    coordinates: list[Coordinate] = field(default_factory=list)
    speeds: list[Speed] = field(default_factory=list)
    kinematics: list[Expr] = field(default_factory=list)
    rotation: Mat = ()
    way: Vec = (0, 0, 0)
    turning: Vec = (0, 0, 0)
    position: Expr | None = None
    rate: Expr | None = None
    quaternion: tuple[AppliedUndef, ...] = ()
    start: dict[str, float] = field(default_factory=dict)

    def add(self, joint: RobotJoint, letters: tuple[str, str], unit: str) -> tuple[Any, Any]:
        """Add a coordinate and the speed that is its rate."""
        q, u = (of_time(f"{letter}_{joint.name}") for letter in letters)
        described = f"of the joint {joint.name}"
        self.coordinates.append(Coordinate(q, Quantity(unit, described)))
        self.speeds.append(Speed(u, Quantity(f"{unit}/s", described)))
        self.kinematics.append(u)
        return q, u

    def place(self, at: Place, child: tuple[Point, ReferenceFrame],
              carrier: tuple[Point, ReferenceFrame]) -> None:  # fmt: skip
        """Locate and orient the child's frame from the carrier's, on which the joint is ``at``."""
        point, frame = child
        orient(frame, carrier[1], product(at.rotation, self.rotation))
        frame.set_ang_vel(carrier[1], vector_along(self.turning, frame))
        way = plus(at.origin, apply(at.rotation, self.way))
        point.set_pos(carrier[0], vector_along(way, carrier[1]))

    def inverse(self) -> JointMotion:
        """The motion of the joint's frame in the child's."""
        rotation = transpose(self.rotation)
        return replace(
            self,
            rotation=rotation,
            way=[-x for x in apply(rotation, self.way)],
            turning=[-x for x in apply(self.rotation, self.turning)],
        )


def motion_of(
    joint: RobotJoint, positions: Mapping[str, JointMotion], turned: bool = False
) -> JointMotion:
    """The motion of a joint; ``positions``: those of the joints that mimics may follow.

    ``turned``: that of the parent against the child, by the same coordinates.
    """
    several = {
        "floating": _floating, "planar": _planar, "ball": _ball,
        "universal": _universal, "cylindrical": _cylindrical,
    }  # fmt: skip
    if joint.kind in several:
        motion = several[joint.kind](joint)
        return motion.inverse() if turned else motion
    axis = [-x for x in joint.axis] if turned else joint.axis
    motion = JointMotion()
    if joint.mimic is None:
        unit = "rad" if joint.kind in TURNING else "m"
        q, u = motion.add(joint, ("q", "u"), unit)
    else:
        followed, x = positions[joint.mimic.joint], Symbol("x")
        terms = (sympify(c) * x**k for k, c in enumerate(joint.mimic.coefficients))
        polynomial = sum(terms, S.Zero)
        q = polynomial.xreplace({x: followed.position})
        u = polynomial.diff(x).xreplace({x: followed.position}) * followed.rate
    motion.position, motion.rate = q, u
    turns = joint.kind in TURNING
    motion.rotation = about(axis, q if turns else 0)
    motion.turning = [u * x if turns else 0 for x in axis]
    motion.way = [0 if turns else q * x for x in axis]
    return motion


def _cylindrical(joint: RobotJoint) -> JointMotion:
    motion = JointMotion()
    angle, rate = motion.add(joint, ("q", "u"), "rad")
    way, _ = motion.add(joint, ("x", "vx"), "m")
    motion.rotation = about(joint.axis, angle)
    motion.turning = [rate * x for x in joint.axis]
    motion.way = [way * x for x in joint.axis]
    return motion


def _universal(joint: RobotJoint) -> JointMotion:
    motion = JointMotion()
    first, first_rate = motion.add(joint, ("qx", "ux"), "rad")
    second, second_rate = motion.add(joint, ("qy", "uy"), "rad")
    motion.rotation = product(about((1, 0, 0), first), about((0, 1, 0), second))
    motion.turning = [first_rate * cos(second), second_rate, first_rate * sin(second)]
    return motion


def _planar(joint: RobotJoint) -> JointMotion:
    motion = JointMotion()
    first, second = across(joint.axis)
    x, _ = motion.add(joint, ("x", "vx"), "m")
    y, _ = motion.add(joint, ("y", "vy"), "m")
    angle, rate = motion.add(joint, ("q", "u"), "rad")
    motion.way = [x * a + y * b for a, b in zip(first, second, strict=True)]
    motion.rotation = about(joint.axis, angle)
    motion.turning = [rate * c for c in joint.axis]
    return motion


def _floating(joint: RobotJoint) -> JointMotion:
    motion = JointMotion()
    motion.way = [motion.add(joint, (axis, f"v{axis}"), "m")[0] for axis in "xyz"]
    return _with_attitude(motion, joint)


def _ball(joint: RobotJoint) -> JointMotion:
    return _with_attitude(JointMotion(), joint)


def _with_attitude(motion: JointMotion, joint: RobotJoint) -> JointMotion:
    """The motion, besides by a quaternion."""
    q = [of_time(f"q{k}_{joint.name}") for k in range(4)]
    w = [of_time(f"w{axis}_{joint.name}") for axis in "xyz"]
    described = f"of the joint {joint.name}"
    motion.coordinates += [Coordinate(x, Quantity("1", described)) for x in q]
    motion.speeds += [Speed(x, Quantity("rad/s", described)) for x in w]
    motion.kinematics += quaternion_rates(q, w)
    motion.rotation = attitude_matrix(q).tolist()
    motion.turning, motion.quaternion = w, tuple(q)
    motion.start = {f"q0_{joint.name}": 1.0}
    return motion


def of_time(name: str) -> Any:
    """A function of time; ``dynamicsymbols`` would split names at commas and colons."""
    return Function(name)(dynamicsymbols._t)
