"""Events and resets in compiled code: motions as by functions of Python, and closed forms."""

import numpy as np
import pytest

import mechc
from mechc.errors import EventError
from tests.support.impacts import impacts


def is_compiled(sol):
    return bool(sol._run_events.source)


def same(one, other, tolerance=1e-12):
    """Equal times and states of all events; equal motions."""
    for a, b in zip(one.events, other.events, strict=True):
        np.testing.assert_allclose(a.t, b.t, rtol=0, atol=tolerance)
        np.testing.assert_allclose(a.y, b.y, rtol=0, atol=100 * tolerance)
    assert one.status.code == other.status.code
    assert len(one.segments) == len(other.segments)
    assert len(one.t) == len(other.t)
    np.testing.assert_allclose(one.y[-1], other.y[-1], rtol=0, atol=100 * tolerance)


@pytest.mark.parametrize("method", ["gauss8", "dop853"])
def test_a_hundred_bounces_come_at_the_times_of_the_closed_form(ball, method):
    event = mechc.Event("q_0 < 0", terminal=100, reset={"u_0": "-0.9*u_0"})
    sol = ball.simulate(20.0, [1.0, 0.0], events=event, rtol=1e-12, method=method)
    assert is_compiled(sol)
    assert sol.status.code == "stopped by an event"
    np.testing.assert_allclose(sol.events[0].t, impacts(0.9, 100), rtol=0, atol=1e-12)
    assert len(sol.segments) == 101


def test_ever_shorter_flights_end_in_a_status(ball):
    for restitution in (0.9, 0.5, 0.0):
        event = mechc.Event("q_0", direction=-1, reset={"u_0": f"-{restitution}*u_0"})
        sol = ball.simulate(20.0, [1.0, 0.0], events=event)
        last = np.sqrt(2 / 9.81) * (1 + restitution) / (1 - restitution)
        assert sol.status.code == "resets accumulate"
        assert sol.status.t == pytest.approx(last, abs=1e-6)


def test_neighbours_of_a_cradle_meet_as_by_functions_of_python(five_springs):
    """Several resets at one instant, with losses."""
    e, start = 0.97, np.array([-0.1, 0, 0, 0, 0, 0, 0, 0, 0, 0.0])

    def reset(k):
        def collide(t, q, u):
            mean, half = 0.5 * (u[k] + u[k + 1]), 0.5 * e * (u[k] - u[k + 1])
            u[k], u[k + 1] = mean - half, mean + half
            return q, u

        return collide

    by_python = [
        mechc.Event(lambda t, y, k=k: y[k + 1] - y[k], direction=-1, reset=reset(k))
        for k in range(4)
    ]
    mean, half = "(u_{0} + u_{1})/2", f"{e}*(u_{{0}} - u_{{1}})/2"
    compiled = [
        mechc.Event(
            f"q_{k + 1} - q_{k}", direction=-1,
            reset={f"u_{k}": f"{mean} - {half}".format(k, k + 1),
                   f"u_{k + 1}": f"{mean} + {half}".format(k, k + 1)},
        )
        for k in range(4)
    ]  # fmt: skip
    one = five_springs.simulate(1.0, start, events=compiled, rtol=1e-11)
    assert is_compiled(one)
    other = five_springs.simulate(1.0, start, events=by_python, rtol=1e-11)
    assert max(len(piece.causes) for piece in one.record.pieces) > 1
    same(one, other)


def test_a_pendulum_between_two_stops_whose_place_is_a_parameter():
    model = mechc.load("pendulum")
    bottom = float(model.equilibria()[0].y[0])
    q, u = model.coordinates[0], model.speeds[0]
    length = next(name for name in model.parameters if name.startswith("l"))
    reset = {u: f"-0.8*{u}"}
    compiled = [
        mechc.Event(f"{q} - {bottom!r} < -0.2*{length}", reset=reset),
        mechc.Event(f"{q} - {bottom!r} > 0.3*{length}", reset=reset),
        mechc.Event(u),
    ]
    back = lambda t, q, u: (q, -0.8 * u)  # noqa: E731
    by_python = [
        mechc.Event(lambda t, y: y[0] - bottom + 0.4, direction=-1, reset=back),
        mechc.Event(lambda t, y: y[0] - bottom - 0.6, direction=1, reset=back),
        lambda t, y: y[1],
    ]
    runs = [
        model.simulate(6.0, [bottom, 6.0], {length: 2.0}, events=events, rtol=1e-11)
        for events in (compiled, by_python)
    ]
    assert is_compiled(runs[0])
    assert len(runs[0].events[2].t) > 0
    same(*runs)


@pytest.mark.parametrize(("wall", "grazes"), [(0.1, True), (0.11, False), (0.09, False)])
def test_grazing_is_told(five_springs, wall, grazes):
    hit = mechc.Event(f"{wall} - q_0", direction=-1, reset={"u_0": "-0.9*u_0"})
    sol = five_springs.simulate(3.0, [0, 0, 0, 0, 0, 0.2, 0, 0, 0, 0.0], events=[hit])
    assert is_compiled(sol)
    assert ("grazing" in str(sol.status)) == grazes


def test_a_linkage_hits_a_stop_and_stays_closed(model, regular):
    """The impulse of the constraints is the one that Python computes."""
    params, start = regular
    u = model.speeds[0]
    compiled = mechc.Event("theta_0 > 3", reset={u: f"-0.5*{u}"})
    by_python = mechc.Event(
        lambda t, y: y[0] - 3.0, direction=1, reset=lambda t, q, u: (q, [-0.5 * u[0], u[1], u[2]])
    )
    one = model.simulate(6.0, start, params, events=[compiled])
    assert is_compiled(one)
    same(one, model.simulate(6.0, start, params, events=[by_python]), 1e-11)
    assert one.closure.max() < 1e-12
    assert one.velocity_closure.max() < 1e-11
    assert (np.diff(one.energy) < 1e-7).all()


def test_continued_backwards_saved_and_in_a_later_piece(ball, tmp_path):
    event = mechc.Event("q_0", direction=-1, reset={"u_0": "-0.8*u_0"})
    whole = ball.simulate(3.0, [1.0, 0.0], events=event)
    on = ball.simulate(1.0, [1.0, 0.0], events=event).continue_to(3.0)
    np.testing.assert_allclose(on.events[0].t, whole.events[0].t, atol=1e-9)
    again = mechc.open(whole.save(tmp_path / "ball.nc"), model=ball)
    times = np.linspace(0, 3, 200)
    np.testing.assert_allclose(again(times), whole(times), atol=1e-8)
    # from the last flight back to the start: speeds grow by 1 / 0.8 at each impact
    at = whole.events[0].t[1] + 0.1
    back = mechc.Event("q_0", direction=-1, reset={"u_0": "-u_0/0.8"})
    sol = ball.simulate((at, 0.0), whole(at), events=back, rtol=1e-12)
    np.testing.assert_allclose(sol.y[-1], [1.0, 0.0], atol=1e-8)
    np.testing.assert_allclose(sol.events[0].t, whole.events[0].t[1::-1], atol=1e-9)


def test_a_value_that_is_no_number_ends_the_run_with_an_error(ball):
    event = mechc.Event("sqrt(q_0 - 0.5)", reset={"u_0": "-u_0"})
    with pytest.raises(EventError, match="NaN"):
        ball.simulate(1.0, [1.0, 0.0], events=event)
    with pytest.raises(EventError, match="reset"):
        ball.simulate(
            1.0, [1.0, 0.0], events=mechc.Event("q_0 - 0.5", reset={"u_0": "log(q_0 - 1)"})
        )
