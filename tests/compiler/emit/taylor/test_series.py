"""Emitted recurrences give the Taylor coefficients that SymPy derives from the same equations."""

from __future__ import annotations

import ctypes
import random
import subprocess

import pytest
import sympy as sm
from mechc_codegen import build_scene, compiler, from_equations
from mechc_codegen.convert.convert import ConversionSettings
from mechc_codegen.extension.flags import FLAGS, RUNTIME
from mechc_codegen.frontend.compile_request import CompileOptions, CompileRequest
from sympy.physics.mechanics import dynamicsymbols

from mechc.compilation import toolchain

ORDERS = 3
A, B, C = PARAMETERS = sm.symbols("A B C")
VALUES = {A: 1.3, B: 2.1, C: 0.7}
STATE = (0.4, -0.6)
# What a factor of a series may be.
FACTORS = [
    A + B, A - B, -A, A * B, A / B, -(A + C), A * (B - C), (A - B) / (B + C), -A * B / C, B - 1,
    2 * A - 3, 1 - A * B, -1, sm.Rational(-1, 3), A**2 - B, 1 / (A - B), -C / (A + B), sm.pi * A,
    A - sm.sqrt(2), sm.cos(2) * sm.Abs(B), -sm.cos(2) * B,
]  # fmt: skip
SOURCE = """
#include "simd/bind_scalar.h"
#include "scene_program.h"
#include "series/coefficients.h"

void coefficients(const double *y, const double *p, double *out)
{
    mechc_scalar_given given = {0};
    double rows[%d][MECHC_SERIES];
    for (int i = 0; i < MECHC_NP; i++) given.p[i] = p[i];
    mechc_scalar_hoist(given.p, given.k);
    mechc_scalar_series(0.0, y, &given, 1.0, %d, rows);
    for (int k = 0; k <= %d; k++)
        for (int i = 0; i < MECHC_NX; i++) *out++ = rows[k][i];
}
"""


def drawn_force(rng: random.Random, x: sm.Expr, v: sm.Expr) -> sm.Expr:
    """Terms with factors; some stand before a series, others in it, over it or as an exponent."""

    def factor() -> sm.Expr:
        return rng.choice(FACTORS)

    def term() -> sm.Expr:
        inner = rng.choice([x, v, x + factor(), 2 * x - v, factor() * x])
        return rng.choice([
            inner, x * v, v**2, sm.sin(inner), sm.cos(inner), x * sm.sin(x), sm.exp(factor() * x),
            1 / (3 + factor() ** 2 + sm.sin(x)), sm.sqrt(2 + x**2), sm.log(3 + factor() ** 2 + x),
            (2 + x**2) ** A, factor() / (x + 3), sm.tan(x / 3), (x + v) / (A + B),
        ])  # fmt: skip

    return sum((factor() * term() for _ in range(rng.randint(1, 3))), factor())


def exact(force: sm.Expr, x: sm.Expr, v: sm.Expr) -> list[tuple[float, float]]:
    """Coefficients of x and v, by derivatives along the motion."""
    values = {key: sm.Float(each, 30) for key, each in {**VALUES, x: STATE[0], v: STATE[1]}.items()}
    derivatives = [x, v]
    while len(derivatives) < ORDERS + 2:
        last = derivatives[-1]
        derivatives.append(last.diff(x) * v + last.diff(v) * force)
    numbers = [d.xreplace(values).evalf(30) / sm.factorial(k) for k, d in enumerate(derivatives)]
    speeds = [(k + 1) * each for k, each in enumerate(numbers[1:])]
    return [(float(a), float(b)) for a, b in zip(numbers, speeds, strict=False)]


def emitted(folder, x, v, masses, forces) -> list[list[float]]:
    """The rows that the compiled recurrences give."""
    n = len(x)
    mass = [[masses[i] if i == j else 0 for j in range(n)] for i in range(n)]
    made = from_equations(x, v, mass, forces)
    request = CompileRequest(made, CompileOptions(ConversionSettings(), outputs=()))
    mechanism, outputs = request.description()
    texts = build_scene(mechanism, request=outputs).texts
    for name in ("scene_sizes.h", "scene_program.h", "scene_series.h"):
        (folder / name).write_text(texts[name], "utf-8")
    (folder / "series.c").write_text(SOURCE % (ORDERS + 1, ORDERS, ORDERS), "utf-8")
    flags = [flag for flag in FLAGS if not flag.startswith(("-O", "-fvisibility"))]
    command = [*toolchain.compiler(), *flags, "-O0", "-DMECHC_LANES=2", f"-I{RUNTIME}", "-I."]
    command += ["-shared", "-fPIC", "series.c", "-lm", "-o", "series.so"]
    subprocess.run(command, cwd=folder, check=True)
    y = (ctypes.c_double * (2 * n))(*[STATE[0]] * n, *[STATE[1]] * n)
    order = [sm.Symbol(str(p.symbol)) for p in mechanism.parameters]
    p = (ctypes.c_double * len(order))(*(VALUES[symbol] for symbol in order))
    out = (ctypes.c_double * (2 * n * (ORDERS + 1)))()
    ctypes.CDLL(str(folder / "series.so")).coefficients(y, p, out)
    return [list(out[2 * n * k : 2 * n * (k + 1)]) for k in range(ORDERS + 1)]


@pytest.mark.parametrize(("count", "seed", "plain"), [(8, 1, True), (8, 5, False), (1, 3, True)])
def test_coefficients_of_drawn_equations(tmp_path, monkeypatch, count, seed, plain):
    """Equations side by side, every second one with a mass that depends on its coordinate.

    ``plain``: the program is not optimised, so that its factors are those of the equations.
    """
    if plain:
        monkeypatch.setattr(compiler, "optimize", lambda program: program)
    rng = random.Random(seed)
    x, v = ([dynamicsymbols(f"{name}{i}") for i in range(count)] for name in "xv")
    masses = [
        1 + A**2 * (i % 2) + rng.choice(FACTORS) * sm.sin(each) * (i % 2) / 4
        for i, each in enumerate(x)
    ]
    forces = [drawn_force(rng, a, b) for a, b in zip(x, v, strict=True)]
    rows = emitted(tmp_path, x, v, masses, forces)
    for i in range(count):
        expected = exact(forces[i] / masses[i], x[i], v[i])
        for k, (a, b) in enumerate(expected):
            found = rows[k][i], rows[k][count + i]
            assert found == pytest.approx((a, b), rel=1e-10, abs=1e-12), (masses[i], forces[i])
