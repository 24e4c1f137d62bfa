"""Multibody engines are told the right mechanisms: their errors fall towards the exact motion."""

import numpy as np
import pytest

from benchmarks import peers, problems


@pytest.fixture
def errors():
    """Errors of an engine's method by its steps or tolerances, the coarsest first."""

    def of(engine, name, method, parameters):
        pytest.importorskip(engine)
        problem = problems.problem(name)
        found = peers.build(engine, problem, parameters)
        cases = sorted((c for c in found.cases if c.method == method), key=lambda c: -c.tol)
        return {
            tol: error_of(case, problem) for case in cases for tol in parameters if near(case, tol)
        }

    def error_of(case, problem):
        case.prepare()
        value = case.run()
        assert case.word(value) == "finished"
        return problem.error(case.state(value))

    def near(case, tol):
        return np.isclose(case.tol, tol, rtol=1e-9)

    return of


@pytest.mark.parametrize(("engine", "method"), [("mujoco", "RK4, h"), ("exudyn", "RK44, h")])
def test_fourth_order_methods_are_of_fourth_order_on_the_pendulum(errors, engine, method):
    coarse, fine = errors(engine, "pendulum_1", method, (0.01, 0.0025)).values()
    assert 150 < coarse / fine < 400  # 4^4 = 256
    assert fine < 1e-8


def test_an_adaptive_method_follows_its_tolerance_on_the_pendulum(errors):
    coarse, fine = errors("exudyn", "pendulum_1", "DOPRI5", (1e-6, 1e-10)).values()
    assert fine < 1e-4 * coarse
    assert fine < 1e-7


def test_soft_loops_of_the_four_bar_get_stiffer_with_the_step(errors):
    """The constraints' time constant is a few steps, so that the loop closes in the limit."""
    coarse, fine = errors("mujoco", "four_bar_regular", "RK4, h", (0.02, 0.005)).values()
    assert fine < coarse / 16
    assert fine < 0.01


def test_redundant_coordinates_of_the_four_bar_are_of_second_order(errors):
    method = "trapezoid, h"
    coarse, fine = errors("exudyn", "four_bar_regular", method, (0.02, 0.005)).values()
    assert 12 < coarse / fine < 20  # 4^2 = 16
    assert fine < 0.01


@pytest.mark.parametrize(
    ("engine", "name", "method", "step", "bound"),
    [
        ("mujoco", "slider_crank", "RK4, h", 5e-4, 1e-4),
        ("exudyn", "slider_crank", "trapezoid, h", 5e-4, 2e-3),
        ("mujoco", "windows_1", "RK4, h", 5e-4, 5e-5),
        ("exudyn", "windows_1", "gen-alpha, h", 2e-3, 1e-4),
        ("mujoco", "heavy_top", "RK4, h", 2.5e-4, 5e-5),
        ("exudyn", "heavy_top", "RK67, h", 2.5e-4, 1e-8),
    ],
)
def test_engines_are_told_the_mechanism_of_the_problem(errors, engine, name, method, step, bound):
    assert errors(engine, name, method, (step,))[step] < bound
