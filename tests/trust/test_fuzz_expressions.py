"""Typed expressions, reductions and values: read or refused soon, and read as Python reads them."""

import re

import mpmath as mp
import numpy as np
import pytest
import sympy as sm
from mechc_codegen.description.parsing.parser import FUNCTIONS, parse_expression
from mechc_codegen.errors import CodegenError
from sympy.physics.mechanics import dynamicsymbols

import mechc
from mechc.batch.reductions import read_reduction, read_stop
from mechc.system.units import read_seconds, read_value
from tests.support.trust.fuzzing import run_cases

pytestmark = pytest.mark.slow

t = dynamicsymbols._t
AT = 1.37  # s
PIECES = [
    "t", "2", "0.5", "1e3", "pi", "+", "-", "*", "/", "**", "^", "(", ")", "sin(", "exp(", "log(",
    "sqrt(", "abs(", "tan(", "1e999", "x", "__import__", ".", ",", "'", "[", "\0", "名", " ",
]  # fmt: skip
PYTHON = {"abs": abs} | {
    name: lambda *values, of=of: of(values)
    for of in (max, min)
    for name in (of.__name__, of.__name__.title())
}
OWN = {"pi": mp.pi} | {name: PYTHON.get(name) or getattr(mp, name) for name in FUNCTIONS}


def expression(draw, depth=0):
    """A well-formed one."""
    if depth > 3 or draw.random() < 0.2:
        return draw.choice(["t", "t", "pi", f"{draw.uniform(0, 4):.2f}", str(draw.randrange(1, 9))])
    kind = draw.random()
    if kind < 0.4:
        parts = [expression(draw, depth + 1) for _ in range(2)]
        return f"({parts[0]}{draw.choice('+-*/')}{parts[1]})"
    if kind < 0.5:
        return (
            f"({expression(draw, depth + 1)})**{draw.choice(['2', '3', '-1', '-12', '0.5', '12'])}"
        )
    if kind < 0.55:
        return f"(-{expression(draw, depth + 1)})"
    return f"{draw.choice(sorted(FUNCTIONS))}({expression(draw, depth + 1)})"


def _as_number(found):
    return f"(mpf({found[0]}) * scale)" if found[1] else f"mpf({found[0]})"


def exactly(text, scale=1.0, digits=40):
    """The value of a text that this file wrote, with so many digits; None where none is real.

    ``scale``: of t and of all decimal numbers.
    """
    numbers = re.sub(r"\d+(\.\d+)?(e\d+)?", _as_number, text)
    names = {**OWN, "t": mp.mpf(AT) * scale, "mpf": mp.mpf, "scale": scale}
    try:
        with mp.workdps(digits):
            value = eval(numbers.replace("^", "**"), {"__builtins__": {}}, names)
    except (ArithmeticError, ValueError):
        return None
    return float(value) if isinstance(value, (int, mp.mpf)) and abs(value) < 1e300 else None


def test_expressions(seed, thorough):
    def case(draw):
        sound = draw.random() < 0.7
        text = expression(draw)
        if not sound:
            place = draw.randrange(len(text) + 1)
            text = text[:place] + draw.choice(PIECES) + text[place + draw.randrange(3) :]
        if draw.random() < 0.1:
            text = "".join(draw.choice(PIECES) for _ in range(draw.randrange(40)))

        def call():
            try:
                found = parse_expression(text, {"t": t})
            except CodegenError as refused:
                raise ValueError(text) from refused
            wanted = exactly(text) if sound else None
            if wanted is not None:
                value = complex(sm.N(found.subs(t, sm.Float(AT, 30)), 20, maxn=200))
                assert value.imag == pytest.approx(0, abs=1e-9 * max(1.0, abs(wanted))), text
                assert value.real == pytest.approx(wanted, rel=1e-6, abs=1e-9) or _delicate(text), (
                    text
                )

        return call

    ended = run_cases(seed, thorough, 1_500, 200_000, case)
    assert ended["a value"] > 300


def _delicate(text):
    """Whether the last digits of what is inside decide the value."""
    near = [exactly(text, 1.0 - 1e-12), exactly(text, 1.0 + 1e-12)]
    near += [exactly(text, digits=15), exactly(text, digits=80)]
    return None in near or max(near) - min(near) > 1e-8 * abs(near[0])


WORDS = [
    "max", "min", "mean", "range", "final", "first", "abs", "norm", "(", ")", "[", "]", ",", "0",
    "1", "99", "theta_0", "omega_2", "energy", "points", "multipliers", ">", "<", "=", "180deg",
    "1e999", "-1", " ", "\n", "x", "名", "", "m", "__class__", "%",
]  # fmt: skip


def test_reductions_and_values(seed, thorough):
    model = mechc.load("four_bar")
    quantity = model.quantities["theta_0"]
    readers = [
        lambda text: read_reduction(model.system, text),
        lambda text: read_stop(model.system, text),
        lambda text: read_value(text, quantity),
        read_seconds,
    ]
    good = ["max(theta_2)", "first(theta_0 > 180deg)", "theta_0 > 360deg", "85deg", "1.5", "2min"]

    def case(draw):
        words = [draw.choice(WORDS) for _ in range(draw.randrange(1, 12))]
        text, reader = draw.choice(["".join(words), draw.choice(good)]), draw.choice(readers)
        return lambda: reader(text)

    ended = run_cases(seed, thorough, 10_000, 100_000, case)
    assert ended["a value"] > 100


@pytest.mark.thorough
def test_what_is_read_is_derived_soon(seed, thorough):
    """An expression that is taken also goes through the compiler."""
    taken = []

    def case(draw):
        text = expression(draw, 1)

        def call():
            try:
                model = mechc.load("four_bar", crank_torque=text)
            except mechc.MechcError as refused:
                raise ValueError(text) from refused
            start = model.assemble({"theta_0": 1.4})
            with np.errstate(all="ignore"):
                assert model.rhs(0.3, start).shape == (6,)
            taken.append(text)

        return call

    run_cases(seed, thorough, 8, 200, case)
    assert taken
