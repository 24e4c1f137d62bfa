"""Short motions of random linkages: none wrong without a word, and the judge sees what is."""

import numpy as np
import pytest
from mpmath import cos, sin

from benchmarks.fuzz import command, exact, judge
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


@pytest.mark.thorough
def test_no_case_is_wrong_without_a_word(seed, thorough, capsys):
    code = command.main(
        ["--cases", str(THOROUGH if thorough else CASES), "--seed", str(1000 * seed)]
    )
    told = capsys.readouterr().out
    assert code == 0, told


@pytest.mark.thorough
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
    sol.__dict__["_history"] = (sol.t, moved)
    assert why in judge._not_kept(model, case, sol)


@pytest.mark.slow
def test_the_motion_in_digits_keeps_its_rods_and_its_energy():
    """Its equations of motion know no energy."""
    case = next(c for c in map(drawn, range(200)) if c.topology == "two loops" and c.params["g"])
    cranks = exact.Cranks(case)
    start = cranks.closed([exact.mpf(x) for x in case.y0.tolist()])
    (last,) = exact.by_extrapolation(cranks.rates, exact.numbers(start), [0.02], "0.01")
    end = [exact.of_mpmath(x) for x in last]
    assert max(map(abs, cranks.residual(end))) < 1e-35
    assert abs(energy_of(case, end) - energy_of(case, start)) < 1e-30
    np.testing.assert_allclose(np.array(start, float), case.y0, rtol=0, atol=1e-6)
    assert max(abs(a - b) for a, b in zip(start, end, strict=True)) > 1e-3


def energy_of(case, state):
    """By hand: an end goes around a circle about a tilted axis; up is 0.8 y + 0.6 z as doubles."""
    count, energy = len(state) // 2, 0
    for k, (q, u) in enumerate(zip(state[:count], state[count:], strict=True)):
        _, y, z, a, b, r, h, m = (exact.mpf(case.params[f"{x}_{k}"]) for x in "xyzabrhm")
        along, across = r * cos(q) * sin(b) - h * cos(b), r * sin(q)
        rise = 0.8 * (y + across * cos(a) + along * sin(a))
        rise += 0.6 * (z + across * sin(a) - along * cos(a))
        energy += m * (r * u) ** 2 / 2 + m * exact.mpf(case.params["g"]) * rise
    return energy


@pytest.mark.thorough
def test_a_right_run_ends_where_the_motion_in_digits_does():
    case = next(c for c in map(drawn, range(200)) if c.topology == "one loop" and c.rtol < 1e-8)
    told = judge.in_digits(case).replace(",", "").split()
    assert float(told[-3]) < 1e-7
    assert float(told[-1]) < 1e-7
