"""Which coordinates are quaternions that have to have length one."""

from __future__ import annotations

from mechc_codegen.description.joints.quaternions import unit_quaternions
from mechc_codegen.joints.attitude import attitude_matrix
from sympy import Matrix
from sympy.physics.mechanics import ReferenceFrame, dynamicsymbols


def test_the_scalar_component_is_the_first_in_any_order_of_the_coordinates() -> None:
    x, a, b, c, s = q = dynamicsymbols("x a b c s")
    inertial = ReferenceFrame("N")
    arm = inertial.orientnew("arm", "Axis", (x, inertial.z))
    arm.orientnew("body", "Quaternion", (s, a, b, c))
    assert unit_quaternions(inertial, q) == [[4, 1, 2, 3]]


def test_a_frame_turned_by_any_multiple_is_none() -> None:
    q = dynamicsymbols("e_0:4")
    inertial, body = ReferenceFrame("N"), ReferenceFrame("body")
    body.orient_explicit(inertial, Matrix(attitude_matrix(q)))
    assert unit_quaternions(inertial, q) == []


def test_four_angles_are_none() -> None:
    q = dynamicsymbols("q_0:4")
    inertial = ReferenceFrame("N")
    body = inertial.orientnew("body", "Body", q[:3], "123")
    body.orientnew("wheel", "Axis", (q[3], body.y))
    assert unit_quaternions(inertial, q) == []
