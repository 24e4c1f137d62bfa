"""Peers that integrate equations reach the exact motion: what they are given is right."""

from importlib import import_module

import numpy as np
import pytest

from benchmarks import peers, problems
from benchmarks.formulations.equations import equations_of
from benchmarks.peers import casadi_sundials, heyoka_taylor, sundae, with_tighter
from benchmarks.timing import cases

# Module of the peer, its package, and per tool and method a tolerance and the error it keeps on the
# regular four-bar over 20 s: multistep methods end a thousand times off their tolerance.
PEERS = {
    "heyoka_taylor": (
        "heyoka",
        {("heyoka", "Taylor"): (1e-10, 1e-8), ("heyoka batch", "Taylor"): (1e-10, 1e-8)},
    ),
    "casadi_sundials": (
        "casadi",
        {
            ("CasADi, CVODES", "adams"): (1e-12, 1e-6),
            ("CasADi, CVODES", "bdf"): (1e-12, 1e-5),
            ("CasADi, IDAS", "bdf"): (1e-12, 1e-6),
        },
    ),
    "sundae": (
        "sksundae",
        {
            ("scikit-sundae, CVODE", "Adams"): (1e-12, 1e-6),
            ("scikit-sundae, CVODE", "BDF"): (1e-12, 1e-5),
            ("scikit-sundae, IDA", "BDF"): (1e-10, 1e-5),
        },
    ),
}


def integrated(peer, name, tolerances):
    """The problem, what the peer built, and the error of each case."""
    pytest.importorskip(PEERS[peer][0])
    problem = problems.problem(name)
    built = import_module(f"benchmarks.peers.{peer}").build(problem, tolerances, quick=True)
    cases.measure(built.cases, problem.error, cases.Effort(longest=np.inf, rounds=0))
    return problem, built


@pytest.mark.parametrize("peer", PEERS)
def test_a_peer_follows_a_closed_loop_to_its_exact_state(peer):
    """The error falls with the tolerance, to what the method can do."""
    promises = PEERS[peer][1]
    tolerances = sorted({1e-6, *(tol for tol, _ in promises.values())}, reverse=True)
    _, built = integrated(peer, "four_bar_regular", tolerances)
    errors = {(case.tool, case.method, case.tol): case.error for case in built.cases}
    for (tool, method), (tol, limit) in promises.items():
        assert errors[tool, method, tol] < limit, (tool, method)
        assert errors[tool, method, tol] < 1e-2 * errors[tool, method, 1e-6], (tool, method)
    assert set(built.setup) == set(import_module(f"benchmarks.peers.{peer}").TOOLS)
    assert all(set(seconds) == {"derive", "compile"} for seconds in built.setup.values())


@pytest.mark.parametrize("peer", PEERS)
def test_a_peer_is_given_speeds_that_are_not_rates(peer):
    """The heavy top, whose coordinates' rates are functions of its body rates."""
    _, built = integrated(peer, "heavy_top", [1e-10])
    for case in built.cases:
        assert case.error < 1e-4, (case.tool, case.method, case.status)


def test_a_second_run_of_a_peer_starts_where_the_first_did():
    """heyoka's integrators keep their state; each run is from the start."""
    _, built = integrated("heyoka_taylor", "pendulum_1", [1e-9])
    for case in built.cases:
        states = []
        for _ in range(2):
            case.prepare()
            states.append(case.state(case.run()))
        np.testing.assert_array_equal(*states)


def test_a_taylor_integrator_leaves_a_start_at_rest():
    """Order eight, whose last two coefficients vanish there by symmetry."""
    _, built = integrated("heyoka_taylor", "pendulum_1", [1e-6])
    assert all(case.error < 1e-5 for case in built.cases)


def test_a_run_that_sundials_ends_is_shown_with_its_code(monkeypatch):
    """A status, no state, and no message of CasADi's own."""
    pytest.importorskip("casadi")
    monkeypatch.setattr(casadi_sundials, "MOST_STEPS", 20)
    _, built = integrated("casadi_sundials", "four_bar_regular", [1e-6])
    assert {case.status for case in built.cases} == {"CV_TOO_MUCH_WORK", "IDA_TOO_MUCH_WORK"}
    assert {case.label for case in built.cases} == {"flagged"}


def test_times_of_a_batch_are_those_of_one_member():
    _, built = integrated("heyoka_taylor", "pendulum_1", [1e-9])
    (batch,) = (case for case in built.cases if case.tool == "heyoka batch")
    batch.seconds = [8.0 * batch.trajectories, 4.0 * batch.trajectories]
    assert batch.record()["seconds"] == 4.0


def test_rates_too_long_for_a_compiler_are_refused_with_their_length(monkeypatch):
    pytest.importorskip("heyoka")
    monkeypatch.setattr(heyoka_taylor, "MOST_OPERATIONS", 10)
    with pytest.raises(peers.NotExpressibleError, match=r"takes \d+ operations"):
        heyoka_taylor.build(problems.problem("four_bar_regular"), [1e-6])


@pytest.mark.parametrize("name", ["four_bar_regular", "heavy_top"])
def test_the_start_of_index_one_is_consistent(name):
    """No residual at the start, and one beside it."""
    pytest.importorskip("sksundae")
    equations = equations_of(problems.problem(name))
    rows, (y, rate) = sundae.index_one(equations), sundae.consistent_start(equations)
    found = np.zeros_like(y)
    rows(0.0, y, rate, found)
    assert np.abs(found).max() < 1e-10 * (1 + np.abs(y).max())
    rows(0.0, y, rate + 1.0, found)
    assert np.abs(found).max() > 0.1


def test_tighter_tolerances_are_added_where_the_tightest_are_asked_for():
    assert with_tighter([1e-6, 1e-12]) == pytest.approx([1e-6, 1e-12, 1e-13, 1e-14, 1e-15])
    assert with_tighter([1e-6, 1e-8]) == [1e-6, 1e-8]
