"""A velocity that contradicts the position is refused, no way to say it right is."""

from __future__ import annotations

from contextlib import nullcontext

import pytest
from mechc_codegen.convert.convert import convert
from mechc_codegen.description.source import ConversionSettings
from mechc_codegen.errors import MechanismError
from mechc_codegen.frontend.read import read
from sympy import Symbol, cos, diff, sin, sqrt
from sympy.physics.mechanics import (
    KanesMethod,
    Particle,
    Point,
    ReferenceFrame,
    RigidBody,
    dynamicsymbols,
    inertia,
)

t = dynamicsymbols._t
N = ReferenceFrame("N")
q1, q2, u1, u2, aux = dynamicsymbols("q1 q2 u1 u2 aux")
RATES = [q1.diff(t) - u1, q2.diff(t) - u2]
BY_RATES = {q1.diff(t): u1, q2.diff(t): u2}
r, g = Symbol("r"), Symbol("g")


def judge(bodies, loads=(), q=(q1, q2), u=(u1, u2), kinematics=RATES, **more) -> None:
    kane = KanesMethod(N, q, u, kinematics, **more)
    kane.kanes_equations(bodies, list(loads))
    convert(read(kane), ConversionSettings())


def rest() -> Point:
    O = Point("O")
    O.set_vel(N, 0)
    return O


def disc(centre: Point, frame: ReferenceFrame) -> RigidBody:
    return RigidBody("disc", centre, frame, 1, (inertia(frame, 1, 1, 2), centre))


def on_a_wave(set_velocity) -> RigidBody:
    """A disc that touches a wavy road at the place q1, turned by q2."""
    O, height = rest(), sin(q1)
    slope = diff(height, q1)
    C = O.locatenew("C", q1 * N.x + height * N.y)
    C.set_vel(N, C.pos_from(O).dt(N).xreplace(BY_RATES))
    G = C.locatenew("G", r * (N.y - slope * N.x) / sqrt(1 + slope**2))
    D = N.orientnew("D", "Axis", (q2, N.z))
    D.set_ang_vel(N, u2 * N.z)
    set_velocity(C, G, D)
    return disc(G, D)


def test_a_place_that_moves_over_the_body_is_no_point_of_it() -> None:
    with pytest.raises(MechanismError, match="set for point G is not the rate of its pos") as told:
        judge([on_a_wave(lambda C, G, D: G.v2pt_theory(C, N, D))])
    assert "relative to O, in a random motion, the velocity set is" in str(told.value)
    assert "v2pt_theory holds from a point" in str(told.value)
    judge([on_a_wave(lambda C, G, D: None)])
    judge(
        [on_a_wave(lambda C, G, D: G.set_vel(N, G.pos_from(C).dt(N).xreplace(BY_RATES) + C.vel(N)))]
    )


def pendulum_on_a_slide(wrong: bool) -> tuple[list[RigidBody | Particle], Point]:
    """A slide, and on it a rod whose mass centre's velocity may have the wrong sign."""
    O = rest()
    S = O.locatenew("S", q1 * N.x)
    S.set_vel(N, u1 * N.x)
    A = N.orientnew("A", "Axis", (q2, N.z))
    A.set_ang_vel(N, u2 * N.z)
    G = S.locatenew("G", r * A.x)
    G.set_vel(N, u1 * N.x + (-1 if wrong else 1) * r * u2 * A.y)
    return [Particle("slide", S, 1), disc(G, A)], G


def test_mass_centres_move_relative_to_each_other_as_positions_say() -> None:
    judge(pendulum_on_a_slide(wrong=False)[0])
    with pytest.raises(MechanismError, match=r"point G .*relative to S, in a random motion"):
        judge(pendulum_on_a_slide(wrong=True)[0])


@pytest.mark.parametrize("wrong", [False, True])
def test_points_with_loads_are_judged_too(wrong) -> None:
    bodies, G = pendulum_on_a_slide(wrong=False)
    tip = G.locatenew("tip", r * bodies[1].frame.x)
    tip.set_vel(N, u1 * N.x + (1 if wrong else 2) * r * u2 * bodies[1].frame.y)
    if wrong:
        with pytest.raises(MechanismError, match="set for point tip"):
            judge(bodies, [(tip, g * N.y)])
    else:
        judge(bodies, [(tip, g * N.y)])


def rolling(centre_from: str, friction: bool) -> tuple[list[RigidBody], list]:
    """A disc that rolls along x: the point that touches the ground has no speed, its place has."""
    O, D = rest(), N.orientnew("D", "Axis", (q2, N.z))
    D.set_ang_vel(N, u2 * N.z)
    C = O.locatenew("C", q1 * N.x) if centre_from == "origin" else Point("C")
    C.set_vel(N, aux * N.x if friction else 0)
    G = C.locatenew("G", r * N.y)
    G.v2pt_theory(C, N, D)
    return [disc(G, D)], [(C, g * N.x)] if friction else [(G, -g * N.y)]


