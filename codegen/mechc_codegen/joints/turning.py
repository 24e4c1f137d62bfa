"""Joints with fixed axes that SymPy lacks: :class:`UniversalJoint` and :class:`ScrewJoint`."""

from __future__ import annotations

from typing import Any

from sympy import Expr, Matrix, pi, sympify
from sympy.physics.mechanics import CylindricalJoint, SphericalJoint
from sympy.physics.mechanics.joint import Joint as SymPyJoint


class UniversalJoint(SymPyJoint):  # type: ignore[misc]
    """A universal joint (Hooke's, Cardan's): a massless cross between two yokes.

    Takes the arguments of SymPy's joints.  One axis of the cross is the x axis of the parent's
    interframe, the other the y axis of the child's; shafts lie along z.  Two coordinates,
    ``q0_NAME`` about x and then ``q1_NAME`` about y (rad), and their rates ``u0_NAME, u1_NAME``.
    At q1 = +-90 deg the joint is locked, as the real one is.
    """

    def __str__(self) -> str:
        return f"UniversalJoint: {self.name}  parent: {self.parent}  child: {self.child}"

    def _generate_coordinates(self, given: Any) -> Matrix:
        return self._fill_coordinate_list(given, 2, "q")

    def _generate_speeds(self, given: Any) -> Matrix:
        return self._fill_coordinate_list(given, 2, "u")

    def _orient_frames(self) -> None:
        first, second = self.coordinates
        self.child_interframe.orient_body_fixed(self.parent_interframe, (first, second, 0), "XYZ")

    def _set_angular_velocity(self) -> None:
        first, second = self.speeds
        along = first * self.parent_interframe.x + second * self.child_interframe.y
        self.child_interframe.set_ang_vel(self.parent_interframe, along)

    _set_linear_velocity = SphericalJoint._set_linear_velocity


class ScrewJoint(CylindricalJoint):  # type: ignore[misc]
    """A screw: the child turns about an axis and moves along it by ``lead`` in each turn.

    Takes the arguments of SymPy's ``PinJoint``, with ``lead`` after the child: in metres, a number
    or an expression of parameters, negative for a left-handed thread.  One coordinate, the angle
    ``q_NAME`` (rad), and its rate ``u_NAME``.
    """

    def __init__(
        self, name: str, parent: Any, child: Any, lead: Any, coordinates: Any = None,
        speeds: Any = None, parent_point: Any = None, child_point: Any = None,
        parent_interframe: Any = None, child_interframe: Any = None, joint_axis: Any = None,
    ) -> None:  # fmt: skip
        self._lead, self._joint_axis = sympify(lead), joint_axis
        sides = (parent_point, child_point, parent_interframe, child_interframe)
        SymPyJoint.__init__(self, name, parent, child, coordinates, speeds, *sides)

    def __str__(self) -> str:
        return f"ScrewJoint: {self.name}  parent: {self.parent}  child: {self.child}"

    @property
    def lead(self) -> Expr:
        """The way along the axis in one turn, in m."""
        return self._lead

    @property
    def translation_coordinate(self) -> Expr:
        """The way along the axis, in m."""
        return self._lead / (2 * pi) * self.rotation_coordinate

    @property
    def translation_speed(self) -> Expr:
        """The speed along the axis, in m/s."""
        return self._lead / (2 * pi) * self.rotation_speed

    def _generate_coordinates(self, given: Any) -> Matrix:
        return self._fill_coordinate_list(given, 1, "q")

    def _generate_speeds(self, given: Any) -> Matrix:
        return self._fill_coordinate_list(given, 1, "u")
