"""Events with resets in a batch: every member is the run that `simulate` makes."""

import pickle

import numpy as np
import pytest
from sympy.physics.mechanics import dynamicsymbols

import mechc
from mechc.errors import EventError, MechcError, ValueOutOfBoundsError
from tests.support import LOCKSTEP, by
from tests.support.impacts import G

BOUNCE = mechc.Event("q_0 < 0", reset={"u_0": "-u_0*(1 - m/10)"})
EVENTS = [BOUNCE, mechc.Event("u_0", direction=-1)]


@pytest.mark.parametrize("method", ["gauss8", "dop853", "dopri5", "radau5", LOCKSTEP])
def test_two_thousand_members_have_the_bits_of_simulate(ball, method):
    count, times = 2_000, np.linspace(0.0, 3.0, 7)
    starts = np.column_stack([np.linspace(0.5, 2.0, count), np.linspace(0.0, 1.0, count)])
    masses = np.linspace(0.5, 1.5, count)
    batch = ball.simulate_batch(
        3.0, starts, {"m": masses}, events=EVENTS, t_eval=times, progress=False, **by(method)
    )
    assert (batch.event_counts[:, 0] > 1).all()
    for k in (0, 1, 999, 1555, count - 1):
        given = {"params": {"m": masses[k]}, "events": EVENTS, **by(method)}
        one = ball.simulate(3.0, starts[k], **given)
        np.testing.assert_array_equal(batch.y[k], one.y[-1])
        np.testing.assert_array_equal(batch.y_eval[k], one(times))
        assert [len(record.t) for record in one.events] == batch.event_counts[k].tolist()
        assert [record.t[-1] for record in one.events] == batch.event_latest[k].tolist()
        assert one.stats["steps"] == batch.steps[k]


def test_a_member_does_not_depend_on_the_others_or_the_threads(ball):
    starts = np.column_stack([np.linspace(0.1, 3.0, 300), np.zeros(300)])
    given = {"events": EVENTS, "method": "dop853", "progress": False}
    first = ball.simulate_batch(2.0, starts, threads=1, **given)
    for other in (
        ball.simulate_batch(2.0, starts, threads=4, chunk=37, **given),
        ball.simulate_batch(2.0, starts[::-1].copy(), **given),
    ):
        step = 1 if (other.y0 == first.y0).all() else -1
        np.testing.assert_array_equal(other.y[::step], first.y)
        np.testing.assert_array_equal(other.event_counts[::step], first.event_counts)


def test_reductions_go_on_over_jumps(ball):
    """Of a ball that falls from 1 m and keeps 0.9 of its speed, until t = 1 s, in flight."""
    batch = ball.simulate_batch(
        1.0, [1.0, 0.0], events=BOUNCE, rtol=1e-12, progress=False,
        reduce=["max(u_0)", "min(u_0)", "mean(q_0)", "first(u_0 > 0)", "first(u_0 > 5)",
                "final(u_0)", "min(q_0)"],
    )  # fmt: skip
    hit, speed = np.sqrt(2 / G), np.sqrt(2 * G)
    rest = 1.0 - hit
    area = 1.0 * hit - G * hit**3 / 6 + 0.9 * speed * rest**2 / 2 - G * rest**3 / 6
    assert batch["max(u_0)"][0] == pytest.approx(0.9 * speed, abs=1e-12)
    assert batch["min(u_0)"][0] == pytest.approx(-speed, abs=1e-12)
    assert batch["mean(q_0)"][0] == pytest.approx(area, abs=1e-12)
    assert batch["first(u_0 > 0)"][0] == pytest.approx(hit, abs=1e-12)
    ended = ball.simulate_batch(1.0, [1.0, 0.0], events=BOUNCE, rtol=1e-12, until="u_0 > 0")
    assert ended.t[0] == batch["first(u_0 > 0)"][0]
    assert np.isnan(batch["first(u_0 > 5)"][0])
    assert batch["final(u_0)"][0] == pytest.approx(0.9 * speed - G * rest, abs=1e-12)
    assert batch["min(q_0)"][0] == pytest.approx(0.0, abs=1e-12)


