"""Differences: what fails, and by how much a motion may grow."""

import numpy as np
import pytest

from benchmarks.drawn.case import judge_scene
from benchmarks.drawn.doors import DOORS
from benchmarks.drawn.judge import Difference, Run, allowed, apart
from benchmarks.drawn.scene import Numbers, Scene

OSCILLATOR = Scene(
    "equations by hand",
    """\
x, v = dynamicsymbols("x v")
k = sm.Symbol("k")
q, u = [x], [v]
M, F, rates = [[1]], [-k * x], u
described = mechc.from_equations(q, u, M, F)
""",
    "",
    {"k": (1.0, 2.0)},
    {"x": (-1.0, 1.0), "v": (-1.0, 1.0)},
)


def test_a_difference_beyond_what_is_allowed_fails():
    assert not Difference("rhs", 1.0, 1.0).fails
    assert Difference("rhs", 1.1, 1.0).fails
    assert Difference("rhs", float("nan"), 1.0).fails
    assert apart(np.full((2, 1), np.nan), np.zeros((2, 1))) == np.inf
    assert apart(np.array([[10.1]]), np.array([[10.0]])) == pytest.approx(0.01)


def test_what_is_allowed_grows_with_the_motion():
    run = Run(Numbers({}, {}, 1.0), np.zeros(2))
    once = allowed(run, 1e-9)
    run.growth = 20.0
    assert allowed(run, 1e-9) == 20 * once


def test_a_right_scene_passes_every_door():
    found = judge_scene(OSCILLATOR, (0, 0), 10, list(DOORS))
    assert not found.faults
    assert found.scenes == 10
    doors = {door.split(":")[0] for door in found.compared}
    assert doors >= {"rhs", "SciPy", "auto", "batch auto", "stepper", "sensitivities", "gradient"}
    assert doors >= {"linearize", "saved and opened", "exported C", "mass matrix and forcing"}


BALL = Scene(
    "equations by hand",
    """\
z, v = dynamicsymbols("z v")
g = sm.Symbol("g")
q, u = [z], [v]
M, F, rates = [[1]], [-g], u
described = mechc.from_equations(q, u, M, F)
stop = (z, 0.5)
events = [mechc.Stop(z, 0.5)]
""",
    "",
    {"g": (9.0, 10.0)},
    {"z": (0.05, 0.1), "v": (-0.1, 0.1)},
)


def test_what_comes_to_rest_on_a_stop_passes():
    """There a disturbance may be an overlap, and the reference bounces without end."""
    found = judge_scene(BALL, (0, 0), 6, ["SciPy", "auto", "dop853"])
    assert not found.faults
    assert {"SciPy", "dop853"} <= {*found.compared}


def test_other_equations_fail():
    """SymPy's side has a spring that is a thousandth stiffer."""
    text = OSCILLATOR.text.replace("described =", "described, F =").replace(
        "M, F)", "M, F), [-1.001 * k * x]"
    )
    other = Scene("equations by hand", text, "", OSCILLATOR.ranges, OSCILLATOR.starts)
    found = judge_scene(other, (0, 0), 3, ["rhs", "SciPy"])
    assert {fault.split(" (")[0] for fault in found.faults} >= {"rhs", "SciPy"}
