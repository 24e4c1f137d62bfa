"""Overconstrained loops: rows that are redundant on closed configurations only."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import mechc
from benchmarks.problems.closed_loops import bennett, bricard, parallel_cranks
from benchmarks.problems.data import reference

pytestmark = pytest.mark.slow  # scenes that take long to compile

T_END = 10.0
METHODS = ("dopri5", "dop853", "gauss8", "radau5")


def moves_as(model, q, exact, rtol, method):
    """A run from rest ends where it should, its loops closed."""
    sol = model.simulate(T_END, np.append(q, np.zeros(len(q))), rtol=rtol, method=method)
    assert sol.status.ok
    assert np.abs(sol.q[-1] - exact).max() < 100 * rtol + 1e-10
    assert sol.closure.max() < 1e-13


# -- three cranks: a pendulum ---------------------------------------------------------------------


@pytest.fixture(scope="module")
def cranks():
    return mechc.compile(parallel_cranks(3))


def pendulum(count, start):
    """The angle at the end: cranks of 1 kg turn, the bar of 1 kg goes along with their ends."""
    inertia, moment = count / 3 + 1, 9.81 * (count / 2 + 1)
    run = solve_ivp(
        lambda t, y: [y[1], -moment / inertia * np.cos(y[0])], (0, T_END), [start, 0.0],
        method="DOP853", rtol=3e-14, atol=1e-14,
    )  # fmt: skip
    return run.y[0, -1]


def crank_angles(model, angle):
    """Relative angles: the bar keeps its direction."""
    return np.array([-angle if name == "q_bar" else angle for name in model.coordinates])


@pytest.mark.parametrize("rtol", [1e-3, 1e-6, 1e-9, 1e-12])
@pytest.mark.parametrize("method", ["dopri5", "dop853", "gauss8"])
def test_parallel_cranks_move_as_a_pendulum(cranks, method, rtol):
    start = crank_angles(cranks, 1.0)
    moves_as(cranks, start, crank_angles(cranks, pendulum(3, 1.0)), rtol, method)


@pytest.mark.thorough
def test_five_parallel_cranks_move_as_a_pendulum():
    model = mechc.compile(parallel_cranks(5))
    exact = crank_angles(model, pendulum(5, 1.0))
    for method in METHODS:
        for rtol in (1e-3, 1e-6, 1e-9):
            moves_as(model, crank_angles(model, 1.0), exact, rtol, method)


def test_a_start_typed_with_few_digits_is_closed_and_not_thrown(cranks):
    angles = np.round(crank_angles(cranks, 1.0), 9)
    angles += 0, 3e-9, 0, -2e-9
    start = np.append(angles, np.zeros(4))
    sol = cranks.simulate(1.0, start, rtol=1e-9)
    assert np.abs(sol.y[0] - start).max() < 1e-8
    assert np.ptp(sol.energy) < 1e-7


# -- single loops in space ------------------------------------------------------------------------


def angles_of(name):
    """Start and end on the closed curve, in 30 digits (benchmarks/references/closed_loops.py)."""
    states = [np.array(reference("closed_loops")[name][at], float) for at in ("start", "end")]
    return [state[: len(state) // 2] for state in states]


@pytest.fixture(scope="module")
def six_bar():
    return mechc.compile(bricard())


@pytest.mark.parametrize("rtol", [1e-3, 1e-6, 1e-9, 1e-12])
@pytest.mark.parametrize("method", ["dop853", "gauss8"])
def test_bricards_linkage_moves_as_on_its_closed_curve(six_bar, method, rtol):
    moves_as(six_bar, *angles_of("bricard"), rtol, method)


def test_the_row_of_bricards_linkage_that_is_redundant_is_named(six_bar):
    (found,) = six_bar.redundant_constraints()
    assert found.name in six_bar.constraint_names
    assert len(found.follows_from) > 1
    assert f"  {found}" in six_bar.report()


def test_bennetts_linkage_moves_as_on_its_closed_curve():
    model = mechc.compile(bennett())
    for method in METHODS:
        for rtol in (1e-3, 1e-6, 1e-9):
            moves_as(model, *angles_of("bennett"), rtol, method)
