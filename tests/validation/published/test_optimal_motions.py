"""Optimal motions with known costs, found by IPOPT, and by SciPy where they are small."""

import numpy as np
import pytest

from benchmarks.problems.optimal import PROBLEMS, RADIUS, G

NEAR = 1e-4  # of the cost, where the inputs are not those of the exact motion


def _found(name, solver, **options):
    if solver == "ipopt":
        pytest.importorskip("casadi")
    found = PROBLEMS[name]().optimise(solver=solver, **options)
    assert found.converged, str(found)
    assert found.deviation < 1e-7
    return found


@pytest.mark.slow(cases=99)
@pytest.mark.parametrize("solver", ["ipopt", "slsqp"])
@pytest.mark.parametrize(
    ("name", "error"),
    [("double integrator", 1e-7), ("brachistochrone", 1e-7), ("thrown ball", 1e-9)],
)
def test_a_cost_in_closed_form(name, error, solver):
    few = {"intervals": 6} if name != "thrown ball" else {}
    found = _found(name, solver, **few)
    assert found.cost == pytest.approx(PROBLEMS[name]().known(), rel=error)


def test_the_bead_runs_down_a_cycloid():
    """Whose slope falls evenly in time: lines between samples are exact."""
    found = _found("brachistochrone", "slsqp", intervals=4)
    t = np.linspace(0.0, found.duration, 50)
    turned = t * np.sqrt(G / RADIUS)
    x, y = RADIUS * (turned - np.sin(turned)), RADIUS * (1.0 - np.cos(turned))
    states = found.solution(t)
    names = found.solution.system.coordinates
    for name, wanted in (("x", x), ("y", y)):
        np.testing.assert_allclose(states[:, names.index(name)], wanted, atol=1e-5)


@pytest.mark.slow
def test_the_least_force_of_a_crane():
    """By Pontryagin's conditions 309.765777 N² s; with lines between 21 samples 7e-7 more."""
    found, known = _found("crane", "ipopt"), PROBLEMS["crane"]().known()
    assert known == pytest.approx(309.765777, rel=1e-8)
    assert 0.0 < found.cost / known - 1.0 < 1e-6
    force = found.along("force", t=np.linspace(0.0, 2.5, 4001))[:, 0]
    assert np.trapezoid(force**2, dx=2.5 / 4000) == pytest.approx(found.cost, rel=1e-6)


@pytest.mark.slow
@pytest.mark.thorough
def test_the_least_time_of_a_five_bar_robot():
    """Against the times at which its torques turn, as roots of what is missed at the end."""
    found = _found("five-bar", "ipopt")
    assert 0.0 < found.cost / PROBLEMS["five-bar"]().known() - 1.0 < NEAR
    torques = np.abs([signal.values for signal in found.signals.values()])
    assert (torques > 1.0 - 1e-4).mean() > 0.95
    assert found.solution.closure.max() < 1e-12