def crossings(model, start, event, text, t_end=3.0, **given):
    """The first crossing as a reduction, as the end of a member and as an event; NaN: none."""
    batch = model.simulate_batch(t_end, [start], reduce=f"first({text})", **given)
    ended = model.simulate_batch(t_end, [start], until=text, **given)
    events = [*given.pop("events", []), event or text]
    zeros = model.simulate(t_end, start, events=events, **given).events[-1].t
    end = ended.t[0] if ended.status(0).code == "stopped by an event" else np.nan
    return batch[f"first({text})"][0], end, zeros[0] if len(zeros) else np.nan


@pytest.mark.parametrize("method", ["gauss8", "dop853", LOCKSTEP])
def test_first_crossings_ends_of_members_and_events_have_the_same_bits(
    model, regular, ball, pushed, method
):
    """Also where two lie between two samples, and where the start is at the level."""
    params, start = regular
    of_bar = {"params": params, **by(method)}
    swing = model.simulate(3.0, start, **of_bar)(np.linspace(0, 3, 300_001))[:, 1]
    tops = [float(swing.max() - part * np.ptp(swing)) for part in (1e-9, 1e-6, 0.5)]
    levels = [*tops, float(swing.min() + 1e-9), float(start[1])]
    texts = [f"theta_1 {sign} {level!r}rad" for level in levels for sign in "<>"]
    asked = [(model, start, None, text, of_bar) for text in texts]
    for h in (0.3, 0.9, 1.1):
        height = mechc.Event(lambda t, y, h=h: model.points(y, params)[2, 1] - h, direction=1)
        asked.append((model, start, height, f"points[2,1] > {h}", of_bar))
    for hit, texts in (
        (BOUNCE, ("q_0 > 1", "q_0 < 0.7", "q_0 > 0.7", "abs(q_0) < 0.1")),
        (mechc.Stop("q_0", 0.5), ("q_0 < 0",)),
    ):
        bounces = {"events": [hit], **by(method)}
        asked += [(ball, [0.9, 0.7], None, text, bounces) for text in texts]
    push = {"inputs": {"F": mechc.Signal(TIMES, PUSH, "linear")}, **by(method)}
    asked += [(pushed, [0.0, 0.2], None, text, push) for text in ("q < -1", "u > -2", "u < 0")]
    found = np.array([crossings(*each[:4], **each[4]) for each in asked])
    np.testing.assert_array_equal(found[:, 1:], found[:, :1] * [1, 1])
    assert (found[0] > found[1]).all()
    assert np.isfinite(found).sum() > 40


def test_tables_and_pickled_batches_have_the_events(ball):
    batch = ball.simulate_batch(2.0, [[1.0, 0.0], [0.5, 0.0]], events=EVENTS, progress=False)
    table = batch.to_xarray()
    assert table["event_counts"].dims == table["event_latest"].dims == ("member", "event")
    assert table["event_latest"].attrs["units"] == "s"
    again = pickle.loads(pickle.dumps(batch))
    np.testing.assert_array_equal(again.event_latest, batch.event_latest)


def test_ends_of_members_have_the_status_of_simulate(ball):
    third = mechc.Event("q_0", direction=-1, reset={"u_0": "-0.9*u_0"}, terminal=3)
    stop = mechc.Event("q_0 < 0.5", terminal=True)
    short = mechc.Event("q_0", direction=-1, reset={"u_0": "-0.3*u_0"})
    nan = mechc.Event("q_0 - 0.5", reset={"u_0": "log(-q_0)"})
    y0 = [[1.0, 0.0], [2.0, 0.0]]
    for event in (third, stop, short):
        batch = ball.simulate_batch(5.0, y0, events=event, progress=False, t_eval=[0.1, 5.0])
        for k, start in enumerate(y0):
            one = ball.simulate(5.0, start, events=event, lockstep=True)
            assert batch.status(k).code == one.status.code
            np.testing.assert_array_equal(batch.y[k], one.y[-1])
            assert batch.t[k] == one.t[-1]
    failed = ball.simulate_batch(5.0, y0, events=nan, progress=False)
    assert failed.status(0).code == "event failed"
    assert failed.t[0] == pytest.approx(np.sqrt(1 / G))
    limited = ball.simulate_batch(50.0, y0, events=BOUNCE, max_steps=20, progress=False)
    assert limited.status(0).code == "too many steps"


