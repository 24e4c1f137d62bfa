"""Controllers in discrete time, against the exact motion between their instants."""

import pickle

import numpy as np
import pytest

import mechc

METHODS = ("dopri5", "dop853", "gauss8", "radau5")
MASS, PERIOD, END = 2.0, 0.1, 2.05


def law(t, q, u):
    return -3.0 * q[0] - 2.0 * u[0] + np.sin(t)


def exact(instants, delay, end=END, initial=0.0):
    """A free mass under a held force moves on parabolas."""
    changes = [(t, "read") for t in instants] + [(t + delay, "apply") for t in instants]
    x, now, force, waiting = np.array([1.0, 0.0]), 0.0, initial, []
    order = sorted(changes, key=lambda change: (change[0], change[1] == "apply"))
    for t, what in [*order, (end, "end")]:
        if t > end:
            t = end
        step = t - now
        x = np.array(
            [x[0] + step * x[1] + 0.5 * force / MASS * step**2, x[1] + force / MASS * step]
        )
        now = t
        if what == "read":
            waiting.append(law(t, x[:1], x[1:]))
        elif what == "apply":
            force = waiting.pop(0)
        if now == end:
            break
    return x


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("delay", [0.0, 0.03, 0.1, 0.25])
def test_values_are_held_between_instants(pushed, method, delay):
    sampled = mechc.Sampled(law, PERIOD, delay, initial=0.7)
    sol = pushed.simulate(END, [1.0, 0.0], inputs={"F": sampled}, method=method, rtol=1e-9)
    instants = PERIOD * np.arange(21)
    np.testing.assert_allclose(sol.y[-1], exact(instants, delay, initial=0.7), atol=1e-12)
    assert np.abs(instants[:, None] - sol.t).min(axis=1).max() < 1e-15


@pytest.mark.parametrize("cut", [0.4, 0.5, 1.234])
@pytest.mark.parametrize("delay", [0.0, 0.25])
def test_a_run_that_is_continued_is_the_run_in_one(pushed, delay, cut):
    """Its controller goes on: at the instants that follow, and with what is still to be applied."""
    times = []

    def noted(t, q, u):
        times.append(t)
        return law(t, q, u)

    sampled = mechc.Sampled(noted, PERIOD, delay, jitter=0.03, seed=5)
    given = {"inputs": {"F": sampled}, "rtol": 1e-9}
    whole = pushed.simulate(END, [1.0, 0.0], **given)
    called, times[:] = list(times), []
    parts = pushed.simulate(cut, [1.0, 0.0], **given).continue_to(1.7).continue_to(END)
    np.testing.assert_allclose(parts.y[-1], whole.y[-1], atol=1e-12)
    np.testing.assert_allclose(times, called, rtol=0, atol=1e-14)
    np.testing.assert_allclose(parts(0.9 * END), whole(0.9 * END), atol=1e-10)


def test_a_gradient_knows_no_feedback_and_says_so(pushed):
    given = {"F": mechc.Sampled(law, PERIOD)}
    sol = pushed.simulate(END, [1.0, 0.0], inputs=given)
    with pytest.raises(mechc.MechcError, match="no gradient"):
        sol.gradient(end="q")


def test_a_controller_is_called_once_at_each_instant(pushed):
    times = []

    def remembering(t, q, u):
        times.append(t)
        return law(t, q, u)

    sampled = mechc.Sampled(remembering, PERIOD, 0.02, jitter=0.05, seed=3)
    sol = pushed.simulate(END, [1.0, 0.0], inputs={"F": sampled}, rtol=1e-9)
    late = np.array(times) - PERIOD * np.arange(len(times))
    assert len(times) == 21
    assert late.min() >= 0.0
    assert late.max() < 0.05
    assert np.ptp(late) > 0.02
    np.testing.assert_array_equal(times, sampled.instants(0.0, END))
    np.testing.assert_allclose(sol.y[-1], exact(np.array(times), 0.02), atol=1e-12)


