"""Joints whose attitude is a quaternion: :class:`BallJoint` and :class:`FreeJoint`.

Four coordinates q = (q0, q1, q2, q3) and three speeds, the angular velocity w of the child relative
to the parent, in the axes of the child's interframe:

    q' = N(q) w,  2 N = [[-q1, -q2, -q3], [q0, -q3, q2], [q3, q0, -q1], [-q2, q1, q0]].

N is orthogonal to q, so |q| is an invariant of the motion and no constraint is needed.  The
rotation matrix is that of q/|q|, of which every multiple of q is the same attitude: an error of the
norm has no effect on the motion, and there is no configuration in which the joint is singular.
(Shabana 2013, Dynamics of Multibody Systems, section 2.6; Wittenburg 2008, section 2.2.)
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from sympy import Expr, ImmutableDenseMatrix, Matrix, S, Symbol, sqrt
from sympy.physics.mechanics import SphericalJoint, dynamicsymbols
from sympy.physics.mechanics.joint import Joint as SymPyJoint
from sympy.physics.vector import ReferenceFrame, Vector

from mechc_codegen.description.joints.kinds import KINDS


def quaternion_rates(q: Sequence[Expr], w: Sequence[Expr]) -> list[Expr]:
    """The rates of a quaternion, N(q) w with w in the axes of the turned frame."""
    return [
        (-q[1] * w[0] - q[2] * w[1] - q[3] * w[2]) / 2,
        (q[0] * w[0] - q[3] * w[1] + q[2] * w[2]) / 2,
        (q[3] * w[0] + q[0] * w[1] - q[1] * w[2]) / 2,
        (-q[2] * w[0] + q[1] * w[1] + q[0] * w[2]) / 2,
    ]


def attitude_matrix(q: Sequence[Expr]) -> ImmutableDenseMatrix:
    """The rotation of the attitude q/|q|: its columns are the axes of the turned frame.

    By plain symbols first: of functions SymPy would derive angular velocities.
    """
    plain = [Symbol(f"_q{k}") for k in range(4)]
    length = sqrt(sum((x**2 for x in plain), S.Zero))
    turned = ReferenceFrame("_turned")
    turned.orient_quaternion(ReferenceFrame("_still"), [x / length for x in plain])
    matrix = next(iter(turned._dcm_dict.values()))
    return ImmutableDenseMatrix(matrix.T).xreplace(dict(zip(plain, q, strict=True)))


class BallJoint(SymPyJoint):  # type: ignore[misc]
    """A ball joint whose attitude is a quaternion: regular in every configuration.

    Takes the arguments of SymPy's joints: ``name, parent, child, coordinates, speeds,
    parent_point, child_point, parent_interframe, child_interframe``.

    Four coordinates, by default ``q0_NAME ... q3_NAME``, without unit, q0 = cos(angle/2), which
    start at 1, 0, 0, 0; three speeds, ``wx_NAME, wy_NAME, wz_NAME``, the angular velocity of the
    child relative to the parent in the axes of the child's interframe (rad/s).  The quaternion need
    not have length one: all its multiples, except zero, are one attitude.
    """

    _kind = KINDS["ball"]

    def __str__(self) -> str:
        name = type(self).__name__
        return f"{name}: {self.name}  parent: {self.parent}  child: {self.child}"

    @property
    def units(self) -> list[str]:
        """The units of the coordinates, then of the speeds."""
        return [unit for letters in self._kind.states() for _, unit in letters]

    @property
    def quaternion(self) -> tuple[Expr, ...]:
        """The four coordinates of the attitude."""
        return tuple(self.coordinates)[-4:]

    @property
    def angular_velocity(self) -> Vector:
        """The angular velocity of the child relative to the parent."""
        return Vector([(Matrix(self.speeds[-3:]), self.child_interframe)])

    def _generate_coordinates(self, given: Any) -> Matrix:
        return self._symbol_list(given, self._kind.states()[0], "q")

    def _generate_speeds(self, given: Any) -> Matrix:
        return self._symbol_list(given, self._kind.states()[1], "u")

    def _symbol_list(self, given: Any, letters: Sequence[tuple[str, str]], kind: str) -> Matrix:
        """The given coordinates or speeds, or new ones by these letters, checked as in SymPy."""
        own = [dynamicsymbols(f"{each}_{self.name}") for each, _ in letters]
        given = own if given is None else [x or y for x, y in zip(given, own, strict=False)]
        return self._fill_coordinate_list(given, len(own), kind)

    def _generate_kdes(self) -> Matrix:
        rates = [*self.speeds[:-3], *quaternion_rates(self.quaternion, self.speeds[-3:])]
        pairs = zip(self.coordinates, rates, strict=True)
        return Matrix([rate - q.diff(dynamicsymbols._t) for q, rate in pairs])

    def _orient_frames(self) -> None:
        matrix = attitude_matrix(self.quaternion)
        self.child_interframe._dcm(self.parent_interframe, matrix)

    def _set_angular_velocity(self) -> None:
        self.child_interframe.set_ang_vel(self.parent_interframe, self.angular_velocity)

    _set_linear_velocity = SphericalJoint._set_linear_velocity


class FreeJoint(BallJoint):
    """A joint without constraints: the child moves freely, its attitude is a quaternion.

    Takes the arguments of SymPy's joints.  Seven coordinates: ``x_NAME, y_NAME, z_NAME``, the
    position of the child's point from the parent's in the axes of the parent's interframe (m), and
    the quaternion of :class:`BallJoint`.  Six speeds: ``vx_NAME, vy_NAME, vz_NAME``, the rates of
    the position (m/s), and the angular velocity as in :class:`BallJoint`.
    """

    _kind = KINDS["floating"]

    def _set_linear_velocity(self) -> None:
        place = Vector([(Matrix(self.coordinates[:3]), self.parent_interframe)])
        velocity = Vector([(Matrix(self.speeds[:3]), self.parent_interframe)])
        self.child_point.set_pos(self.parent_point, place)
        self.parent_point.set_vel(self._parent_frame, 0)
        self.child_point.set_vel(self._child_frame, 0)
        self.child_point.set_vel(self._parent_frame, velocity)
        self.child.masscenter.v2pt_theory(self.child_point, self._parent_frame, self._child_frame)