WALL = [mechc.Stop("q", 0.9), mechc.Event("u", direction=-1)]
TIMES = np.array([0.0, 0.31, 0.5, 1.3, 2.0, 3.1])
PUSH = np.array([-4.0, -9.0, 1.5, -7.0, 3.0, -6.0])


@pytest.mark.parametrize("method", ["gauss8", "dop853", "radau5", LOCKSTEP])
@pytest.mark.parametrize("kind", ["previous", "linear", "cubic", "numbers"])
def test_members_with_inputs_have_the_bits_of_simulate(pushed, method, kind):
    """The motion restarts at kinks, and at resets between these."""
    count, times = 40, np.linspace(0.0, 3.0, 7)
    starts = np.column_stack([np.linspace(0.2, 1.5, count), np.linspace(-1.0, 1.0, count)])
    own = np.linspace(-9.0, -3.0, count)
    forces = own if kind == "numbers" else mechc.Signal(TIMES, PUSH, kind)
    given = {"events": WALL, "params": {"k": 30.0}, **by(method)}
    batch = pushed.simulate_batch(
        3.0, starts, inputs={"F": forces}, t_eval=times, outputs=["power"], threads=2,
        progress=False, **given,
    )  # fmt: skip
    assert (batch.event_counts[:, 0] > 1).all()
    for k in (0, 7, 22, count - 1):
        force = own[k] if kind == "numbers" else forces
        one = pushed.simulate(3.0, starts[k], inputs={"F": force}, **given)
        np.testing.assert_array_equal(batch.y[k], one.y[-1])
        np.testing.assert_array_equal(batch.y_eval[k], one(times))
        powers = one.model.output("power", one(times), t=times)
        np.testing.assert_array_equal(batch["power"][k], powers)
        assert [len(record.t) for record in one.events] == batch.event_counts[k].tolist()
        assert [record.t[-1] for record in one.events] == batch.event_latest[k].tolist()


def test_compiled_impacts_under_a_force_are_those_of_python(pushed):
    """Times to 1e-12, by gauss8 and a signal of several pieces; a stop is a reset of the speed."""
    for force in (
        mechc.Signal(TIMES, PUSH, "linear"),
        lambda t: -5.0 + 3.0 * np.cos(4.0 * t),
        mechc.Sampled(lambda t, q, u: -6.0 - 2.0 * u[0], period=0.05, delay=0.02),
    ):
        by_python = mechc.Event(
            lambda t, y: y[0], direction=-1, reset=lambda t, q, u: (q, -0.9 * u)
        )
        runs = [
            pushed.simulate(
                3.0, [0.7, 0.0], {"k": 3.0}, inputs={"F": force}, events=event, rtol=1e-13,
                method="gauss8",
            )
            for event in (WALL[0], by_python)
        ]  # fmt: skip
        times = [sol.events[0].t for sol in runs]
        assert len(times[0]) == len(times[1]) >= 2
        np.testing.assert_allclose(times[0], times[1], atol=1e-12)
        np.testing.assert_allclose(runs[0].y[-1], runs[1].y[-1], atol=1e-11)


