"""Events: transversal zeros found, several in a step, located on the dense output."""

import math

import numpy as np
import pytest

import mechc
from mechc.errors import ValueOutOfBoundsError

PARAMS = {"l_3": 3.5}
HALF_PERIOD = 1.6607240639610833  # from the quadrature of the regular four-bar


@pytest.fixture(scope="module")
def model():
    return mechc.load("four_bar")


@pytest.fixture(scope="module")
def start(model):
    return model.assemble({"theta_0": np.radians(85)}, params=PARAMS)


def test_the_turning_point_is_found_where_the_quadrature_has_it(model, start):
    turning = mechc.Event(lambda t, y: y[3], direction=-1)
    sol = model.simulate(20, start, PARAMS, rtol=1e-12, events=[turning])
    (found,) = sol.events
    assert found.t[0] == pytest.approx(HALF_PERIOD, abs=1e-11)
    assert np.diff(found.t) == pytest.approx(2 * HALF_PERIOD, abs=1e-10)
    assert np.degrees(found.y[:, 0]) == pytest.approx(412.48633345706614, abs=1e-8)


def test_several_zeros_in_one_step_are_found_and_located(model, start):
    rapid = lambda t, y: math.sin(150 * t)  # noqa: E731
    sol = model.simulate(5, start, PARAMS, rtol=1e-6, events=[rapid])
    exact = np.pi / 150 * np.arange(1, int(5 * 150 / np.pi) + 1)
    assert len(exact) > 2 * sol.stats["steps"]
    assert sol.events[0].t == pytest.approx(exact, abs=1e-12)


def test_a_pair_of_zeros_between_two_samples_is_found(model, start):
    dip = lambda t, y: (t - 1.2345) ** 2 - 1e-8  # noqa: E731
    sol = model.simulate(3, start, PARAMS, rtol=1e-6, events=[dip])
    assert sol.events[0].t == pytest.approx([1.2344, 1.2346], abs=1e-9)


def test_states_at_events_close_the_loop(model, start):
    crossing = lambda t, y: math.sin(5 * y[0])  # noqa: E731
    sol = model.simulate(10, start, PARAMS, events=[crossing])
    assert len(sol.events[0].t) > 20
    assert np.abs(model.constraints(sol.events[0].y, PARAMS)).max() < 1e-13
    assert np.abs(np.sin(5 * sol.events[0].y[:, 0])).max() < 1e-11


@pytest.mark.parametrize("end", [20.0, -20.0], ids=["forwards", "backwards"])
def test_a_terminal_event_ends_the_run_there(model, start, end):
    turning = mechc.Event(lambda t, y: y[3], terminal=True)
    ticking = lambda t, y: math.sin(20 * t)  # noqa: E731
    sol = model.simulate((0, end), start, PARAMS, rtol=1e-11, events=[turning, ticking])
    assert sol.status.code == "stopped by an event"
    assert sol.status.ok
    assert abs(sol.t[-1]) == pytest.approx(HALF_PERIOD, abs=1e-9)
    assert sol.span[1] == sol.t[-1]
    assert sol.y[-1, 3] == pytest.approx(0, abs=1e-9)
    assert len(sol.events[1].t) == int(20 * HALF_PERIOD / np.pi)
    with pytest.raises(ValueOutOfBoundsError, match="covers"):
        sol(math.copysign(2.0, end))


def test_scipys_attributes_are_understood(model, start):
    def rising(t, y):
        return y[0] - 4.0

    rising.direction = 1
    rising.terminal = False
    sol = model.simulate(2 * HALF_PERIOD, start, PARAMS, events=[rising])
    both = model.simulate(2 * HALF_PERIOD, start, PARAMS, events=[lambda t, y: y[0] - 4.0])
    assert len(sol.events[0].t) == 1
    assert len(both.events[0].t) == 2
    assert both.events[0].t[0] == sol.events[0].t[0]


def test_reported_times_stop_at_a_terminal_event(model, start):
    turning = mechc.Event(lambda t, y: y[3], terminal=True, direction=-1)
    times = np.linspace(0, 5, 51)
    sol = model.simulate(5, start, PARAMS, events=[turning], t_eval=times)
    assert np.array_equal(sol.t, times[times <= HALF_PERIOD])


def test_what_is_no_function_is_refused(model, start):
    with pytest.raises(ValueOutOfBoundsError, match="a function of t and y, not 3"):
        model.simulate(1, start, PARAMS, events=[3])
