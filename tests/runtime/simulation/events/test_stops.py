"""Stops: impacts by Newton's law, one at a time and several at once."""

from itertools import chain, combinations

import numpy as np
import pytest
import sympy as sm
from mechc.native._events import impulses

import mechc
from mechc.errors import MechcError, ValueOutOfBoundsError
from tests.support import scenes
from tests.support.impacts import G, impacts


def energies(y):
    return 0.5 * (y[:, 5:] ** 2).sum(axis=1) + 2.0 * (y[:, :5] ** 2).sum(axis=1)


@pytest.mark.parametrize("method", ["gauss8", "dop853"])
def test_a_hundred_bounces_come_at_the_times_of_the_closed_form(ball, method):
    stop = mechc.Stop("q_0", 0.9, terminal=100)
    sol = ball.simulate(20.0, [1.0, 0.0], events=stop, rtol=1e-12, method=method)
    np.testing.assert_allclose(sol.events[0].t, impacts(0.9, 100), rtol=0, atol=1e-12)


def test_parameters_that_stand_in_stops_alone_are_set_and_swept(ball):
    stop = mechc.Stop("q_0 - h", "e", terminal=6)
    sol = ball.simulate(20.0, [3.0, 0.0], {"e": 0.8, "h": 2.0}, events=stop, rtol=1e-12)
    np.testing.assert_allclose(sol.events[0].t, impacts(0.8, 6), rtol=0, atol=1e-12)
    e = np.array([0.3, 0.6, 0.9])
    batch = ball.simulate_batch(20.0, [[1.0, 0.0]] * 3, {"e": e}, events=stop)
    np.testing.assert_allclose(batch.t, [impacts(x, 6)[-1] for x in e], rtol=0, atol=1e-9)


@pytest.mark.parametrize("e", [1.0, 0.7])
def test_four_balls_that_touch_are_hit_at_once(five_springs, e):
    """Each of the five gets an equal share of what is exchanged: all masses are equal."""
    stops = [mechc.Stop(f"q_{k + 1} - q_{k}", e) for k in range(4)]
    start = np.array([-0.1, *np.zeros(9)])
    sol = five_springs.simulate(1.0, start, events=stops, rtol=1e-11)
    assert sol.record.pieces[1].causes == (0, 1, 2, 3)
    after, speed = sol.segments[1].y0[5:], 0.2
    np.testing.assert_allclose(after[1:], (1 + e) / 5 * speed, rtol=1e-9)
    assert after[0] == pytest.approx((1 - 4 * e) / 5 * speed, rel=1e-9)
    assert (np.diff(energies(sol.y)) < 1e-12).all()
    assert np.diff(sol.y[:, :5], axis=1).min() > -1e-9


def test_balls_a_little_apart_pass_the_speed_on(five_springs):
    """Newton's cradle: the impacts follow each other, and the last ball takes the whole speed."""
    stops = [mechc.Stop(f"q_{k + 1} - q_{k} + 1/10000", 1.0) for k in range(4)]
    start = np.array([-0.1, *np.zeros(9)])
    sol = five_springs.simulate(0.81, start, events=stops, rtol=1e-11)
    assert [len(record.t) for record in sol.events] == [1, 1, 1, 1]
    np.testing.assert_allclose(sol.y[-1, 5:], [0, 0, 0, 0, 0.2], atol=2e-3)
    np.testing.assert_allclose(energies(sol.y), energies(sol.y)[0], rtol=1e-10)


def test_a_stop_that_moves(ball):
    """A table that rises: the speed relative to it is turned back."""
    sol = ball.simulate(1.0, [1.0, 0.0], events=mechc.Stop("q_0 - t/4", 0.5))
    before, after = sol.segments[0].y1, sol.segments[1].y0
    hit = (np.sqrt(0.0625 + 2 * G) - 0.25) / G
    assert sol.events[0].t[0] == pytest.approx(hit, abs=1e-12)
    assert after[1] - 0.25 == pytest.approx(-0.5 * (before[1] - 0.25), rel=1e-12)


def test_a_linkage_hits_a_stop(model, regular):
    """By the inertia that its loop leaves free; the energy lost is that of Newton's law."""
    params, start = regular
    stops = [mechc.Stop("3 - theta_0", 0.5)]
    sol = model.simulate(3.0, start, params, events=stops, rtol=1e-11)
    assert len(sol.segments) > 2
    for before, after in zip(sol.segments[:4], sol.segments[1:5], strict=True):
        assert after.y0[3] == pytest.approx(-0.5 * before.y1[3], rel=1e-11)
        lost = [model.kinetic_energy(y, params) for y in (before.y1, after.y0)]
        assert lost[1] == pytest.approx(0.25 * lost[0], rel=1e-10)  # one freedom: all speeds scale
    assert sol.closure.max() < 1e-12
    assert sol.velocity_closure.max() < 1e-11


