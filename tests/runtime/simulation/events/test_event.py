"""Events: transversal zeros found, several in a step, located on the dense output."""

import math

import numpy as np
import pytest
import sympy as sm
from sympy.physics.mechanics import dynamicsymbols

import mechc
from mechc.errors import ValueOutOfBoundsError
from tests.support import fake_linkage

PARAMS = {"l_3": 3.5}
HALF_PERIOD = 1.6607240639610833  # from the quadrature of the regular four-bar


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


@pytest.mark.parametrize("apart", [2e-4, 2e-6])
@pytest.mark.parametrize("power", [1, 2])
def test_both_zeros_of_a_pair_are_found_wherever_in_a_step_they_lie(model, start, apart, power):
    """Also between the last sample of a step and its end, and where the dip is no parabola."""
    half = 0.5 * apart
    for at in np.linspace(0.7, 1.9, 60):
        dip = lambda t, y: ((t - at) ** 2) ** power - (half**2) ** power  # noqa: B023, E731
        sol = model.simulate(2.5, start, PARAMS, rtol=1e-6, events=[dip])
        assert sol.events[0].t == pytest.approx([at - half, at + half], abs=1e-3 * apart)


@pytest.mark.parametrize("touching", ["(t - 1.234)**2", "abs(t - 1.234)", "-(t - 1.234)**4"])
def test_a_zero_that_is_only_touched_is_found_or_told(model, start, touching):
    sol = model.simulate(2.5, start, PARAMS, events=[touching])
    told = [note for note in sol.status.warnings if "only touches its zero at t = 1.23" in note]
    assert np.abs(sol.events[0].t - 1.234).max(initial=0.0) < 1e-3
    assert len(sol.events[0].t) or len(told) == 1


def test_a_zero_that_is_touched_where_a_step_ends_is_told():
    """Steps end at the corner of the law, where the event touches its zero."""
    q, u = dynamicsymbols("q u")
    given = mechc.from_equations([q], [u], sm.Matrix([1]), [-q - 0.3 * sm.Abs(q)], name="corner")
    model = mechc.compile(given)
    for method in ("gauss8", "dop853"):
        sol = model.simulate(4, [1.0, 0.0], method=method, events=["q**2"])
        assert len(sol.events[0].t) or any("only touches" in each for each in sol.status.warnings)


@pytest.mark.parametrize("reset", [None, {"omega_0": "omega_0"}])
@pytest.mark.parametrize(
    ("poles", "zeros"),
    [
        ("1/(t - 0.731)", []),
        ("1/(t - 0.731)**3", []),
        ("tan(3*t)", np.pi / 3 * np.arange(1, 3)),
        ("2/(t - 1.5) - 8", [1.75]),
        ("1/t*(t - 1)", [1.0]),
        ("sign(t - 1.1)*abs(t - 1.1)**(-1/3)", []),
        ("sign(t - 1.1)*log(abs(t - 1.1)/8)", []),
    ],
)
def test_a_pole_is_no_zero(poles, zeros, reset):
    model = mechc.load("pendulum")
    sol = model.simulate(2.5, [1.0, 0.0], events=[mechc.Event(poles, reset=reset)])
    assert sol.events[0].t == pytest.approx(zeros, abs=1e-12)
    assert sol.status.ok


@pytest.mark.parametrize("rate", [300.0, 1000.0, 7777.0])
def test_an_event_that_changes_faster_than_the_motion_is_followed(model, start, rate):
    sol = model.simulate(4.0, start, {"l_3": 3.5}, events=[lambda t, y: np.sin(rate * t)])
    exact = np.arange(1, int(4.0 * rate / np.pi) + 1) * np.pi / rate
    assert len(sol.events[0].t) == len(exact)
    assert np.abs(sol.events[0].t - exact).max() < 1e-11
    assert not sol.status.warnings


def test_an_event_too_fast_to_follow_is_told(model, start):
    sol = model.simulate(1.0, start, {"l_3": 3.5}, events=[lambda t, y: np.sin(1e6 * t)])
    (told,) = sol.status.warnings
    assert told.startswith("Event 0 changes so fast from t = 0 s on")
    assert "max_step" in told


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
    with pytest.raises(ValueOutOfBoundsError, match=r"a function of t and y, .*not 3"):
        model.simulate(1, start, PARAMS, events=[3])
    with pytest.raises(ValueOutOfBoundsError, match=r"not \{'theta_0': 1\}"):
        model.simulate(1, start, PARAMS, events={"theta_0": 1})
    with pytest.raises(ValueOutOfBoundsError, match="not 3"):
        model.simulate(1, start, PARAMS, events=3)