@pytest.mark.parametrize("friction", [False, True])
@pytest.mark.parametrize("centre_from", ["contact", "origin"])
def test_a_wheel_may_roll_over_a_point_at_rest(centre_from, friction) -> None:
    """Whether or not coordinates say where; also with an auxiliary speed there, for its force."""
    bodies, loads = rolling(centre_from, friction)
    more = {"u_auxiliary": [aux]} if friction else {}
    judge(bodies, loads, (q1, q2), (u2,), [q1.diff(t) + r * u2, q2.diff(t) - u2], **more)


def test_a_wheel_may_slide_with_friction_where_it_touches() -> None:
    """The force acts on the wheel's point, which does not move as the place does."""
    O = rest()
    G = O.locatenew("G", q1 * N.x + r * N.y)
    G.set_vel(N, u1 * N.x)
    D = N.orientnew("D", "Axis", (q2, N.z))
    D.set_ang_vel(N, u2 * N.z)
    C = G.locatenew("C", -r * N.y)
    C.v2pt_theory(G, N, D)
    judge([disc(G, D)], [(C, -g * C.vel(N))])


def test_what_holds_on_the_constraints_is_enough() -> None:
    """A slider-crank whose rod is followed back from the slide: equal where the loop closes."""
    l = Symbol("l")
    O = rest()
    A = N.orientnew("A", "Axis", (q1, N.z))
    B = N.orientnew("B", "Axis", (q2, N.z))
    A.set_ang_vel(N, u1 * N.z)
    B.set_ang_vel(N, u2 * N.z)
    P = O.locatenew("P", r * A.x)
    G = P.locatenew("G", l / 2 * B.x)
    E = P.locatenew("E", l * B.x)
    E.set_vel(N, (-r * u1 * sin(q1) - l * u2 * sin(q2)) * N.x)  # on its guide
    G.v2pt_theory(E, N, B)
    gap = r * sin(q1) + l * sin(q2)
    held = {
        "q_ind": [q1], "q_dependent": [q2], "u_ind": [u1], "u_dependent": [u2],
        "configuration_constraints": [gap],
        "velocity_constraints": [r * u1 * cos(q1) + l * u2 * cos(q2)],
    }  # fmt: skip

    def closed(bodies):
        kane = KanesMethod(N, kd_eqs=RATES, **held)
        kane.kanes_equations(bodies, [])
        convert(read(kane), ConversionSettings())

    closed([disc(G, B)])
    G.set_vel(N, G.vel(N) + u2 * N.x)
    with pytest.raises(MechanismError, match="set for point G"):
        closed([disc(G, B)])


def test_a_point_of_a_belt_needs_a_position_that_moves() -> None:
    """Between two pulleys: without a velocity it would rest, and a load on it do no work."""

    def belt(place) -> None:
        O, D = rest(), N.orientnew("D", "Axis", (q1, N.z))
        D.set_ang_vel(N, u1 * N.z)
        B = O.locatenew("B", place * N.x + r * N.y)
        B.set_vel(N, -r * u1 * N.x)
        judge([disc(O, D)], [(B, N.x)], (q1,), (u1,), RATES[:1])

    with pytest.raises(MechanismError, match=r"the position changes at 0, .* of a belt") as told:
        belt(2 * r)
    assert "point B is not the rate of its position: relative to O" in str(told.value)
    belt(2 * r - r * q1)


def test_points_that_no_position_joins_are_not_judged() -> None:
    G = Point("G")
    G.set_vel(N, u1 * N.x + u2 * N.y)
    judge([Particle("free", G, 1)])


@pytest.mark.parametrize("wrong", [0, 1])
def test_far_from_the_origin_rounding_is_no_contradiction(wrong) -> None:
    """Two parts of a satellite, as far from it as the earth from the sun."""
    far, O = 1.5e11, rest()
    A, B = N.orientnew("A", "Axis", (q1, N.z)), N.orientnew("B", "Axis", (q2, N.z))
    A.set_ang_vel(N, u1 * N.z)
    B.set_ang_vel(N, u2 * N.z)
    G = O.locatenew("G", far * A.x)
    G.v2pt_theory(O, N, A)
    H = G.locatenew("H", 2 * B.x)
    H.set_vel(N, (far * u1 * A.y + (2 + wrong) * u2 * B.y).express(N))
    bodies = [disc(G, A), Particle("part", H, 1)]
    with pytest.raises(MechanismError, match="set for point H") if wrong else nullcontext():
        judge(bodies)