def test_members_of_a_batch_have_the_bits_of_simulate(five_springs):
    rng = np.random.default_rng(5)
    stops = [mechc.Stop(f"q_{k + 1} - q_{k}", 0.8) for k in range(4)]
    starts = np.hstack([np.sort(rng.normal(size=(40, 5)), axis=1), rng.normal(size=(40, 5))])
    batch = five_springs.simulate_batch(2.0, starts, events=stops, progress=False)
    for k in (0, 13, 39):
        one = five_springs.simulate(2.0, starts[k], events=stops, method=batch.method)
        np.testing.assert_array_equal(batch.y[k], one.y[-1])
        assert [len(record.t) for record in one.events] == batch.event_counts[k].tolist()
        assert (np.diff(energies(one.y)) < 1e-8).all()


def subsets(n):
    return chain.from_iterable(combinations(range(n), k) for k in range(n + 1))


def feasible_changes(a, b):
    """A p of every p >= 0 with A p + b >= 0 whose product is 0, by trying all sets of contacts."""
    found = []
    for active in map(list, subsets(len(b))):
        p = np.zeros(len(b))
        if active:
            p[active] = np.linalg.lstsq(a[np.ix_(active, active)], -b[active], rcond=1e-11)[0]
        rest = a @ p + b
        if (
            p.min() >= -1e-10
            and rest.min() >= -1e-10
            and np.abs(rest[active]).max(initial=0) < 1e-9
        ):
            found.append(a @ p)
    return found


@pytest.mark.parametrize("freedoms", [2, 5, 9])
def test_impulses_are_the_solution_of_the_complementarity_problem(freedoms):
    """With fewer freedoms than contacts impulses are not unique; the rates are."""
    rng = np.random.default_rng(freedoms)
    for _ in range(60):
        n = 5
        rows = rng.normal(size=(n, freedoms))
        a, w = rows @ rows.T, rows @ rng.normal(size=freedoms)
        e = rng.uniform(0.0, 1.0)
        p = impulses(a, w, np.full(n, e))
        assert (p >= 0.0).all()
        (first, *others) = feasible_changes(a, (1.0 + e) * w)
        for change in (first, *others):
            np.testing.assert_allclose(a @ p, change, atol=1e-9)
        after = w + a @ p
        assert p @ (w + after) <= 1e-12  # twice the energy


def test_impulses_of_thousands_of_impacts_are_complementary():
    """Few need a contact that was tried before in vain."""
    rng = np.random.default_rng(0)
    for _ in range(4000):
        n = rng.integers(2, 7)
        rows = rng.normal(size=(n, rng.integers(1, n + 2)))
        a, w = rows @ rows.T, rows @ rng.normal(size=rows.shape[1])
        p = impulses(a, w, np.full(n, 0.5))
        rest = a @ p + 1.5 * w
        assert p.min() >= 0.0
        assert rest.min() >= -1e-9 * np.abs(w).max()
        assert np.abs(rest[p > 0.0]).max(initial=0.0) <= 2e-9 * np.abs(w).max()


@pytest.mark.parametrize("freedoms", [2, 9])
def test_poissons_impulses_solve_the_problems_of_compression_and_expansion(freedoms):
    rng = np.random.default_rng(freedoms)
    for _ in range(40):
        n, e = 5, rng.uniform(0.0, 1.0)
        rows = rng.normal(size=(n, freedoms))
        a, w = rows @ rows.T, rows @ rng.normal(size=freedoms)
        p = impulses(a, w, np.full(n, e), poisson=True)
        pressing = feasible_changes(a, w)[0]
        parting = feasible_changes(a, w + (1.0 + e) * pressing)[0]
        np.testing.assert_allclose(a @ p, (1.0 + e) * pressing + parting, atol=1e-9)
        assert p @ (w + w + a @ p) <= 1e-12


@pytest.mark.parametrize("poisson", [False, True])
def test_contacts_of_bodies_that_are_apart_return_each_by_its_own_restitution(poisson):
    a, w, e = np.diag([1.0, 2.0, 0.5]), np.array([-1.0, -2.0, -4.0]), np.array([0.0, 0.5, 0.9])
    np.testing.assert_allclose(w + a @ impulses(a, w, e, poisson), -e * w, atol=1e-15)


@pytest.mark.parametrize("poisson", [False, True])
def test_different_restitutions_never_give_energy(poisson):
    rng = np.random.default_rng(7)
    for _ in range(500):
        rows = rng.normal(size=(3, 4))
        a, w = rows @ rows.T, rows @ rng.normal(size=4)
        e = rng.uniform(0.0, 1.0, size=3)
        p = impulses(a, w, e, poisson)
        after = w + a @ p
        assert p @ (w + after) <= 1e-10
        assert (after >= -1e-10 + np.minimum(0.0, -e.max() * np.abs(w))).all()


