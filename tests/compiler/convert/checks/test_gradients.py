"""Constraints that hold only where they have no gradient are told from all others."""

from __future__ import annotations

from dataclasses import replace

import pytest
from mechc_codegen.convert.checks.gradients import without_gradient
from mechc_codegen.convert.classify_constraints import Rates
from mechc_codegen.convert.convert import convert
from mechc_codegen.description.mechanism import Constraint
from mechc_codegen.description.source import ConversionSettings
from mechc_codegen.errors import MechanismError
from mechc_codegen.frontend.compile_request import CompileOptions, CompileRequest
from mechc_codegen.frontend.read import read
from sympy import Abs, Expr, Max, Piecewise, acos, cos, cosh, exp, sin, sqrt, symbols, tan, tanh
from sympy.physics.mechanics import KanesMethod, LagrangesMethod, dynamicsymbols

from tests.support.sympy_objects import four_bar_system, slider

q, u = dynamicsymbols("q1:6"), dynamicsymbols("u1:6")
a, b, c, d = symbols("a b c d", positive=True)
X = a * cos(q[0]) + b * cos(q[1]) - c * cos(q[2]) - d
Y = a * sin(q[0]) + b * sin(q[1]) - c * sin(q[2])
Z = q[3] - sin(q[4]) * q[0]
BETWEEN = q[0] - q[1]
ROD = BETWEEN**2 + (q[2] - a) ** 2


def found(row: Expr) -> bool:
    return without_gradient([row], Rates((q, u), u, [a, b, c, d], {})) == [0]


@pytest.mark.parametrize("row", [
    sqrt(X**2 + Y**2), -sqrt(X**2 + Y**2), 1e6 * sqrt(X**2 + Y**2), sqrt(X**2 + Y**2 + Z**2),
    sqrt(ROD), X**2, X**2 + Y**2, X**2 * exp(q[1]), BETWEEN**4, X**3, Abs(X), 2 * Abs(BETWEEN),
    1 - cos(BETWEEN), cos(q[0]) * cos(q[1]) + sin(q[0]) * sin(q[1]) - 1, acos(cos(BETWEEN)),
    cosh(X) - 1, exp(X**2) - 1, Max(X, 0), Piecewise((X, X > 0), (0, True)),
], ids=str)  # fmt: skip
def test_distances_squares_and_their_kind_are_found(row: Expr) -> None:
    assert found(row)


@pytest.mark.parametrize("row", [
    X, Y, 1e-6 * X, 1e6 * Y, BETWEEN, BETWEEN * X, sqrt(ROD) - b, ROD - b**2, q[0] ** 2 - a,
    q[0] ** 2 + q[1] ** 2 + q[2] ** 2 + q[3] ** 2 - 1, cos(q[0]) - cos(q[1]), tan(q[0]) - q[1],
    q[0] / q[1] - 1, q[0] - 5, q[0] - sin(dynamicsymbols._t), exp(X) - 1, Abs(q[0]) - a,
    Max(q[0], q[1]) - a, sqrt(q[0] + 2) - q[1], q[0] - 3 + q[1] ** 2 / 100, tanh(20 * BETWEEN),
    1 / sqrt(q[0] ** 2 + q[1] ** 2) - a,
], ids=str)  # fmt: skip
def test_constraints_with_a_gradient_are_not(row: Expr) -> None:
    assert not found(row)


def test_a_constraint_without_coordinates_is_told_as_such() -> None:
    """A rod from a point at rest to another: its length is theirs."""
    x = dynamicsymbols("x")
    rod = LagrangesMethod(x.diff() ** 2, [x], hol_coneqs=[(4 - a**2) / a])
    rod.form_lagranges_equations()
    with pytest.raises(MechanismError, match="constraint 1 contains no coordinate"):
        CompileRequest(rod, CompileOptions(ConversionSettings())).description()


def test_every_kind_of_object_is_refused_with_what_to_write() -> None:
    """The loop of a four-bar as the distance of its ends; a bead at a distance of zero."""
    system, x, y = four_bar_system(), *dynamicsymbols("x y")
    gaps = list(system.holonomic_constraints)
    system.holonomic_constraints = [sqrt(gaps[0] ** 2 + gaps[1] ** 2)]
    distance = sqrt((x - a) ** 2 + y**2)
    lagrange = LagrangesMethod(x.diff() ** 2 + y.diff() ** 2, [x, y], hol_coneqs=[distance])
    lagrange.form_lagranges_equations()
    rows = (Constraint("distance", distance, "m"),)
    bead = convert(read(slider()), ConversionSettings(parameters=[a]))
    described = replace(bead, configuration_constraints=rows)
    added = ConversionSettings(configuration_constraints=[distance])
    for thing in (system, lagrange, slider(), described):
        options = CompileOptions(added if isinstance(thing, KanesMethod) else ConversionSettings())
        with pytest.raises(MechanismError, match=r"no gradient.*Write its components"):
            CompileRequest(thing, options).description()
