"""Reductions through change points, where constraint forces of an ideal mechanism are infinite."""

import math

import numpy as np
import pytest

from mechc import Event
from mechc.errors import MechcError
from tests.support import LOCKSTEP, by

T_END = 2.0
RHOMBOID = {"l_3": 4.0}  # its links come in line twice
AWAY = 0.01
POLES = (
    "max(norm(multipliers))",
    "max(abs(multipliers[0]))",
    "min(multipliers[0])",
    "max(multipliers[0])",
    "range(multipliers[0])",
)


@pytest.fixture(scope="module")
def start(model):
    return model.assemble({"theta_0": np.radians(85)}, params=RHOMBOID)


@pytest.fixture(scope="module")
def sol(model, start):
    return model.simulate(T_END, start, RHOMBOID, rtol=1e-11)


@pytest.fixture(scope="module")
def crossings(sol):
    return np.array([point.t for point in sol.change_points])


def reduced(model, start, *asked, rtol=1e-9, method="gauss8", **more):
    batch = model.simulate_batch(
        T_END, np.stack([start] * 3), RHOMBOID, reduce=asked, rtol=rtol, **by(method), **more
    )
    return batch, [batch[text][1] for text in asked]


def distances(t, crossings):
    return np.abs(t[:, None] - crossings).min(axis=1)


def test_forces_grow_as_the_inverse_of_the_time_to_a_change_point(sol, crossings):
    for t in crossings:
        near, nearer = sol.output("multipliers", t + np.array([[1e-4], [1e-5]]))[:, 0, 0]
        assert nearer / near == pytest.approx(10.0, rel=0.05)


@pytest.mark.parametrize("rtol", [1e-3, 1e-6, 1e-11])
@pytest.mark.parametrize("method", ["gauss8", "dop853", "dopri5", "radau5", LOCKSTEP])
def test_extremes_of_what_has_a_pole_are_infinite_and_the_others_are_not(
    model, start, method, rtol
):
    others = ("range(multipliers[1])", "max(points[2,0])", "range(energy)", "max(theta_2)")
    batch, found = reduced(model, start, *POLES, *others, rtol=rtol, method=method)
    assert found[:5] == [math.inf, math.inf, -math.inf, math.inf, math.inf]
    assert np.isfinite(found[5:]).all()
    (told,) = [note for note in batch.warnings if note.startswith("infinite in 3 members")]
    assert told.split(": ")[1].split(". At")[0] == ", ".join(POLES)


def test_a_mean_over_a_pole_does_not_exist(model, start):
    _, (signed, absolute) = reduced(model, start, "mean(multipliers[0])", "mean(norm(multipliers))")
    assert math.isnan(signed)  # infinite parts of both signs
    assert absolute == math.inf


@pytest.mark.parametrize("level", [50.0, 1e4, 1e9])
def test_every_level_is_crossed_before_the_first_pole(model, start, sol, crossings, level):
    _, (first,) = reduced(model, start, f"first(norm(multipliers) > {level})")
    before = crossings[0] - first
    assert 0.0 < before < 0.1
    force = np.linalg.norm(sol.output("multipliers", np.array([crossings[0] - 1e-4])))
    if level > 1e3:  # there they are as the inverse of the time
        assert before == pytest.approx(1e-4 * force / level, rel=0.05)


def test_a_sign_that_changes_through_infinity_changes_at_the_change_point(model, start, crossings):
    _, (first,) = reduced(model, start, "first(multipliers[0] > 0)")
    assert first == pytest.approx(crossings[0], abs=1e-8)
    ended, _ = reduced(model, start, until="multipliers[0] > 0")
    assert ended.t[1] == first


@pytest.mark.parametrize("method", ["gauss8", "dop853", LOCKSTEP])
def test_extremes_away_from_change_points(model, start, sol, crossings, method):
    asked = [f"max(norm(multipliers), away={AWAY})", "min(multipliers[0], away = 10 ms)",
             "max(theta_2, away=200ms)", "range(theta_2, away=10)"]  # fmt: skip
    batch, found = reduced(model, start, *asked, method=method)
    edges = (crossings[:, None] + [[-AWAY, AWAY, -0.2, 0.2]]).ravel()
    t = np.unique(np.append(np.linspace(0.0, T_END, 20_001), edges))
    forces, near = sol.output("multipliers", t), distances(t, crossings)
    kept = near >= AWAY * (1 - 1e-9)
    expected = [np.linalg.norm(forces[kept], axis=1).max(), forces[kept, 0].min()]
    np.testing.assert_allclose(found[:2], expected, rtol=1e-6)
    assert found[2] == pytest.approx(sol(t[near >= 0.2 * (1 - 1e-9)])[:, 2].max(), abs=1e-7)
    assert math.isnan(found[3])  # nothing is that far away
    assert not any("infinite" in note for note in batch.warnings)


def test_many_change_points(model, start):
    """Each is found in the step that it lies in, also where steps are reduced piece by piece."""
    sol = model.simulate(20.0, start, RHOMBOID, rtol=1e-11)
    crossings = np.array([point.t for point in sol.change_points])
    assert len(crossings) == 17
    asked = [
        f"max(norm(multipliers), away={AWAY})",
        "max(multipliers[0])",
        "max(theta_2, away=0.3)",
    ]
    batch = model.simulate_batch(20.0, start[None], RHOMBOID, reduce=asked, rtol=1e-11)
    edges = (crossings[:, None] + [[-AWAY, AWAY, -0.3, 0.3]]).ravel()
    t = np.unique(np.clip(np.append(np.linspace(0.0, 20.0, 100_001), edges), 0.0, 20.0))
    near = distances(t, crossings)
    forces = np.linalg.norm(sol.output("multipliers", t[near >= AWAY * (1 - 1e-9)]), axis=1)
    assert batch[asked[0]][0] == pytest.approx(forces.max(), rel=1e-5)
    assert batch[asked[1]][0] == math.inf
    expected = sol(t[near >= 0.3 * (1 - 1e-9)])[:, 2].max()
    assert batch[asked[2]][0] == pytest.approx(expected, abs=1e-6)


def test_change_points_are_counted_over_the_pieces_of_a_motion(model, start, crossings):
    """An event between two of them begins a piece."""
    event = Event(f"t - {crossings[:2].mean()}", reset={"omega_0": "omega_0"})
    batch = model.simulate_batch(T_END, start[None], RHOMBOID, events=[event], rtol=1e-11)
    assert batch["change_points"].tolist() == [len(crossings)]


def test_away_of_a_motion_without_change_points_changes_nothing(model):
    start = model.assemble({"theta_0": 1.4}, params={"l_3": 3.5})
    texts = ["max(norm(multipliers))", "max(norm(multipliers), away=1ms)"]
    batch = model.simulate_batch(T_END, start[None], {"l_3": 3.5}, reduce=texts)
    assert batch[texts[0]] == batch[texts[1]]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("mean(theta_2, away=1ms)", "away= is for min, max and range"),
        ("max(theta_2, away=0)", "a time above zero"),
        ("max(theta_2, away=inf)", "a time above zero"),
        ("max(theta_2, away=3 rad)", "use s or ms"),
    ],
)
def test_times_that_cannot_be_left_out(model, start, text, words):
    with pytest.raises(MechcError, match=words):
        reduced(model, start, text)
