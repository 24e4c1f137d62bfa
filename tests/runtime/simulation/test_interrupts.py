"""Ctrl-C is answered within a fifth of a second of work, whatever is under way and whatever a step
costs, and what was computed is kept."""

import itertools
import signal
import threading
import time
from contextlib import contextmanager

import numpy as np
import pytest

import mechc
from mechc.simulation import simulate as simulation

AT_MOST = 0.2  # s of processor time: other programs' work does not count
WORKS = 0.3  # s before the signal comes


@contextmanager
def interrupted():
    """KeyboardInterrupt after a while of work; how long it took until it was answered."""

    def interrupt(*_):
        raise KeyboardInterrupt

    latency = []
    before = signal.signal(signal.SIGPROF, interrupt)
    signal.setitimer(signal.ITIMER_PROF, WORKS)
    started = time.process_time()
    try:
        yield latency
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        latency.append(time.process_time() - started - WORKS)
        signal.signal(signal.SIGPROF, before)


@pytest.mark.parametrize("method", ["dopri5", "dop853", "gauss8", "radau5"])
def test_a_run_by_any_method(model, regular, method):
    params, start = regular
    with interrupted() as latency, pytest.raises(mechc.RunInterrupt) as cut:
        model.simulate(1e6, start, params, method=method, dense=False)
    assert cut.value.solution.status.code == "interrupted"
    assert latency[0] < AT_MOST
    assert len(cut.value.solution.t) > 100


def test_a_loop_of_runs_ends(model, regular):
    params, start = regular

    def runs():
        for _ in range(1_000_000):
            model.simulate(1.0, start, params)

    with interrupted(), pytest.raises(KeyboardInterrupt):
        runs()


def test_a_run_that_goes_on_has_both_parts(model, regular):
    params, start = regular
    first = model.simulate(1.0, start, params, events=["theta_0 - 2"])
    with interrupted(), pytest.raises(mechc.RunInterrupt) as cut:
        first.continue_to(1e6)
    sol = cut.value.solution
    assert sol.t[0] == 0.0
    assert np.array_equal(sol.t[: len(first.t)], first.t)
    assert len(sol.events[0].t) > len(first.events[0].t)
    assert sol.stats["wall_s"] > first.stats["wall_s"]


@pytest.mark.slow
def test_the_motion_stays_where_its_derivatives_are_interrupted(monkeypatch):
    def interrupt(*_):
        raise KeyboardInterrupt

    model = mechc.load("four_bar", outputs=("energy", "sensitivities"))
    monkeypatch.setattr(mechc.Solution, "differentiate", interrupt)
    with pytest.raises(mechc.RunInterrupt) as cut:
        model.simulate(1.0, {"theta_0": 1.0}, {"l_3": 3.5}, sensitivities=["l_3"])
    assert cut.value.solution.status.ok


def test_a_stepper_goes_on_from_the_time_reached(model, regular):
    params, start = regular
    calls = itertools.count()

    def interrupt(t, y):
        if next(calls) == 500:
            raise KeyboardInterrupt
        return y[0] - 2.0

    stepper = model.stepper(start, params, events=[interrupt])

    def steps():
        while True:
            stepper.step(0.1)

    with pytest.raises(KeyboardInterrupt):
        steps()
    assert stepper.status.code == "interrupted"
    reached = stepper.t
    stepper.set()
    stepper.step(0.1)
    assert stepper.t == pytest.approx(reached + 0.1)


def test_dense_output_at_very_many_times(sol):
    times = np.linspace(*sol.span, 8_000_000)
    with interrupted() as latency, pytest.raises(KeyboardInterrupt):
        sol(times)
    assert latency[0] < AT_MOST


def test_very_many_times_to_report_at(model, regular):
    params, start = regular
    times = np.linspace(0, 2, 8_000_000)
    with interrupted() as latency, pytest.raises(KeyboardInterrupt):
        _ = model.simulate(2.0, start, params, t_eval=times).y
    assert latency[0] < AT_MOST


@pytest.mark.parametrize("output", ["rhs", "energy", "multipliers"])
def test_outputs_at_very_many_states(model, regular, output):
    params, start = regular
    states = np.tile(start, (6_000_000, 1))
    call = {
        "rhs": lambda: model.rhs(0.0, states, params),
        "energy": lambda: model.energy(states, params),
        "multipliers": lambda: model.multipliers(states, params),
    }[output]

    def again():
        while True:
            call()

    with interrupted() as latency, pytest.raises(KeyboardInterrupt):
        again()
    assert latency[0] < AT_MOST


def test_a_batch(model):
    start = mechc.Assembly({"theta_0": np.linspace(0.9, 1.5, 64)})
    with interrupted() as latency, pytest.raises(mechc.RunInterrupt) as cut:
        model.simulate_batch(1e6, start, {"l_3": 3.5}, threads=1)
    assert not cut.value.batch.complete
    assert cut.value.batch.model is model
    assert latency[0] < AT_MOST + 0.1  # the main thread looks at its workers ten times a second


def test_how_often_signals_are_looked_at_changes_no_bit(model, regular, monkeypatch):
    params, start = regular
    for method in ("dopri5", "dop853", "gauss8", "radau5", "auto"):
        runs = []
        for chunk in (1, 3, 2000):
            monkeypatch.setattr(simulation, "CHUNK", chunk)
            runs.append(model.simulate(5.0, start, params, method=method, rtol=1e-7))
        for other in runs[1:]:
            assert np.array_equal(runs[0].t, other.t)
            assert np.array_equal(runs[0].y, other.y)


def test_blocks_change_no_bit_of_what_is_evaluated(model, sol):
    times = np.linspace(*sol.span, 100_003)
    states = sol(times)
    some = slice(54_321, 54_328)
    assert np.array_equal(states[some], sol(times[some]))
    rates = model.rhs(times, states)
    assert np.array_equal(rates[some], model.rhs(times[some], states[some]))
    assert np.array_equal(rates[-1], model.rhs(times[-1], states[-1]))


def test_other_threads_run_meanwhile(sol):
    times, count, done = np.linspace(*sol.span, 1_000_000), [0], threading.Event()

    def tick():
        while not done.is_set():
            count[0] += 1
            time.sleep(0.001)

    thread = threading.Thread(target=tick)
    thread.start()
    started = time.perf_counter()
    sol(times)
    wall = time.perf_counter() - started
    done.set()
    thread.join()
    assert count[0] > 20 * wall  # a turn every 50 ms at least, on a machine that others use
