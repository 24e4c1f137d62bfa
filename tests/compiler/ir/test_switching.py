"""Which functions show where the equations have a corner or a jump."""

from __future__ import annotations

import math
from dataclasses import replace

import mpmath
import pytest
from mechc_codegen.compiler import Stopwatch, optimised_scene
from mechc_codegen.description.request import OutputRequest
from mechc_codegen.ir.program import SWITCHING, Program, slice_statements, symbols_in
from sympy import (
    Abs,
    Expr,
    Heaviside,
    Max,
    Min,
    Piecewise,
    S,
    Symbol,
    acos,
    asin,
    atan,
    atan2,
    cos,
    cosh,
    exp,
    floor,
    pi,
    sign,
    sin,
    sqrt,
    tan,
    tanh,
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
    return scene.functions.program, scene.metadata


def found(load: Expr) -> list[float]:
    """The values of its switching functions in one state."""
    program, metadata = made(load)
    outputs = [o for o in program.outputs if o.name == SWITCHING]
    if not outputs:
        assert "switches" not in metadata
        return []
    needed = slice_statements(program.body, symbols_in(outputs[0].elements))
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
        (atan2(sin(q), cos(q)), [sin(q)]),
        (atan2(u + q, f - q), [u + q]),
        (atan(tan(q)) + tanh(1 / (q - f)), [cos(q), q - f]),
        (asin(sin(q)) + acos(f * cos(u)), [cos(q), sin(u)]),
        (acos(q * t), [q + t * u]),
        (sqrt(q**2 + q**4) + (u**2 * (1 + q**2)) ** (f / 3), [q, u]),
        (sqrt(1 - cos(q)) + sqrt(2 + 2 * sin(u)), [sin(q / 2), cos(u / 2 - pi / 4)]),
        (sign(tan(q)), [sin(q), cos(q)]),
        (Heaviside(1 / (q - f)), [q - f]),
        (Abs(q + 1 / u), [q * u + 1, u]),
        (sqrt(1 - sin(q) ** 2) + sqrt(u**2 - 2 * f * u + f**2), [cos(q), u - f]),
        (acos(1 - sin(u) ** 2 / 2) + 1 / sqrt(1 + 1 / q**2), [sin(u), q]),
        (acos(cos(Abs(q) ** 3) * f), [sin(Abs(q) ** 3), q]),
    ],
)
def test_the_arguments_of_corners_and_jumps_are_found(load: Expr, functions: list[Expr]) -> None:
    wanted = {round(abs(float(x.subs(STATE))), 12) for x in functions}
    assert {round(abs(x), 12) for x in found(load)} == wanted


@pytest.mark.parametrize(
    ("load", "edges"),
    [
        (exp(-(((t - f) / 2) ** 2)), [(t - f) / 12 - 1, (t - f) / 12 + 1, (t - f) / 1.5]),
        (exp(-100 * Abs(q)), [q, 100 * q / 36 - 1, 100 * q / 36 + 1, 800 * q / 36]),
        (exp(f * q - 1000 * q**2), [(f * q - 1000 * q**2) / 36 + 1]),
        (exp(f - 900 * q**2), [(f - 900 * q**2) / 36 + 1, 40 * q]),
        (tanh(50 * u), [50 * u / 18 - 1, 50 * u / 18 + 1, 400 * u / 18]),
        (1 / (1 + exp(-f * q)) + u, [f * q / 36 - 1, f * q / 36 + 1, f * q / 4.5]),
        (1 / cosh(9 * q), [q / 4 - 1, q / 4 + 1, 2 * q]),
        (exp(-t) + exp(q) + tanh(f) + sin(q) ** 6 + 1 / (1 + sin(q) ** 2) + 1 / (1 - q**2), []),
        (atan(50 * u), [50 * u / 18 - 1, 50 * u / 18 + 1, 400 * u / 18]),
        (atan2(u, exp(-900 * q**2)), [u, 5 * q - 1, 5 * q + 1, 40 * q]),
        (1 / (2 + 800 * q**2), [q / 0.9 - 1, q / 0.9 + 1, 8 * q / 0.9]),
    ],
)
def test_the_edges_of_narrow_features_are_found(load: Expr, edges: list[Expr]) -> None:
    wanted = {round(abs(float(x.subs(STATE))), 9) for x in edges}
    assert {round(abs(x), 9) for x in found(load)} == wanted


def test_a_train_of_pulses_has_edges_where_it_is_nothing_for_half_of_the_time() -> None:
    edge = math.exp(-36 / 400)
    wanted = {(math.sin(3 * 0.29) + side * edge) / (1 - edge) for side in (-1, 1)}
    wanted.add(8 * math.cos(3 * 0.29) / math.sqrt(1 - edge**2))
    assert sorted(found(sin(3 * t) ** 400)) == pytest.approx(sorted(wanted), rel=1e-9)
    assert found(sin(3 * t) ** 40) == []


def test_an_argument_of_asin_touches_one_where_its_square_is_written_out() -> None:
    """2w / (1 + w^2) does at w = 1 and w = -1."""
    touched = {round(x, 9) for x in found(asin((6 * u - 2) / ((3 * u - 1) ** 2 + 1)))}
    assert touched >= {round(float(x.subs(STATE)), 9) for x in (3 * u - 2, u)}


def test_one_function_is_found_once() -> None:
    assert len(found(sign(u) * Abs(u) - Max(u, 0))) == 1


def test_outputs_of_the_users_own_are_not_looked_at() -> None:
    assert "switches" not in made(-q, own_0=sign(u))[1]


@pytest.mark.parametrize("load", [-q, -Abs(f) * q, cos(u), sqrt(f**2) * u, sign(f - 2) * q])
def test_smooth_equations_and_what_parameters_decide_have_none(load: Expr) -> None:
    assert found(load) == []
    assert made(load)[1]["smooth"]


def test_the_arguments_of_tables_follow_the_jumps() -> None:
    """Their knots end steps: see test_knots.py."""
    table = mechc.Table([0.0, 0.5, 1.0, 2.0], [0.0, 0.1, 0.5, 0.0], outside="hold")
    assert found(table(q) - sign(u)) == [-STATE[u], STATE[q]]
    assert not made(table(q))[1]["smooth"]
