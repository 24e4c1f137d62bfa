"""Reference motions: the second way's equations and integrator against others, to thirty digits."""

import json
from pathlib import Path

import numpy as np
import pytest

DATA = Path(__file__).parents[2] / "benchmarks" / "data"


@pytest.fixture
def references(module):
    return module("references")


def test_the_extrapolated_midpoint_rule_gives_thirty_digits(references):
    """x'' = -6 x^2 + 4 x, solved by x = sech(t)^2."""
    mpf, mpmath = references.mpf, references.mpmath
    rates = lambda y: [y[1], 4 * y[0] - 6 * y[0] ** 2]  # noqa: E731
    rows = references.by_extrapolation(rates, [mpf(1), mpf(0)], (0.5, 1.0), "0.3")
    for t, (x, v) in zip((0.5, 1.0), rows, strict=True):
        assert abs(x - mpmath.sech(t) ** 2) < mpf(10) ** -32
        assert abs(v + 2 * mpmath.sech(t) ** 2 * mpmath.tanh(t)) < mpf(10) ** -32


def test_a_step_that_is_too_long_is_taken_in_halves(references):
    mpf, mpmath = references.mpf, references.mpmath
    y = references.extrapolated(lambda y: [40 * y[0]], [mpf(1)], mpf(1), most=12)
    assert abs(y[0] / mpmath.exp(40) - 1) < mpf(10) ** -30


def test_lagranges_equations_by_hand_are_those_of_kane(references, module, monkeypatch):
    """A pendulum of four links at a state where nothing vanishes, to forty digits."""
    monkeypatch.setattr(references, "LINKS", 4)
    reference = references.pendulum_10()
    equations = module("_equations").derive(reference.mechanism, {})
    function = equations.rates().function("mpmath")
    rng = np.random.default_rng(0)
    y = [references.mpf(x) for x in rng.normal(size=8)]
    parameters = [references.mpf(reference.values[p.name]) for p in equations.parameters]
    found, expected = references.pendulum_by_hand()(y), function(*y, *parameters)
    apart = max(abs(a - b) for a, b in zip(found, expected, strict=True))
    assert apart < references.mpf(10) ** -40


def test_numbers_that_doubles_do_not_hold_are_refused(references, module):
    import sympy

    program, x = module("_program").program, sympy.Symbol("x")
    references.refuse_rounded_numbers(program((x,), (sympy.sin(x) / 8 + 0.75,)))
    with pytest.raises(ValueError, match="1/12"):
        references.refuse_rounded_numbers(program((x,), (sympy.sin(x) / 12,)))


@pytest.mark.parametrize("name", ["pendulum_10", "bicycle_motion"])
def test_what_is_written_has_thirty_digits_and_a_start(name):
    data = json.loads((DATA / f"{name}.json").read_text("utf-8"))
    assert data["digits"] >= 30
    assert float(data["rows"][0][0]) == 0.0
    widths = {len(row) for row in data["rows"]}
    assert widths == {len(data["columns"])}
    assert all(len(x.lstrip("-0.")) >= 28 for x in data["rows"][-1][1:])
