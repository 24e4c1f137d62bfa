"""Which knots of tables end steps."""

from __future__ import annotations

import numpy as np
import pytest
from mechc_codegen.compiler import Stopwatch, optimised_scene
from mechc_codegen.description.request import OutputRequest
from mechc_codegen.ir.program import SWITCHING, Knots
from sympy import Expr, Symbol
from sympy.physics.mechanics import dynamicsymbols

import mechc
from tests.support import scenes

q, u = dynamicsymbols("q u")
f = Symbol("f")
X = np.array([0.0, 0.5, 1.0, 2.0, 3.5])
Y = np.array([0.0, 0.2, -0.1, 0.3, 0.0])


def knots_of(load: Expr) -> tuple[Knots, ...]:
    request = OutputRequest(frozenset())
    scene = optimised_scene(scenes.bead_with(load), request, Stopwatch())
    program = scene.functions.program
    if program.knots:
        assert scene.metadata["switches"] == len(program.output(SWITCHING).elements)
    return program.knots


def places(load: Expr) -> list[float]:
    (knots,) = knots_of(load)
    assert knots.period is None
    return list(knots.values)


@pytest.mark.parametrize(
    ("outside", "ends"), [("extend", [0.5, 1.0, 2.0]), ("hold", [0.0, 0.5, 1.0, 2.0, 3.5])]
)
def test_lines_have_a_corner_at_each_sample(outside: str, ends: list[float]) -> None:
    assert places(mechc.Table(X, Y, kind="linear", outside=outside)(q)) == ends


def test_samples_on_a_line_have_none() -> None:
    assert knots_of(mechc.Table(X, 2 * X - 1, kind="linear")(q)) == ()
    assert knots_of(mechc.Table(X, X**3)(q)) == ()
    assert places(mechc.Table(X, 2 * X, kind="linear", outside="hold")(q)) == [0.0, 3.5]


def test_one_period_of_lines_has_its_first_corner() -> None:
    (knots,) = knots_of(mechc.Table(X, Y, kind="linear", outside="repeat")(q))
    assert (knots.values, knots.period) == ((0.0, 0.5, 1.0, 2.0), 3.5)


def test_a_spline_of_a_smooth_curve_has_few_and_its_second_derivative_all() -> None:
    x = np.linspace(0.0, 6.0, 601)
    table = mechc.Table(x, np.sin(x))
    assert 1 <= len(places(table(q))) <= 7
    assert len(places(table(q).diff(q, 2))) > 590


def test_a_narrow_bump_of_a_spline_has_knots_about_it() -> None:
    x = np.linspace(0.0, 10.0, 501)
    found = np.array(places(mechc.Table(x, np.exp(-(((x - 5.0) / 0.03) ** 2)))(q)))
    assert ((found > 4.9) & (found < 5.1)).sum() >= 5
    assert found[found < 4.9].max() > 4.6
    assert found[found > 5.1].min() < 5.4


def test_each_argument_that_moves_has_its_own() -> None:
    table = mechc.Table(X, X[:3], np.multiply.outer(Y, [0.0, 1.0, 5.0]), kind="linear")
    found = {str(each.argument): each.values for each in knots_of(table(q, u))}
    assert found == {"q0": (0.5, 1.0, 2.0), "u0": (0.5,)}
    (knots,) = knots_of(table(f, q))
    assert knots.values == (0.5,)
