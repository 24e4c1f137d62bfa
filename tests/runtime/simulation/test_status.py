"""Runs that end early say when, why and what to do, and keep what was computed."""

import ctypes
import gc
import os
import signal
import threading
import weakref
from typing import ClassVar

import numpy as np
import pytest

import mechc
from mechc.simulation.status import AT_CROSSINGS, CODES, status_of


def test_a_run_that_uses_up_its_steps_says_so_and_can_be_continued(model, regular, sol):
    params, start = regular
    cut = model.simulate((0, 2), start, params, max_steps=20)
    assert cut.status.code == "too many steps"
    assert not cut.status.ok
    assert cut.status.t == cut.t[-1] < 2
    assert "Raise max_steps" in str(cut.status)
    assert cut.stats["steps"] + cut.stats["rejected"] == 20
    np.testing.assert_array_equal(cut.y, sol.y[: len(cut)])
    rest = model.simulate((cut.t[-1], 2), cut.y[-1], params)
    np.testing.assert_allclose(rest.y[-1], sol.y[-1], rtol=0, atol=1e-8)


def test_times_that_were_not_reached_fall_away(model, regular):
    params, start = regular
    cut = model.simulate((0, 2), start, params, max_steps=20, t_eval=np.linspace(0, 2, 201))
    assert 0 < len(cut.t) < 201
    assert cut.t[-1] <= cut.status.t < cut.t[-1] + 0.01
    assert cut.y.shape == (len(cut.t), 6)


def interrupted_run(model, regular, **policy):
    """A run of many minutes, with Ctrl-C after a moment."""
    params, start = regular
    timer = threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT))
    timer.start()
    with pytest.raises(KeyboardInterrupt) as interrupt:
        model.simulate((0, 1e7), start, params, **policy)
    timer.join()
    return interrupt.value.solution


@pytest.mark.parametrize("policy", [{"dense": False}, {"progress": lambda fraction: None}])
def test_ctrl_c_keeps_what_was_computed(model, regular, policy):
    sol = interrupted_run(model, regular, **policy)
    assert sol.status.code == "interrupted"
    assert 1 < sol.status.t < 1e7
    assert sol.t[-1] == sol.status.t
    assert np.isfinite(sol.y).all()
    assert np.abs(sol.model.constraints(sol.y[-1], sol.params)).max() < 1e-9
    assert "interrupted at t = " in str(sol.status)


def test_after_ctrl_c_the_next_run_is_a_whole_one(model, regular, sol):
    interrupted_run(model, regular, dense=False)
    params, start = regular
    np.testing.assert_array_equal(model.simulate((0, 2), start, params).y, sol.y)


def test_forces_beyond_doubles_end_the_run_at_its_start(model):
    params = {"g": 1e308, "m_2": 1e300}
    sol = model.simulate((0, 1), model.assemble({"theta_0": 1.0}), params)
    assert not sol.status.ok
    assert sol.status.t == 0.0
    assert sol.y.shape == (1, 6)


def test_every_ending_has_prose_with_time_cause_and_advice():
    for code, (name, cause, _) in CODES.items():
        status = status_of(code, 1.25, "omega_1")
        assert status.code == name
        assert "1.25 s" in str(status)
        assert status.ok == (not cause)
        if cause:
            assert status.cause
            assert len(status.advice) > 10
            assert str(status).endswith(status.advice)
            assert "{" not in str(status)


def test_every_cause_near_a_change_point_has_a_status_of_its_own():
    told = [status_of(code, 1.0, gap=3e-13) for code in AT_CROSSINGS]
    assert len({status.code for status in told}) == len(told)
    named = {status.code for status in told if "3.0e-13 m" in status.cause}
    assert named == {"undecided", "bend too sharp"}  # the others are not for the lengths' sake


def test_warnings_are_part_of_the_prose():
    status = mechc.Status("finished", 2.0, warnings=("Beware of the dog",))
    assert str(status) == "finished: reached t = 2 s. Beware of the dog."
    assert status.ok


class HeapInfo(ctypes.Structure):
    """What glibc says of its heap: ``struct mallinfo2``."""

    _fields_: ClassVar = [
        (name, ctypes.c_size_t)
        for name in (
            *("arena", "ordblks", "smblks", "hblks", "hblkhd"),
            *("usmblks", "fsmblks", "uordblks", "fordblks", "keepcost"),
        )
    ]


def bytes_in_use():
    libc = ctypes.CDLL(None)
    if not hasattr(libc, "mallinfo2"):
        pytest.skip("only glibc 2.33 and later says how much memory is in use")
    libc.mallinfo2.restype = HeapInfo
    info = libc.mallinfo2()
    return info.uordblks + info.hblkhd


def in_a_cycle(model, regular):
    """A run that only the cycle collector can free, as a solution and as what is behind it."""
    params, start = regular
    sol = model.simulate((0, 20), start, params)
    sol.itself = sol
    cycle = [sol.record]
    cycle.append(cycle)
    sol.record = cycle
    return sol


@pytest.mark.slow
def test_a_run_in_a_cycle_of_references_is_freed_whole(model, regular):
    """The cycle collector clears what an object holds before the object itself goes.

    What is alive in C is seen in the heap alone: a run that is kept takes some 200 KB of it.
    """
    in_a_cycle(model, regular)
    gc.collect()
    before = bytes_in_use()
    kept = in_a_cycle(model, regular)
    gc.collect()
    size = bytes_in_use() - before
    assert size > 8 * 6 * 200, "the states of more than 200 steps"
    solution, runs = weakref.ref(kept), [kept.record]
    assert len(runs[0][0].times()) > 200
    del kept, runs
    gc.collect()
    assert solution() is None
    for _ in range(4):
        in_a_cycle(model, regular)
        gc.collect()
    assert bytes_in_use() - before < size / 2


def test_a_status_shows_itself_in_a_line(model, regular, sol):
    assert repr(sol.status) == "<mechc.Status finished: reached t = 2 s>"
    crossing = model.simulate(2.0, {"theta_0": 1.4})
    assert repr(crossing.status) == "<mechc.Status finished: reached t = 2 s, 1 warning>"
