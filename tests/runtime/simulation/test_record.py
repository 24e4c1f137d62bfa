"""A finished run goes on as if it had never stopped, whatever stopped it."""

import numpy as np
import pytest

import mechc
from mechc.errors import ChangePointError, MechcError, ValueOutOfBoundsError
from tests.support import fake_linkage


def exact(t):
    return fake_linkage.exact_state(np.asarray(t, dtype=float))


@pytest.mark.parametrize("end", [3.0, -3.0])
@pytest.mark.parametrize("method", ["dop853", "gauss8"])
def test_a_continued_run_is_one_motion(model, regular, end, method):
    params, start = regular
    first = model.simulate(end / 3, start, params, method=method, rtol=1e-10)
    whole = first.continue_to(2 * end / 3).continue_to(end)
    assert whole.status.ok
    assert whole.span == (0.0, end)
    assert (np.diff(whole.t) * np.sign(end) > 0).all()
    np.testing.assert_array_equal(whole.y[: len(first)], first.y)
    times = np.linspace(0, end, 301)
    np.testing.assert_allclose(whole(times), exact(times), rtol=0, atol=1e-7)
    np.testing.assert_allclose(whole(whole.t), whole.y, rtol=0, atol=1e-13)
    assert whole.stats["steps"] == len(whole) - 1
    assert whole.closure.max() < 1e-13


def test_a_run_that_ran_out_of_steps_goes_on(model, regular, sol):
    params, start = regular
    cut = model.simulate(2.0, start, params, max_steps=20)
    whole = cut.continue_to(2.0, max_steps=10_000)
    assert whole.status.ok
    np.testing.assert_allclose(whole.y[-1], sol.y[-1], rtol=0, atol=1e-8)


def test_events_go_on_and_a_terminal_one_stops_again(model, regular):
    params, start = regular
    turning = mechc.Event(lambda t, y: y[3], terminal=True)
    ticking = lambda t, y: np.sin(20 * t)  # noqa: E731
    first = model.simulate(20.0, start, params, rtol=1e-11, events=[turning, ticking])
    third = first.continue_to(20.0).continue_to(20.0)
    half = fake_linkage.HALF_PERIOD
    assert third.status.code == "stopped by an event"
    np.testing.assert_allclose(third.events[0].t, half * np.arange(1, 4), rtol=0, atol=1e-9)
    np.testing.assert_allclose(
        third.events[1].t, np.pi / 20 * np.arange(1, int(60 * half / np.pi) + 1), atol=1e-12
    )
    assert third.t[-1] == third.span[1] == third.status.t
    assert (np.diff(third.t) > 0).all()
    times = np.linspace(0, third.span[1], 200)
    np.testing.assert_allclose(third(times), exact(times), rtol=0, atol=1e-8)


def test_change_points_of_both_parts_are_told_once(model):
    start = model.assemble({"theta_0": np.radians(85)})
    whole = model.simulate(3.0, start, rtol=1e-10)
    parts = model.simulate(1.2, start, rtol=1e-10).continue_to(3.0)
    np.testing.assert_allclose(
        [c.t for c in parts.change_points], [c.t for c in whole.change_points], atol=1e-8
    )
    assert f"Crossed {len(whole.change_points)} change points" in str(parts.status)
    stopped = model.simulate(3.0, start, rtol=1e-10, on_change_point="stop")
    on = stopped.continue_to(1.2, on_change_point="continue")
    np.testing.assert_allclose(on.y[-1], parts(1.2), rtol=0, atol=1e-7)
    with pytest.raises(ChangePointError, match=r"t = 1\.5077"):
        on.continue_to(3.0, on_change_point="raise")


def test_a_start_at_a_change_point_is_continued(model):
    (way, _) = model.assemblies({"theta_0": np.pi}, speeds={"omega_0": 1.0})
    parts = model.simulate(0.01, way, rtol=1e-11).continue_to(0.5)
    whole = model.simulate(0.5, way, rtol=1e-11)
    np.testing.assert_allclose(parts.y[-1], whole.y[-1], rtol=0, atol=1e-8)


def test_where_a_run_cannot_go_on(model, regular, sol):
    params, start = regular
    with pytest.raises(ValueOutOfBoundsError, match="cannot be continued to 1 s"):
        sol.continue_to(1.0)
    with pytest.raises(MechcError, match="dense=True"):
        model.simulate(1.0, start, params, dense=False).continue_to(2.0)
    same = sol.continue_to(2.0)
    np.testing.assert_array_equal(same.y[-1], sol.y[-1])
