"""The stress suite: its judges have teeth, and every family runs and says what it found."""

import json

import numpy as np
import pytest

import mechc


@pytest.fixture
def judge(module):
    return module("_stress_judge")


@pytest.fixture
def regular():
    """A finished run of the regular four-bar."""
    model = mechc.load("four_bar")
    y0 = model.assemble({"theta_0": 1.0}, params={"l_3": 3.5})
    return model.simulate(1.0, y0, {"l_3": 3.5})


# -- the judge ------------------------------------------------------------------------------------


def test_a_wrong_end_is_called_wrong_and_a_right_one_right(judge, regular):
    exact = regular.y[-1]
    assert judge.verdict("", regular, exact, 1e-9)["word"] == "right"
    wrong = judge.verdict("", regular, exact + 2e-9, 1e-9)
    assert wrong["word"] == "WRONG"
    assert wrong["excess"] == pytest.approx(2.0)


def test_an_end_that_is_not_a_number_is_wrong(judge):
    assert judge.measured("", np.array([np.nan]), np.zeros(1), 1.0)["word"] == "WRONG"


def test_what_ended_early_is_flagged_and_what_was_not_begun_is_refused(judge, regular):
    model = regular.model
    cut = judge.attempt(model, 1.0, regular.y[0], {"l_3": 3.5}, max_steps=2)
    assert judge.verdict("", cut, regular.y[-1], 1e-9)["word"] == "flagged"
    refused = judge.attempt(model, 1.0, regular.y[0], {"l_3": -1.0})
    assert judge.verdict("", refused, regular.y[-1], 1e-9)["word"] == "refused"
    with pytest.raises(TypeError):
        judge.attempt(model, 1.0, regular.y[0], tolerance=1.0)  # a defect of the suite, not a word


def test_no_limit_is_so_wide_that_any_motion_meets_it(judge):
    assert judge.limit_of(1e-9, 10.0, 0.0) == pytest.approx(1e-6)
    assert judge.limit_of(0.1, 1e6) == judge.LARGEST < 0.5


def test_json_of_rows_has_no_infinities(judge):
    told = judge.tidy([{"a": np.float64("inf"), "b": np.int64(3), "c": [float("nan"), 1.0]}])
    assert json.dumps(told, allow_nan=False) == '[{"a": null, "b": 3, "c": [null, 1.0]}]'


# -- the table ------------------------------------------------------------------------------------


@pytest.fixture
def stress(module):
    return module("stress")


def rows_of(words):
    return [{"case": word, "word": word, "excess": 0.5} for word in words]


def summed_up(stress, words, least=0.5):
    family = stress.Family("holds", lambda quick: iter(()), least)
    return stress.summary("made up", family, rows_of(words), 0.0)


def test_one_wrong_run_fails_a_family(stress):
    assert summed_up(stress, ["right"] * 9)["passed"]
    found = summed_up(stress, ["right"] * 9 + ["WRONG"])
    assert not found["passed"]
    assert found["wrong"] == 1


def test_a_family_that_refuses_too_much_fails(stress):
    assert summed_up(stress, ["right", "refused"])["passed"]
    found = summed_up(stress, ["right", "refused", "flagged"])
    assert not found["passed"]
    assert "less than 50%" in found["note"]


def test_a_family_without_runs_fails(stress):
    assert not summed_up(stress, [], least=0.0)["passed"]


def test_a_family_that_breaks_off_is_wrong_and_keeps_its_rows(stress, monkeypatch):
    def rows(quick):
        yield from rows_of(["right"])
        raise RuntimeError("the scene misses its dead points")

    monkeypatch.setitem(stress.FAMILIES, "units", stress.Family("", rows))
    found, _ = stress.family_rows("units", True)
    assert [row["word"] for row in found] == ["right", "WRONG"]
    assert "misses its dead points" in found[-1]["status"]


def test_the_suite_prints_a_table_and_writes_json(stress, module, capsys):
    code = stress.main(["--quick", "--family", "bad arguments", "dead points", "--processes", "1"])
    assert code == 0
    written = json.loads((module("_scene").OUT / "stress.json").read_text())
    assert [f["family"] for f in written["families"]] == ["bad arguments", "dead points"]
    assert {row["family"] for row in written["rows"]} == {"bad arguments", "dead points"}
    assert all(f["passed"] and f["promise"] for f in written["families"])
    assert "dead points" in capsys.readouterr().out


def test_a_wrong_run_makes_the_exit_code(stress, monkeypatch):
    wrong = stress.Family("", lambda quick: iter(rows_of(["WRONG"])))
    monkeypatch.setitem(stress.FAMILIES, "units", wrong)
    assert stress.main(["--family", "units"]) == 1


# -- judges against what is known of old ----------------------------------------------------------


def test_the_motion_along_the_tangent_is_the_exact_one(module):
    """Written without a constraint; the reference states have 16 digits."""
    tangent, scene = module("_four_bar_tangent"), module("_scene")
    y0 = mechc.load("four_bar").assemble({"theta_0": np.radians(85)}, params={"l_3": 3.5})
    bar = tangent.TangentBar((1.0, 2.0, 3.0, 3.5), (1.0, 2.0, 3.0))
    exact = np.array(scene.reference("four_bar_regular")["states"]["5.0"], float)
    np.testing.assert_allclose(bar.final(y0, 5.0, 1e-12), exact, rtol=0, atol=1e-9)


