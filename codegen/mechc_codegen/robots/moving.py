"""The motion of each joint: coordinates, speeds, the place of the child's frame, and its limits.

Input: a joint, and the place of its frame on the body that carries it.  Output: a JointMotion.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from sympy import Expr, Function, Matrix, S, Symbol, sympify
from sympy.core.function import AppliedUndef
from sympy.physics.mechanics import Point, ReferenceFrame, dynamicsymbols

from mechc_codegen.description.mechanism import Coordinate, Quantity, Speed
from mechc_codegen.description.placement import apply, plus, product
from mechc_codegen.description.terms import vector_along
from mechc_codegen.joints.attitude import attitude_matrix, quaternion_rates
from mechc_codegen.robots.geometry import Mat, Place, Vec, about, axes_of, transpose
from mechc_codegen.robots.robot import Mimic, RobotJoint


def orient(child: ReferenceFrame, parent: ReferenceFrame, rotation: Mat) -> None:
    """Set the orientation, without the angular velocity that SymPy would derive from it."""
    child._dcm(parent, Matrix(rotation).applyfunc(sympify).as_immutable())


@dataclass
class JointMotion:
    """How a joint moves its child.

    Attributes
    ----------
    rotation, way
        The place of the child's frame in the joint's.
    turning
        The angular velocity of the child, in components of its frame.
    position, rate
        The coordinate and the speed of a joint that has one of each, or what mimics those.
    quaternion
        The coordinates that turn the child in every way.
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

    def turn(self, axis: Vec, angle: Expr, rate: Expr) -> None:
        """Turn the child further about an axis."""
        step, spin = about(axis, angle), [rate * x for x in axis]
        if self.rotation:
            spin = [*plus(apply(transpose(step), self.turning), spin)]
            step = product(self.rotation, step)
        self.rotation, self.turning = step, spin

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
    motion = _with_coordinates(joint) if joint.mimic is None else JointMotion()
    pairs = [(q.symbol, u.symbol) for q, u in zip(motion.coordinates, motion.speeds, strict=False)]
    if joint.mimic:
        parts = [_position_and_rate(each, positions[each.joint]) for each in joint.mimic.terms]
        position, rate = (sum(each, S.Zero) for each in zip(*parts, strict=True))
        pairs = [(position, rate)]
    if joint.row.unit:
        motion.position, motion.rate = pairs[0]
        x, y, z = joint.axis
        joint = replace(joint, axis=(-x, -y, -z)) if turned else joint
    axes = axes_of(joint)
    for freedom, (q, u) in zip(joint.row.freedoms, pairs, strict=False):
        axis = axes[freedom.axis]
        if freedom.unit == "rad":
            motion.turn(axis, q, u)
        else:
            motion.way = plus(motion.way, [q * x for x in axis])
    motion.rotation = motion.rotation or about(joint.axis, 0)
    return motion.inverse() if turned and not joint.row.unit else motion


def _with_coordinates(joint: RobotJoint) -> JointMotion:
    """The coordinates and speeds of a joint, and the attitude of one that turns freely."""
    row, described = joint.row, f"of the joint {joint.name}"
    q, u = (
        [(of_time(f"{letters}_{joint.name}"), Quantity(unit, described)) for letters, unit in given]
        for given in row.states()
    )
    motion = JointMotion([Coordinate(*each) for each in q], [Speed(*each) for each in u])
    motion.kinematics = [symbol for symbol, _ in u]
    if row.turns_freely:
        turned, spin = [symbol for symbol, _ in q[-4:]], motion.kinematics[-3:]
        motion.kinematics[-3:] = quaternion_rates(turned, spin)
        motion.rotation, motion.turning = attitude_matrix(turned).tolist(), spin
        motion.quaternion, motion.start = tuple(turned), {f"q0_{joint.name}": 1.0}
    return motion


def _position_and_rate(mimic: Mimic, followed: JointMotion) -> tuple[Expr, Expr]:
    """The position and the rate of a joint that mimics another."""
    x = Symbol("x")
    terms = (sympify(c) * x**k for k, c in enumerate(mimic.coefficients))
    polynomial = sum(terms, S.Zero)
    rate = polynomial.diff(x).xreplace({x: followed.position}) * followed.rate
    return polynomial.xreplace({x: followed.position}), rate


def of_time(name: str) -> Any:
    """A function of time; ``dynamicsymbols`` would split names at commas and colons."""
    return Function(name)(dynamicsymbols._t)
