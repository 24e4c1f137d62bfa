"""Short motions of random linkages: none wrong without a word, and the judge sees what is."""

import numpy as np
import pytest

from benchmarks.fuzz import command, judge
from benchmarks.fuzz.draw import drawn
from benchmarks.fuzz.scenes import TOPOLOGIES

CASES, THOROUGH = 200, 1_000_000


def test_a_seed_draws_one_case():
    first, second = drawn(7), drawn(7)
    assert str(first) == str(second)
    np.testing.assert_array_equal(first.y0, second.y0)
    assert first.params == second.params


def test_every_kind_is_drawn():
    cases = [drawn(seed) for seed in range(300)]
    assert {case.topology for case in cases} == set(TOPOLOGIES)
    assert {case.kind for case in cases} == {"planar", "spherical", "spatial"}
    assert any(not case.y0[len(case.y0) // 2 :].any() for case in cases)


@pytest.mark.slow
def test_no_case_is_wrong_without_a_word(seed, thorough, capsys):
    code = command.main(
        ["--cases", str(THOROUGH if thorough else CASES), "--seed", str(1000 * seed)]
    )
    told = capsys.readouterr().out
    assert code == 0, told


@pytest.mark.slow
@pytest.mark.parametrize(("changed", "why"), [("q", "closure"), ("u", "energy")])
def test_a_wrong_motion_is_seen(monkeypatch, changed, why):
    """The judge is given states that do not belong to the motion."""
    case = next(c for c in map(drawn, range(50)) if c.topology == "one loop" and c.rtol < 1e-7)
    model = judge.model_of(case)
    sol = judge._run(model, case, judge._closed(model, case))
    assert judge.judged(case).word in ("right", "flagged", "warned")
    half = len(model.coordinates)
    moved = sol.y.copy()
    moved[-1, slice(0, half) if changed == "q" else slice(half, None)] += 0.1
    sol.__dict__["_record"] = (sol.t, moved)
    assert why in judge._not_kept(model, case, sol)
