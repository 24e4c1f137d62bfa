"""Which loads have a potential: found without dividing zero by zero."""

from __future__ import annotations

import pytest
from mechc_codegen.convert.convert import convert
from mechc_codegen.description.source import ConversionSettings
from mechc_codegen.frontend.read import read
from sympy import sqrt, symbols
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


@pytest.mark.parametrize("force", [-mu * along - k * x * N.x, k * (x + v / sqrt(w**2)) * N.x])
def test_beside_friction_a_spring_is_still_one_whose_potential_is_not_known(force) -> None:
    assert potential(force)[1] == ("the load on P",)


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