@pytest.mark.parametrize("end", [30.0, -30.0])
@pytest.mark.parametrize("direction", [-1, 0, 1])
def test_directions_are_those_of_time_as_the_run_goes(model, start, end, direction):
    wave = mechc.Event(lambda t, y: math.sin(7 * t), direction=direction)
    sol = model.simulate((0, end), start, PARAMS, rtol=1e-7, events=[wave])
    exact = np.sign(end) * np.pi / 7 * np.arange(1, int(30 * 7 / np.pi) + 1)
    along = np.cos(7 * exact) * np.sign(end)  # growing as the run goes
    wanted = exact if direction == 0 else exact[along * direction > 0]
    assert sol.events[0].t == pytest.approx(wanted, abs=1e-12)


def test_zeros_late_in_time_are_located_to_a_few_units_of_the_last_place(model, start):
    late = 1e5
    wave = lambda t, y: math.sin(7 * (t - late))  # noqa: E731
    sol = model.simulate((late, late + 5), start, PARAMS, events=[wave])
    exact = late + np.pi / 7 * np.arange(1, int(35 / np.pi) + 1)
    assert np.abs(sol.events[0].t - exact).max() <= 4 * math.ulp(late)


def test_the_nth_zero_can_be_terminal(model, start):
    third = mechc.Event(lambda t, y: math.sin(7 * t), terminal=3, direction=-1)
    sol = model.simulate(20, start, PARAMS, events=[third])
    assert sol.status.code == "stopped by an event"
    assert sol.t[-1] == pytest.approx(5 * np.pi / 7, abs=1e-12)
    assert len(sol.events[0].t) == 3


def test_states_at_events_are_those_of_the_exact_motion(model, start):
    """Where the crank passes 150 degrees: on the manifold, and as the closed form has it."""
    target = np.radians(150)
    passing = mechc.Event(lambda t, y: y[0] - target)
    sol = model.simulate(10, start, PARAMS, rtol=1e-11, events=[passing])
    record = sol.events[0]
    assert len(record.t) == 6
    exact = fake_linkage.exact_state(record.t)
    np.testing.assert_allclose(record.y, exact, rtol=0, atol=1e-8)
    np.testing.assert_allclose(record.y[:, 0], target, rtol=0, atol=1e-11)
    assert np.abs(model.constraints(record.y, PARAMS)).max() < 1e-13
    assert np.abs(model.velocity_constraints(record.y, PARAMS)).max() < 1e-13


def test_the_work_for_events_grows_with_the_steps_alone(model, start):
    calls = []
    asked = [lambda t, y: (calls.append(t), y[3])[1]]
    of_a_step = []
    for t_end in (50.0, 400.0):
        calls.clear()
        sol = model.simulate(t_end, start, PARAMS, events=asked)
        of_a_step.append(len(calls) / (len(sol.t) - 1))
    assert of_a_step[1] == pytest.approx(of_a_step[0], rel=0.2)


@pytest.mark.parametrize(
    ("fail", "told"),
    [
        (lambda: 1 / 0, "ZeroDivisionError: division by zero"),
        (lambda: math.nan, "gave NaN"),
        (lambda: None, "TypeError"),
    ],
)
def test_a_failing_event_function_keeps_the_run(model, start, fail, told):
    def thermostat(t, y):
        return fail() if t > 3.0 else math.sin(7 * t)

    with pytest.raises(
        mechc.EventError, match=f"event function thermostat .*t = 3.*{told}|NaN"
    ) as e:
        model.simulate(10, start, PARAMS, events=[thermostat])
    sol = e.value.solution
    assert sol.status.code == "event failed"
    assert not sol.status.ok
    assert "thermostat" in str(sol.status)
    assert sol.t[-1] > 3.0
    assert len(sol.events[0].t) >= 5
    assert (e.value.__cause__ is None) == (told == "gave NaN")
    np.testing.assert_allclose(sol(2.0), fake_linkage.exact_state(2.0), atol=1e-6)


def test_events_show_themselves_in_a_line(model):
    event = mechc.Event("theta_0 > 2", direction=1, terminal=3, reset={"omega_0": "0"})
    assert repr(event) == "<mechc.Event theta_0 > 2, direction +1, terminal, with a reset>"
    sol = model.simulate(2.0, {"theta_0": 1.4}, {"l_3": 3.5}, events=["theta_0 - 2", "t - 5"])
    crossing, none = sol.events
    assert repr(none) == "<mechc.EventRecord: 0 zeros>"
    assert repr(crossing).startswith(f"<mechc.EventRecord: {len(crossing.t)} zero")
    assert f"at t = {crossing.t[0]:.6g}" in repr(crossing)
