"""Which functions show where the equations have a corner or a jump."""

from __future__ import annotations

from dataclasses import replace

import mpmath
import pytest
from mechc_codegen.compiler import Stopwatch, optimised_scene
from mechc_codegen.description.request import OutputRequest
from mechc_codegen.ir.program import SWITCHING, Program, slice_statements, symbols_of
from sympy import (
    Abs,
    Expr,
    Heaviside,
    Max,
    Min,
    Piecewise,
    S,
    Symbol,
    cos,
    floor,
    pi,
    sign,
    sin,
    sqrt,
)
from sympy.physics.mechanics import dynamicsymbols

import mechc
from tests.support import scenes

q, u = dynamicsymbols("q u")
t, f = dynamicsymbols._t, Symbol("f")
STATE = {q: 0.37, u: -0.81, f: 1.3, t: 0.29}


def made(load: Expr, **own: Expr) -> tuple[Program, dict[str, object]]:
    """Program and metadata of a bead under this force, with outputs of the user's own."""
    request = OutputRequest(frozenset(), expressions=own)
    scene = optimised_scene(scenes.bead_with(load), request, Stopwatch())
    return scene.program, scene.metadata


def found(load: Expr) -> list[float]:
    """The values of its switching functions in one state."""
    program, metadata = made(load)
    outputs = [o for o in program.outputs if o.name == SWITCHING]
    if not outputs:
        assert "switches" not in metadata
        return []
    needed = slice_statements(program.body, symbols_of(outputs[0].elements))
    alone = replace(program, body=tuple(needed), outputs=(outputs[0],))
    symbols = program.symbols
    known = dict(
        zip(
            (*symbols.q, *symbols.u, *symbols.parameters, symbols.time),
            (mpmath.mpf(STATE[x]) for x in (q, u, f, t)),
            strict=True,
        )
    )
    values = scenes.run_program(alone, known)[SWITCHING]
    assert metadata["switches"] == len(values)
    assert SWITCHING not in str(metadata["shapes"])
    return [float(x) for x in values]


@pytest.mark.parametrize(
    ("load", "functions"),
    [
        (-sign(u) - 4 * q, [u]),
        (sqrt((q**2 - u) ** 2) - q, [q**2 - u]),
        (Max(q - f, 0) - Min(q - f, 0), [q - f]),
        (Piecewise((-q, (q > f) & (u < 0)), (S.Zero, True)), [q - f, u]),
        (Heaviside(sin(3 * t)) * Abs(q), [sin(3 * t), q]),
        (floor(2 * q + u), [sin(pi * (2 * q + u))]),
        (Abs(q + Abs(u)), [q + Abs(u), u]),
    ],
)
def test_the_arguments_of_corners_and_jumps_are_found(load: Expr, functions: list[Expr]) -> None:
    wanted = {round(abs(float(x.subs(STATE))), 12) for x in functions}
    assert {round(abs(x), 12) for x in found(load)} == wanted


def test_one_function_is_found_once() -> None:
    assert len(found(sign(u) * Abs(u) - Max(u, 0))) == 1


def test_outputs_of_the_users_own_are_not_looked_at() -> None:
    assert "switches" not in made(-q, own_0=sign(u))[1]


@pytest.mark.parametrize("load", [-q, -Abs(f) * q, cos(u), sqrt(f**2) * u, sign(f - 2) * q])
def test_smooth_equations_and_what_parameters_decide_have_none(load: Expr) -> None:
    assert found(load) == []
    assert made(load)[1]["smooth"]


def test_a_table_has_corners_that_none_shows() -> None:
    table = mechc.Table([0.0, 0.5, 1.0, 2.0], [0.0, 0.1, 0.5, 0.0])
    assert found(table(q) - sign(u)) == []
    assert not made(table(q))[1]["smooth"]
