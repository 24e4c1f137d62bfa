"""An angular velocity that contradicts the orientation is refused, no way to say it right is."""

from __future__ import annotations

import pytest
from mechc_codegen.convert.convert import convert
from mechc_codegen.description.mechanism import Mechanism
from mechc_codegen.description.source import ConversionSettings
from mechc_codegen.errors import MechanismError
from mechc_codegen.frontend.read import read
from sympy import Matrix, Symbol, cos, sin
from sympy.physics.mechanics import (
    KanesMethod,
    Point,
    ReferenceFrame,
    RigidBody,
    dynamicsymbols,
    inertia,
    kinematic_equations,
)

t = dynamicsymbols._t
N = ReferenceFrame("N")


def mechanism(kane: KanesMethod) -> Mechanism:
    return convert(read(kane), ConversionSettings())


def turning(q, u, kinematics, frame, axes=None) -> KanesMethod:
    """A body that turns about a fixed point; its inertia is written along ``axes``."""
    O = Point("O")
    O.set_vel(N, 0)
    kane = KanesMethod(N, q, u, kinematics)
    kane.kanes_equations([RigidBody("body", O, frame, 1, (inertia(axes or frame, 1, 2, 2), O))], [])
    return kane


def three_axes(about) -> KanesMethod:
    """Turned about z, x and z; the last rate is set about ``about(frame)``."""
    q, u = dynamicsymbols("q1:4"), dynamicsymbols("u1:4")
    A = N.orientnew("A", "Axis", (q[0], N.z))
    B = A.orientnew("B", "Axis", (q[1], A.x))
    C = B.orientnew("C", "Axis", (q[2], B.z))
    A.set_ang_vel(N, u[0] * N.z)
    B.set_ang_vel(A, u[1] * A.x)
    C.set_ang_vel(B, u[2] * about(B))
    return turning(q, u, [a.diff(t) - b for a, b in zip(q, u, strict=True)], C)


def test_a_rate_about_another_axis_is_refused_by_the_frames_name() -> None:
    mechanism(three_axes(lambda B: B.z))
    with pytest.raises(MechanismError, match=r"set for frame C in B is not the rate") as told:
        mechanism(three_axes(lambda B: B.x))
    assert "omit the set_ang_vel of C" in str(told.value)


def test_a_rate_of_the_wrong_sign_or_factor_is_refused() -> None:
    for wrong in (lambda B: -B.z, lambda B: 2 * B.z):
        with pytest.raises(MechanismError, match="frame C in B"):
            mechanism(three_axes(wrong))


def test_what_is_set_against_the_inertial_frame_is_compared_over_all_steps() -> None:
    """By kinematic differential equations that say how u and q' belong together."""
    q, u = dynamicsymbols("q1:4"), dynamicsymbols("u1:4")
    for mirrored in (False, True):
        B = N.orientnew("B", "Body", q, "312")
        turned = B.ang_vel_in(N)
        said = u[0] * B.x + u[1] * B.y + u[2] * B.z
        kinematics = [(turned - said).dot(axis) for axis in B]
        B.set_ang_vel(N, -said if mirrored else said)
        if mirrored:
            with pytest.raises(MechanismError, match="frame B in N"):
                mechanism(turning(q, u, kinematics, B))
        else:
            mechanism(turning(q, u, kinematics, B))


def test_quaternions_are_judged_at_length_one() -> None:
    e, u = dynamicsymbols("e0:4"), dynamicsymbols("u1:4")
    for factor in (1, 2):
        B = N.orientnew("B", "Quaternion", e)
        B.set_ang_vel(N, factor * (u[0] * B.x + u[1] * B.y + u[2] * B.z))
        kane = turning(e, u, kinematic_equations(u, e, "quaternion"), B)
        if factor == 1:
            mechanism(kane)
        else:
            with pytest.raises(MechanismError, match="frame B in N"):
                mechanism(kane)


def test_agreement_on_the_constraints_is_enough() -> None:
    """Rolling along a line: the speed v r of the rim may stand for the rate of the angle."""
    x, q, v, w = dynamicsymbols("x q v w")
    r = Symbol("r")
    for radius in (r, 2 * r):
        B = N.orientnew("B", "Axis", (q, N.z))
        B.set_ang_vel(N, v / radius * N.z)
        O = Point("O")
        O.set_vel(N, 0)
        G = O.locatenew("G", x * N.x)
        G.set_vel(N, v * N.x)
        kane = KanesMethod(
            N, [x, q], [v], [x.diff(t) - v, q.diff(t) - w], u_dependent=[w],
            velocity_constraints=[v - r * w],
        )  # fmt: skip
        kane.kanes_equations([RigidBody("wheel", G, B, 1, (inertia(B, 0, 0, 1), G))], [])
        settings = ConversionSettings(configuration_constraints=())
        if radius == r:
            convert(read(kane), settings)
        else:
            with pytest.raises(MechanismError, match="frame B in N"):
                convert(read(kane), settings)


def test_frames_without_orientation_and_those_that_inputs_turn_are_not_judged() -> None:
    q, u, angle, rate = dynamicsymbols("q u angle rate")
    for orient in (False, True):
        A = N.orientnew("A", "Axis", (q, N.z))
        A.set_ang_vel(N, u * N.z)
        B = ReferenceFrame("B")
        if orient:
            B.orient_axis(A, angle, A.x)
        B.set_ang_vel(A, rate * A.x)
        mechanism(turning([q], [u], [q.diff(t) - u], B, axes=A))


def test_direction_cosines_given_entry_by_entry_are_differentiated_too() -> None:
    q, u = dynamicsymbols("q u")
    for sign in (1, -1):
        B = ReferenceFrame("B")
        B.orient_explicit(N, Matrix([[cos(q), -sin(q), 0], [sin(q), cos(q), 0], [0, 0, 1]]))
        B.set_ang_vel(N, sign * u * N.z)
        if sign == 1:
            mechanism(turning([q], [u], [q.diff(t) - u], B))
        else:
            with pytest.raises(MechanismError, match="frame B in N"):
                mechanism(turning([q], [u], [q.diff(t) - u], B))