def test_the_pendulum_swings_as_its_equation_says(module):
    """The closed form's second derivative is -g sin(angle), and a quarter period is down."""
    mp, runs = pytest.importorskip("mpmath"), module("stress_families.long_runs")
    with mp.workdps(30):
        for t in (0.3, 1.7, 1e5):
            before, at, after = (runs.swing(mp.mpf(1), mp.mpf(t) + d) for d in (-1e-4, 0.0, 1e-4))
            assert (after[0] - before[0]) / 2e-4 == pytest.approx(at[1], abs=1e-6)
            assert (after[1] - before[1]) / 2e-4 == pytest.approx(-9.81 * np.sin(at[0]), abs=1e-6)


def test_the_modes_of_two_masses_satisfy_their_equation(module):
    modes = module("stress_families.stiff").modes
    y0 = np.array([0.3, 0.31, 0.0, 0.0])
    y, k, c = modes(50.0, 2.0, y0, 0.7), 50.0, 2.0
    slope = (modes(50.0, 2.0, y0, 0.7 + 1e-5) - modes(50.0, 2.0, y0, 0.7 - 1e-5)) / 2e-5
    between = k * (y[1] - y[0]) + c * (y[3] - y[2])
    expected = [y[2], y[3], -10.0 * y[0] + between, -between / 2]
    np.testing.assert_allclose(slope, expected, rtol=0, atol=1e-6)


def test_the_energy_of_a_run_that_gains_some_is_wrong(module, regular):
    """Twice the free fall is another motion: its energy is not kept."""
    values = module("stress_families.values")
    given = dict(zip(regular.model.parameters, regular.params.tolist(), strict=True))
    scene = values.SCENES["four_bar"]
    assert values.judged("", regular, scene, given)["word"] == "right"
    assert values.judged("", regular, scene, given | {"g": 2 * 9.81})["word"] == "WRONG"


@pytest.mark.parametrize("name", ["four_bar", "pendulum", "slider_crank", "flyball_governor"])
def test_energies_by_hand_are_those_of_the_bodies(module, name):
    """Kinetic energies agree with the compiled mass matrix at random states."""
    values = module("stress_families.values")
    model = values.model_of(name)
    given = dict(
        zip(model.parameters, model.system.parameter_set.resolve(None).tolist(), strict=True)
    )
    size = len(model.coordinates)
    states = np.random.default_rng(1).normal(size=(5, 2 * size))
    u, M = states[:, size:], model.mass_matrix(states)
    kinetic, _ = values.SCENES[name].energy(states[:, :size], u, given)
    np.testing.assert_allclose(kinetic, np.einsum("ni,nij,nj->n", u, M, u) / 2, rtol=1e-12)


# -- families, a case or two of each --------------------------------------------------------------


def first_of(rows, count):
    return [row for row, _ in zip(rows, range(count), strict=False)]


@pytest.mark.parametrize(
    ("family", "count"),
    [("change points", 3), ("units", 4), ("mass ratios", 2), ("length ratios", 2),
     ("tolerances", 28), ("open starts", 12), ("bad values", 10), ("a million periods", 2),
     ("redundant constraints", 2)],
)  # fmt: skip
def test_the_first_runs_of_a_family_are_not_wrong(stress, family, count):
    rows = first_of(stress.FAMILIES[family].rows(True), count)
    assert len(rows) == count
    assert "WRONG" not in [row["word"] for row in rows]
    assert stress.FAMILIES[family].least < 0.5 or "right" in [row["word"] for row in rows]


def test_a_near_miss_is_bent_back_and_not_passed(module):
    """Right against 40 digits; held against the change point's own motion it would be wrong."""
    misses = module("near_misses")
    (row,) = misses.judged(4.0 - 1e-6, ["auto"], [1e-9])
    assert row["word"] == "right"
    straight_on, _ = misses.truth(4.0)
    bent_back, _ = misses.truth(4.0 - 1e-6)
    assert np.abs(straight_on - bent_back).max() > 1.0


def test_a_member_that_differs_from_its_own_run_is_wrong(module, regular):
    batches = module("stress_families.batches")
    assert batches.same("", regular, "finished", regular.y[-1])["word"] == "right"
    other = np.nextafter(regular.y[-1], np.inf)
    assert batches.same("", regular, "finished", other)["word"] == "WRONG"
    assert batches.same("", regular, "undecided", regular.y[-1])["word"] == "WRONG"


def test_a_folding_slider_crank_keeps_to_its_branch(module):
    crossings = module("stress_families.crossings")
    rows = first_of(crossings._slider_crank([1e-8]), 1)
    assert rows[0]["word"] == "right"


def test_a_stiff_spring_moves_as_its_modes_do(module):
    stiff = module("stress_families.stiff")
    rows = list(stiff._linear([1e6], [1e-6]))
    assert {row["word"] for row in rows} <= {"right", "flagged"}
    assert sum(row["word"] == "right" for row in rows) >= 4