def test_a_folder_holds_the_events_and_knows_them(ball, tmp_path):
    pytest.importorskip("zarr")
    starts = np.column_stack([np.linspace(0.5, 2.0, 50), np.zeros(50)])
    given = {"events": EVENTS, "chunk": 20, "progress": False, "reduce": ["max(u_0)"]}
    here = ball.simulate_batch(2.0, starts, **given)
    kept = ball.simulate_batch(2.0, starts, out=tmp_path / "b", **given)
    (tmp_path / "b" / "mechc" / "chunk-000000000020.json").unlink()  # as if killed before
    again = ball.simulate_batch(2.0, starts, out=tmp_path / "b", **given)
    opened = mechc.open(tmp_path / "b", model=ball)
    for other in (kept, again, opened):
        for name in here.arrays:
            np.testing.assert_array_equal(other[name], here[name])
    other = [mechc.Event("q_0 < 0", reset={"u_0": "-0.9*u_0"}), EVENTS[1]]
    with pytest.raises(MechcError, match="results of another request: events is"):
        ball.simulate_batch(2.0, starts, out=tmp_path / "b", **{**given, "events": other})
    told = tmp_path / "b" / "mechc" / "inputs.json"
    told.write_text(told.read_text().replace('"directions": [-1.0', '"directions": [1.0'))
    with pytest.raises(MechcError, match="damaged"):
        mechc.open(tmp_path / "b", model=ball)


def test_what_a_batch_with_events_cannot_have_is_refused(ball, tmp_path):
    y0 = [[1.0, 0.0]]
    by_python = mechc.Event(lambda t, y: y[0], reset=lambda t, q, u: (q, -u))
    fails = mechc.Event(lambda t, y: 1 / 0)
    for given, error, words in (
        ({"events": by_python, "out": tmp_path / "kept"}, ValueOutOfBoundsError, "this process"),
        ({"events": fails}, EventError, "ZeroDivisionError"),
        ({"events": "q_9"}, MechcError, "q_9"),
    ):
        with pytest.raises(error, match=words):
            ball.simulate_batch(1.0, y0, progress=False, **given)


def test_functions_of_python_are_those_of_expressions(ball):
    """The same members, one thread; also beside a crossing that ends them."""
    by_python = mechc.Event(
        lambda t, y: y[0], direction=-1, reset=lambda t, q, u: (q, -0.8 * u), terminal=9
    )
    by_text = mechc.Event("q_0", -1, terminal=9, reset={"u_0": "-0.8*u_0"})
    starts = [[1.0, 0.0], [0.3, 1.0], [1.0, 4.0]]
    for more in ({}, {"until": "first(q_0 > 1.5)"}):
        one, other = (
            ball.simulate_batch(2.0, starts, events=events, reduce=["max(q_0)"], **more)
            for events in (by_python, by_text)
        )
        for name in ("y", "t", "status", "steps", "event_counts", "event_latest", "max(q_0)"):
            np.testing.assert_array_equal(one[name], other[name])
    assert other["t"][2] < 2.0


@pytest.mark.parametrize("impact", [
    mechc.Event("x", direction=-1, reset={"v": "-0.8*v"}),
    mechc.Stop("x", restitution=0.8), mechc.Stop("x", restitution=0.0),
])  # fmt: skip
def test_a_crossing_at_the_time_of_an_impact_counts(impact):
    """The fall from a height lasts sqrt(2 h / g); the impact is at the level that is asked for."""
    x, v = dynamicsymbols("x v")
    model = mechc.compile(mechc.from_equations([x], [v], None, [-G], name="fallen"))
    heights = np.array([1.0, 0.5, 0.7, 1.7, 0.3])
    starts, exact = np.column_stack([heights, 0.0 * heights]), np.sqrt(2.0 * heights / G)
    given = {"events": [impact], "progress": False}
    batch = model.simulate_batch(1.2, starts, reduce=["first(x = 0)", "first(x < 0)"], **given)
    np.testing.assert_allclose(batch["first(x=0)"], exact, rtol=1e-14)
    np.testing.assert_array_equal(batch["first(x<0)"], batch["first(x=0)"])
    ended = model.simulate_batch(1.2, starts, until="x < 0", **given)
    np.testing.assert_array_equal(ended["t"], batch["first(x=0)"])
    for start, t in zip(starts, ended["t"], strict=True):
        plain, last = (
            model.simulate(1.2, start, events=[impact, mechc.Event("x", terminal=end)])
            for end in (False, True)
        )
        assert (plain.events[1].t[0], last.events[1].t.tolist()) == (t, [t])
        assert last.span[1] == t
