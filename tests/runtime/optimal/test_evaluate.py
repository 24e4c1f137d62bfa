"""Costs and conditions by multiple shooting: their derivatives against differences."""

import numpy as np
import pytest
import sympy as sm
from sympy.physics.mechanics import dynamicsymbols

import mechc
from benchmarks.problems import optimal as problems
from mechc.optimal.evaluate import evaluate, slopes_of_evaluation
from mechc.optimal.find import _with_nodes
from mechc.optimal.intervals import differentiate
from mechc.optimal.question import Question, read_problem

STEP = 1e-6  # of the sizes
RUN = {"events": (), "rtol": 1e-12, "method": "auto"}
BEAD = {
    "integral": "v**2*x + sin(slope)*t*duration", "final": "duration*x*slope",
    "bounds": {"v*slope": (None, 10.0), "t*x[0] + v": (None, 9.0)},
    "end": {"x": 1.2, "v*x": (0.0, 30.0)},
}  # fmt: skip
BALL = {
    "integral": "w**2 + v*t + x[0]*y", "final": "v[0]**2 + w[0]**2",
    "bounds": {"y - w[0]*v": (-99.0, 99.0)}, "end": {"x - x[0]": 6.0},
    "free": {"x": (-1.0, 1.0), "v": (0.0, 9.0), "w": (-9.0, 9.0)},
}  # fmt: skip
FIVE_BAR = {
    "integral": "points[4,0]**2 + T_left*u_left + energy", "final": "duration*l",
    "bounds": {"points[4,1]": (0.2, 0.5)}, "end": {"u_left": 0.0},
}  # fmt: skip


def _problem(model, arguments, options, seed=1):
    """The problem, and unknowns beside where a search begins, so that motions do not meet."""
    asked = {"controls": {}, "params": None, "inputs": None, "guess": None, "integral": None,
             "final": None, "end": None, "bounds": None, "free": None, "t0": 0.0, "intervals": 3,
             "kind": "linear", "run": RUN}  # fmt: skip
    asked |= dict(zip(("duration", "y0", "controls"), arguments, strict=False)) | options
    problem, x = _with_nodes(*read_problem(model, Question(**asked)), "motion")
    rng = np.random.default_rng(seed)
    return problem, x + 1e-2 * problem.unknowns.size * rng.normal(size=len(x))


def _check(problem, x):
    """Compare gradient and Jacobian with central differences."""
    sides = STEP * np.diag(problem.unknowns.size)
    gradient, jacobian = slopes_of_evaluation(evaluate(problem, x))
    for i, side in enumerate(sides):
        after, before = evaluate(problem, x + side), evaluate(problem, x - side)
        width = 2.0 * side[i]
        slope = (after.cost - before.cost) / width
        assert gradient[i] == pytest.approx(slope, abs=1e-6 * (1.0 + abs(slope)))
        rows = (after.rows - before.rows) / width
        np.testing.assert_allclose(jacobian.toarray()[:, i], rows, rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize("kind", ["linear", "previous"])
def test_inputs_that_stretch_with_the_duration(kind):
    bead = problems.brachistochrone()
    inputs = {"slope": 0.5}
    _check(*_problem(bead.model, bead.arguments, {**BEAD, "kind": kind, "inputs": inputs}))


@pytest.fixture(scope="module")
def spring():
    x, v, push, pull = dynamicsymbols("x v push pull")
    k, t = sm.Symbol("k"), dynamicsymbols._t
    rates = push + pull - k * x**3 + v * sm.cos(2 * t)
    return mechc.compile(
        mechc.from_equations([x], [v], None, [rates]), outputs=("sensitivities", {"gap": x - t**2})
    )


def test_time_in_the_equations_and_an_input_that_is_given(spring):
    given = mechc.Signal(np.linspace(0.0, 5.0, 11), np.sin(np.arange(11.0)), "cubic")
    asked = {
        "integral": "push**2*x + pull*t", "final": "x*v*k", "end": {"x": 1.0}, "t0": 1.0,
        "inputs": {"pull": given}, "free": {"k": (1.0, 3.0), "v": (0.0, 1.0)}, "params": {"k": 2.0},
    }  # fmt: skip
    _check(*_problem(spring, (1.5, {"x": 0.1, "v": 0.2}, {"push": (-3.0, 3.0)}), asked))


def test_outputs_in_time_keep_the_duration(spring):
    asked = {"final": "gap", "params": {"k": 0.0}, "inputs": {"pull": 0.0}}
    with pytest.raises(mechc.MechcError, match="time in gap"):
        _problem(spring, ((1.0, 2.0), [0.0, 0.0], {"push": None}), asked)


def test_a_parameter_without_any_value_is_asked_for(spring):
    asked = {"final": "x", "free": {"k": None}, "inputs": {"pull": 0.0}}
    with pytest.raises(mechc.ValueOutOfBoundsError, match="no value of k to begin with"):
        _problem(spring, (1.0, {"x": 0.0, "v": 0.0}, {"push": None}), asked)


def test_an_impact_moves_the_jump_of_the_running_cost():
    ball = problems.thrown_ball()
    start = {"x": 0.0, "y": 1.0, "v": 4.0, "w": 3.0}
    run = {**RUN, "events": ball.options["events"]}
    problem, x = _problem(ball.model, ((1.0, 2.0), start), {**BALL, "run": run})
    one = evaluate(problem, x)
    assert sum(len(differentiate(one.choice, each).jumps) for each in one.intervals) == 1
    _check(problem, x)


@pytest.mark.slow
def test_closed_loops_with_a_length_that_is_found():
    robot = problems.five_bar()
    duration, y0, torques = robot.arguments
    options = {**FIVE_BAR, "guess": problems.GUESS, "free": {"l": (0.1, 0.3), "u_left": (-1, 1)}}
    problem, x = _problem(robot.model, (duration, y0, torques), {**options, "intervals": 2})
    assert max(each.sol.closure.max() for each in evaluate(problem, x).intervals) < 1e-12
    _check(problem, x)
