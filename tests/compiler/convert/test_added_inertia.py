"""Loads that hold accelerations are inertia where they can be, and refused by name where not."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import sympy.physics.mechanics as me
from mechc_codegen.convert.convert import convert
from mechc_codegen.derive.kane import derive
from mechc_codegen.description.mechanism import Mechanism
from mechc_codegen.description.source import ConversionSettings
from mechc_codegen.errors import MechanismError
from mechc_codegen.frontend.read import read
from sympy import Expr, Matrix, sin, symbols

import mechc

t = me.dynamicsymbols._t
x, q, v, u = me.dynamicsymbols("x q v u")
m, m_a, l, I_a, g = symbols("m m_a l I_a g")
N, O = me.ReferenceFrame("N"), me.Point("O")
O.set_vel(N, 0)
A = N.orientnew("A", "Axis", (q, N.z))
A.set_ang_vel(N, u * N.z)
C = O.locatenew("C", x * N.x)
C.set_vel(N, v * N.x)
P = C.locatenew("P", -l * A.y)
P.v2pt_theory(C, N, A)


def swinging(mass: Expr, *loads: Any) -> me.KanesMethod:
    """A particle on a rod whose pivot slides."""
    kane = me.KanesMethod(N, [x, q], [v, u], [x.diff(t) - v, q.diff(t) - u])
    bodies = [me.Particle("P", P, mass), me.RigidBody("rod", C, A, 1, (me.inertia(A, 0, 0, 1), C))]
    kane.kanes_equations(bodies, [(P, -m * g * N.y), *loads])
    return kane


def mechanism(thing: Any) -> Mechanism:
    return convert(read(thing), ConversionSettings())


def mass_matrix(made: Mechanism) -> Matrix:
    equations = derive(made)
    names = [p.symbol for p in made.parameters]
    known = dict(zip(equations.symbols.parameters, names, strict=True))
    return Matrix(2, 2, [e.xreplace(known) for e in equations.outputs["mass_matrix"].elements])


def test_the_water_that_moves_along_is_a_mass() -> None:
    """A force against the acceleration of a point is what more mass there would be."""
    made = mechanism(swinging(m, (P, -m_a * P.acc(N)), (A, -I_a * u.diff(t) * N.z)))
    heavier = mass_matrix(mechanism(swinging(m))).subs(m, m + m_a)
    heavier[1, 1] += I_a
    assert (mass_matrix(made) - heavier).expand().is_zero_matrix
    assert any("holds accelerations" in name for name in made.unknown_potentials)


def test_rates_are_those_of_the_heavier_particle() -> None:
    """Whose weight is that of the lighter one."""
    values = {"m": 2.0, "m_a": 0.7, "l": 0.5, "g": 9.81}
    compiled = mechc.compile(swinging(m, (P, -m_a * P.acc(N))), defaults=values)
    heavier = mechc.compile(swinging(m + m_a), defaults=values)
    y = np.random.default_rng(0).normal(size=(5, 4))
    assert np.abs(compiled.rhs(0.0, y) - heavier.rhs(0.0, y)).max() < 1e-13
    with pytest.raises(mechc.UnavailableOutputError, match="holds accelerations"):
        compiled.energy(y)


def test_second_derivatives_of_coordinates_are_rates_of_speeds() -> None:
    made = mass_matrix(mechanism(swinging(m, (C, -m_a * x.diff(t, 2) * N.x))))
    plain = mass_matrix(mechanism(swinging(m)))
    assert (made - plain).expand() == Matrix([[m_a, 0], [0, 0]])


@pytest.mark.parametrize(
    ("load", "why"),
    [
        ((C, -m_a * u.diff(t) * N.x), "asymmetric"),
        ((C, -m_a * v.diff(t) ** 2 * N.x), "not linear"),
        ((C, -m_a * sin(v.diff(t)) * N.x), "not linear"),
    ],
)
def test_what_is_no_bodys_inertia_is_refused_by_name(load: Any, why: str) -> None:
    with pytest.raises(MechanismError, match=f"load on C holds accelerations and .*{why}"):
        mechanism(swinging(m, load))