def test_what_was_applied_is_a_signal_of_the_solution(pushed, tmp_path):
    sol = pushed.simulate(END, [1.0, 0.0], inputs={"F": mechc.Sampled(law, PERIOD)}, rtol=1e-9)
    force = sol.model.system.driven.given["F"]
    power = sol.model.output("power", sol.y, sol.params, sol.t)
    np.testing.assert_allclose(power[1:-1], (force(sol.t) * sol["u"])[1:-1], atol=1e-13)
    again = pushed.simulate(END, [1.0, 0.0], inputs={"F": force}, rtol=1e-9)
    np.testing.assert_array_equal(again.y[-1], sol.y[-1])
    kept = pickle.loads(pickle.dumps(force))
    np.testing.assert_array_equal(kept(sol.t), force(sol.t))
    assert sol.save(tmp_path / "run.nc").exists()


def test_a_stepper_makes_the_same_motion(pushed):
    sol = pushed.simulate(2.0, [1.0, 0.0], inputs={"F": mechc.Sampled(law, PERIOD)}, rtol=1e-9)
    stepper = pushed.stepper([1.0, 0.0], inputs={"F": 0.0}, rtol=1e-9)
    for _ in range(20):
        y = stepper.y
        stepper.step(PERIOD, {"F": law(stepper.t, y[:1], y[1:])})
    np.testing.assert_allclose(stepper.y, sol.y[-1], atol=1e-12)


def test_resets_go_on_with_the_controller(pushed):
    """A mass that a wall throws back, under a sampled force of time."""
    sampled = mechc.Sampled(lambda t: -4.0 if t < 0.95 else 1.0, PERIOD)
    wall = mechc.Event(lambda t, y: y[0], reset=lambda t, q, u: (q, -u), direction=-1)
    sol = pushed.simulate(1.5, [0.25, 0.0], inputs={"F": sampled}, events=[wall], rtol=1e-9)
    (hit,) = sol.events[0].t[:1]
    assert hit == pytest.approx(0.5, abs=1e-11)  # 0.25 = t^2
    q, u = 0.5 - 0.25, 1.0 - 2 * 0.5  # at 1 s: thrown back with 1 m/s, -2 m/s^2
    np.testing.assert_allclose(sol.y[-1], [q + 0.25 * 0.25, u + 0.25], atol=1e-9)


def test_a_controller_that_fails_ends_the_run_and_keeps_the_motion(pushed):
    def failing(t, q, u):
        return 1.0 if t < 0.5 else 1.0 / 0.0

    with pytest.raises(mechc.InputError, match=r"the input F failed at t = 0.5 s.*Zero") as caught:
        pushed.simulate(1.0, [0.0, 0.0], inputs={"F": mechc.Sampled(failing, PERIOD)})
    assert caught.value.solution.t[-1] == pytest.approx(0.5)
    with pytest.raises(mechc.InputError, match=r"1 finite number"):
        pushed.simulate(1.0, [0.0, 0.0], inputs={"F": mechc.Sampled(lambda t: (1, 2), PERIOD)})


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        ((0.0,), "the period, 0 s"),
        ((-1.0,), "period = -1"),
        ((0.1, -0.1), "delay = -0.1"),
        ((0.1, np.nan), "delay = nan"),
    ],
)
def test_times_that_make_no_sense_are_refused(arguments, told):
    with pytest.raises(mechc.MechcError, match=told):
        mechc.Sampled(law, *arguments)


def test_where_no_controller_is_taken_it_is_said(pushed):
    sampled = mechc.Sampled(law, PERIOD)
    with pytest.raises(mechc.MechcError, match="give it to simulate"):
        pushed.with_inputs({"F": sampled})
    with pytest.raises(mechc.MechcError, match="goes forwards"):
        pushed.simulate((1.0, 0.0), [0.0, 0.0], inputs={"F": sampled})
    with pytest.raises(mechc.MechcError, match="more than 10000000 instants"):
        pushed.simulate(1.0, [0.0, 0.0], inputs={"F": mechc.Sampled(law, 1e-9)})
    with pytest.raises(TypeError, match="must be a function"):
        mechc.Sampled(3.0, PERIOD)