def test_what_is_wrong_is_told(ball):
    y0, stop = [1.0, 0.0], mechc.Stop("q_0", 0.5)
    for events, error, words in (
        (mechc.Stop("q_0 + u_0", 0.5), ValueOutOfBoundsError, "not on u_0"),
        (mechc.Stop("q_0 < 1"), MechcError, "cannot read"),
        (mechc.Stop(lambda q: q), ValueOutOfBoundsError, "a gap is an expression"),
        (mechc.Stop("q_0", 1.5), ValueOutOfBoundsError, "restitution = 1.5"),
        (mechc.Stop("q_0", 0.5, friction=0.3), ValueOutOfBoundsError, "speed of sliding"),
        (mechc.DryFriction("q_0", 0.5), ValueOutOfBoundsError, "linear in the speeds"),
        (mechc.DryFriction("u_0**2", 0.5), ValueOutOfBoundsError, "linear in the speeds"),
        (mechc.DryFriction(["u_0", "q_0"], 0.5), ValueOutOfBoundsError, "in a plane.*smooth law"),
        (mechc.DryFriction("sqrt(u_0**2)", 0.5), ValueOutOfBoundsError, "in a plane.*smooth law"),
        (mechc.DryFriction("u_0", -0.5), ValueOutOfBoundsError, "must not be negative"),
        (mechc.DryFriction("u_0", 0.5, static=0.4), ValueOutOfBoundsError, "at least"),
    ):
        with pytest.raises(error, match=words):
            ball.simulate(1.0, y0, events=events)
    with pytest.raises(ValueOutOfBoundsError, match="backwards"):
        ball.simulate((1.0, 0.0), y0, events=stop)
    with pytest.raises(ValueOutOfBoundsError, match="backwards"):
        ball.simulate_batch((1.0, 0.0), [y0], events=stop, progress=False)


def test_gaps_of_what_sympy_takes_for_complex(ball):
    """The derivative of abs(log(m)), for SymPy one of a complex number, ended in its error."""
    gap = "abs(q_0*log(m)) - log(m)/4 + 0*q_0"
    sol = ball.simulate(2.0, [1.0, 0.0], {"m": 2.0}, events=mechc.Stop(gap, 0.5, terminal=1))
    assert sol["q_0"][-1] == pytest.approx(0.25, abs=1e-12)
    assert sol["u_0"][-1] == pytest.approx(0.5 * np.sqrt(2 * 9.81 * 0.75), rel=1e-9)


@pytest.mark.parametrize(
    ("stop", "words"),
    [
        (mechc.Stop("q_0 - 1/t"), "not finite there"),
        (mechc.Stop("q_0 + log(h - 1)"), "not finite there|gave NaN"),
        (mechc.Stop("q_0", "1/t"), "must be 0 to 1"),
        (mechc.Stop("q_0", "log(h)"), "must be 0 to 1"),
    ],
)
@pytest.mark.parametrize("by_tape", [True, False])
def test_gaps_without_a_value_are_refused_in_words(ball, stop, words, by_tape, monkeypatch):
    if not by_tape:
        monkeypatch.setattr("mechc.compilation.event_tapes._assemble", lambda *_: None)
        monkeypatch.setattr("mechc.compilation.event_tapes._known", {})
    with pytest.raises(MechcError, match=words):
        ball.simulate(1.0, [1.0, 0.0], events=stop)


@pytest.mark.parametrize(
    ("height", "speed", "t_end"),
    [(0, -1e-6, 1), (0, 1e-9, 1), (0, -0.01, 100), (1e-6, 0, 100), (1e-3, 0, 1e3), (0.1, 0, 1e4)],
)
def test_a_ball_comes_to_rest_however_short_its_flights_are_beside_the_span(
    ball, height, speed, t_end
):
    sol = ball.simulate(t_end, [height, speed], events=mechc.Stop("q_0", 0.3))
    assert sol.status.code == "finished"
    assert sol.segments[-1].contacts == ("held",)
    assert sol.events[0].t[-1] < 1.0
    batch = ball.simulate_batch(
        t_end, [[height, speed]], events=mechc.Stop("q_0", 0.3), progress=False
    )
    assert batch.ok.all()


@pytest.mark.parametrize("rest", [1e3, 1e6])
def test_short_flights_after_a_long_rest_are_all_there(rest):
    """A body between walls a micrometre apart, kicked after a while at rest."""
    model = mechc.compile(scenes.bead_with(sm.S.Zero), outputs=())
    apart, kicked = 1e-6, mechc.Event(f"t - {rest!r}", direction=1, reset={"u": "1"})
    walls = [
        mechc.Event(f"q - {apart!r}", direction=1, reset={"u": "-u"}),
        mechc.Event("q", direction=-1, reset={"u": "-u"}),
    ]
    start = np.array([apart / 2, 0.0])
    sol = model.simulate(rest + 20.4e-6, start, events=[kicked, *walls])
    assert sol.status.code == "finished"
    assert [len(record.t) for record in sol.events] == [1, 10, 10]
