"""Which loads have a potential: found without dividing zero by zero."""

from __future__ import annotations

import pytest
from mechc_codegen.convert.convert import convert
from mechc_codegen.description.source import ConversionSettings
from mechc_codegen.frontend.read import read
from sympy import cos, exp, simplify, sin, sqrt, symbols
from sympy.physics.mechanics import KanesMethod, Particle, Point, ReferenceFrame, dynamicsymbols

t = dynamicsymbols._t
x, y, v, w = dynamicsymbols("x y v w")
m, mu, g, k = symbols("m mu g k")
N, O, P = ReferenceFrame("N"), Point("O"), Point("P")
O.set_vel(N, 0)
P.set_pos(O, x * N.x + y * N.y)
P.set_vel(N, v * N.x + w * N.y)
along = P.vel(N).normalize()


def potential(*forces):
    """What is known of the potential energy: its value, and the loads of which it is not."""
    kane = KanesMethod(N, [x, y], [v, w], [x.diff(t) - v, y.diff(t) - w])
    kane.kanes_equations([Particle("P", P, m)], [(P, force) for force in forces])
    made = convert(read(kane), ConversionSettings())
    return made.potential, made.unknown_potentials


def test_friction_along_the_velocity_has_none_and_weight_keeps_its_own() -> None:
    assert potential(-mu * m * g * along) == (0, ())
    assert potential(-mu * m * g * along - m * g * N.y) == (m * g * y, ())


def test_friction_whose_size_depends_on_the_place_has_none() -> None:
    assert potential(-mu * (1 + x**2) * along) == (0, ())


def test_beside_friction_a_spring_keeps_its_potential() -> None:
    found, unknown = potential(-mu * along - k * x * N.x)
    assert (found, unknown) == (k * x**2 / 2, ())


def test_a_force_with_a_part_that_has_no_value_at_rest_is_unknown() -> None:
    assert potential(k * (x + v / sqrt(w**2)) * N.x)[1] == ("the load on P",)


@pytest.mark.parametrize(
    "known",
    [
        k * (x**2 + y**2) / 2 + m * g * y,
        k * (sqrt(x**2 + y**2) - mu) ** 2 / 2,
        k * sin(x + 2 * y) * cos(y) + mu * exp(-g * x) * y,
        -g * m / sqrt(x**2 + y**2),
        k * (x - mu) ** 4 * y,
    ],
)
def test_forces_of_a_potential_have_it_but_for_a_constant(known) -> None:
    found, unknown = potential(-known.diff(x) * N.x - known.diff(y) * N.y)
    assert unknown == ()
    assert [simplify(found.diff(q) - known.diff(q)) for q in (x, y)] == [0, 0]


@pytest.mark.parametrize("force", [k * y * N.x, k * x * y * N.x, k * x * t * N.x, k * x * N.x / y])
def test_forces_that_turn_about_or_depend_on_time_have_none(force) -> None:
    assert potential(force)[1] == ("the load on P",)


def test_a_spring_between_two_bodies_and_one_in_a_joint_are_seen_together() -> None:
    theta, omega = dynamicsymbols("theta omega")
    A = N.orientnew("A", "Axis", (theta, N.z))
    A.set_ang_vel(N, omega * N.z)
    Q = P.locatenew("Q", mu * A.x)
    Q.v2pt_theory(P, N, A)
    kane = KanesMethod(N, [x, theta], [v, omega], [x.diff(t) - v, theta.diff(t) - omega])
    apart = Q.pos_from(O).xreplace({y: 0})
    kane.kanes_equations(
        [Particle("P", P, m), Particle("Q", Q, m)],
        [(Q, -k * apart), (A, -g * theta * N.z), (O, k * apart)],
    )
    found = convert(read(kane), ConversionSettings())
    known = k * (x**2 + 2 * mu * x * cos(theta)) / 2 + g * theta**2 / 2
    assert found.unknown_potentials == ()
    assert simplify(found.potential.xreplace({y: 0}) - known).free_symbols <= {k, mu}


def test_a_force_that_has_no_limit_at_rest_and_no_sign_is_unknown() -> None:
    assert potential(mu * N.x / sqrt(v**2 + w**2))[1] == ("the load on P",)


def test_a_root_that_is_not_real_at_random_values_is_no_hindrance() -> None:
    depth = symbols("l") - sqrt(symbols("l") ** 2 - x**2 - 9 * y**2)
    Q = O.locatenew("Q", x * N.x + y * N.y + depth * N.z)
    rates = {x.diff(t): v, y.diff(t): w}
    Q.set_vel(N, Q.pos_from(O).dt(N).xreplace(rates))
    kane = KanesMethod(N, [x, y], [v, w], [x.diff(t) - v, y.diff(t) - w])
    kane.kanes_equations([Particle("Q", Q, m)], [(Q, -m * g * N.z)])
    made = convert(read(kane), ConversionSettings())
    assert [body.name for body in made.bodies] == ["Q"]
    assert (made.potential - m * g * depth).expand() == 0
