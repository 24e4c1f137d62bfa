"""Reference motions: the second way's equations against others, and what is written."""

import json

import numpy as np
import pytest
import sympy
from mpmath import mpf

from benchmarks.formulations.equations import derive
from benchmarks.formulations.program import program
from benchmarks.references import motions
from tests.support import DATA


def test_lagranges_equations_by_hand_are_those_of_kane(monkeypatch):
    """A pendulum of four links at a state where nothing vanishes, to forty digits."""
    monkeypatch.setattr(motions, "LINKS", 4)
    reference = motions.pendulum_10()
    equations = derive(reference.mechanism, {})
    function = equations.rates().function("mpmath")
    rng = np.random.default_rng(0)
    y = [mpf(x) for x in rng.normal(size=8)]
    parameters = [mpf(reference.values[p.name]) for p in equations.parameters]
    found, expected = motions.pendulum_by_hand()(y), function(*y, *parameters)
    apart = max(abs(a - b) for a, b in zip(found, expected, strict=True))
    assert apart < mpf(10) ** -40


def test_numbers_that_doubles_do_not_hold_are_refused():
    x = sympy.Symbol("x")
    motions.refuse_rounded_numbers(program((x,), (sympy.sin(x) / 8 + 0.75,)))
    with pytest.raises(ValueError, match="1/12"):
        motions.refuse_rounded_numbers(program((x,), (sympy.sin(x) / 12,)))


@pytest.mark.parametrize("name", ["pendulum_10", "bicycle_motion"])
def test_what_is_written_has_thirty_digits_and_a_start(name):
    data = json.loads((DATA / f"{name}.json").read_text("utf-8"))
    assert data["digits"] >= 30
    assert float(data["rows"][0][0]) == 0.0
    widths = {len(row) for row in data["rows"]}
    assert widths == {len(data["columns"])}
    assert all(len(x.lstrip("-0.")) >= 28 for x in data["rows"][-1][1:])
