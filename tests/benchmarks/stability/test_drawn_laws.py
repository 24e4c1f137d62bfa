"""Random laws: their two forms are one law, and the reference follows what closed forms say."""

import numpy as np
import pytest
import sympy as sm

from benchmarks.stability.drawn_laws import motions
from benchmarks.stability.drawn_laws.draw import Cell, Law, Term, a, drawn, t
from benchmarks.stability.drawn_laws.reference import Reference


def value(law, force, time, y):
    """A force by SymPy, in 30 digits."""
    known = {t: time, a: law.a}
    for k in range(law.size):
        known |= {sm.Symbol(f"q{k}"): y[k], sm.Symbol(f"u{k}"): y[law.size + k]}
    exact = {key: sm.Float(x, 30) for key, x in known.items()}
    return complex(force.expr.xreplace(exact).evalf(20))


@pytest.mark.slow
def test_code_and_expression_of_a_law_are_one_function():
    rng, compared = np.random.default_rng(5), 0
    for seed in range(60):
        law = drawn(seed)
        reference = Reference(law)
        for _ in range(4):
            time, y = rng.uniform(0, 3), rng.uniform(-2, 2, 2 * law.size)
            try:
                b = reference._cells(time, y, law.a, None)
                found = reference.code.rates(time, y, law.a, b)[law.size :]
            except (ArithmeticError, ValueError):
                continue  # outside of a domain
            for force, x in zip(law.forces, found, strict=True):
                expected = value(law, force, time, y)
                assert abs(expected - x) <= 1e-9 * max(1.0, abs(expected)), (seed, force.expr)
                compared += 1
    assert compared > 250


def sliding(cells, code):
    force = Term(sm.S.Zero, code)
    return Law([force], cells, 1.0, np.array([1.0, 0.0]))


def test_a_spring_with_a_jump_is_followed_as_two_parabolas():
    """u' = -sign(q): from rest at 1 m, back after 4 sqrt(2) s."""
    law = sliding([Cell("q0", (0.0,))], "-(2 * b[0] - 1)")
    times = [1.0, np.sqrt(2) + 1.0, 4 * np.sqrt(2)]
    found = Reference(law).follow(times, law.y0, 1.0)
    expected = [[0.5, -1.0], [0.5 - np.sqrt(2), 1.0 - np.sqrt(2)], [1.0, 0.0]]
    np.testing.assert_allclose(found.y, expected, atol=1e-10)
    assert found.signature == (0, 0)


@pytest.mark.parametrize(
    ("code", "cell", "word"),
    [
        ("-9 * (2 * b[0] - 1) - u0 * 0", Cell("u0 + q0 * 0.1", (0.0,)), "sticks"),
        ("-1 / q0**3", Cell("q0", (0.0,), "pole"), "grows"),
        ("-1 - 0 * b[0]", Cell("q0", (0.0,), "domain"), "domain"),
    ],
)
def test_why_a_motion_ends_is_told(code, cell, word):
    law = sliding([cell], code)
    assert Reference(law).follow([3.0], law.y0, 1.0).word == word


@pytest.mark.thorough
def test_random_laws_move_as_their_references_do():
    rows = list(motions.of_seeds(range(12)))
    words = {row["word"] for row in rows}
    assert words <= {"right", "unjudged"}, [row for row in rows if row["word"] not in words]
    assert sum(row["word"] == "right" for row in rows) >= 9


@pytest.mark.slow
def test_another_motion_is_wrong():
    case = next(c for c in map(motions.followed, range(5)) if not isinstance(c, str))
    assert motions._judged(case, case.exact, "auto", 1e-9)["word"] == "right"
    moved = case.exact + 1e-3
    assert motions._judged(case, moved, "auto", 1e-9)["word"] == "WRONG"
