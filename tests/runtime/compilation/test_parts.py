"""Parts of a unit, compiled at their first use, are the whole unit to the last bit."""

import subprocess
import sys
import time

import numpy as np
import pytest
from mechc.native._driver import Scene
from mechc.native._motion import Motion, Request
from sympy import Symbol
from sympy.physics.mechanics import dynamicsymbols

import mechc
from mechc.compilation import cache, entries, parts
from mechc.compilation.parts import Pending
from mechc.native._codes import METHODS
from mechc.simulation.settings import Policy
from tests.support import ROOT, scenes
from tests.support.pendulums import pendulum

pytestmark = pytest.mark.compiles

START = np.array([1.0, 0.0])


@pytest.fixture(scope="module")
def damped():
    """A bead on a spring, damped so much that explicit methods need small steps."""
    load = -Symbol("f") * dynamicsymbols("u") - dynamicsymbols("q")
    return mechc.compile(scenes.bead_with(load, default=1e4))


def names_in_cache(key):
    return {folder.name.partition(".")[2] for folder in cache.scenes()[key]}


def motion(scene, model, method):
    """Times, states, methods and dense output of a run that may become stiff."""
    p = model.system.parameter_set.resolve(None)
    policy = Policy(1e-8, None, method, 0.0, np.inf, 100_000, True, "stop", True)
    run = Motion(Request(scene, model.system.sizes, policy, p), 0.0, 2.0, START)
    while run.advance(100) == 0:
        pass
    steps = run.steps
    return *steps.states(), steps.methods(), steps.interpolate(np.linspace(0.0, 2.0, 50))


@pytest.mark.parametrize("method", ["dop853"])  # gauss8 solves what is stiff itself
def test_a_run_goes_over_to_a_method_that_is_loaded_on_the_way(damped, method):
    """Nothing but the wait tells it from one whose methods are all there."""
    whole = Scene(damped.capsule)
    apart = parts.Parts(damped.build["key"], {}).scene(
        entries.load(cache.part_key(damped.build["key"], parts.FIRST))
    )
    found, expected = motion(apart, damped, method), motion(whole, damped, method)
    assert {METHODS[method], METHODS["radau5"]} == {*found[2]}, "it became stiff"
    for one, other in zip(found, expected, strict=True):
        np.testing.assert_array_equal(one, other)


def test_many_states_are_evaluated_in_lanes_once_that_is_compiled(fresh, monkeypatch):
    monkeypatch.setattr(parts, "Pending", Pending)
    model = mechc.compile(pendulum(3.25), outputs=())
    states = np.tile([0.3, 0.1], (20_000, 1))
    one_by_one = [model.rhs(0.0, states) for _ in range(3)]
    assert "outputs" not in names_in_cache(model.build["key"])
    deadline = time.monotonic() + 60.0
    while "outputs" not in model.build["seconds"] and time.monotonic() < deadline:
        model.rhs(0.0, states)
        time.sleep(0.05)
    np.testing.assert_array_equal(one_by_one[0], one_by_one[-1])
    in_lanes = model.rhs(0.0, states)
    np.testing.assert_array_equal(in_lanes, rates_in_lanes(model, states))
    np.testing.assert_allclose(in_lanes, one_by_one[0], rtol=1e-13)


def rates_in_lanes(model, states):
    """Those of the whole unit."""
    values = model.system.parameter_set.resolve(None)[None]
    return Scene(model.capsule).evaluate("rates", np.zeros(1), states, values)


AGAIN = """
import numpy as np
from mechc.compilation import build
from mechc.system.reference import ModelReference
system = build.compiled_before(ModelReference("", custom=True, key="{key}"))
status, state, *_ = system.scene.project(0.0, np.array([0.3, 0.1]), np.ones(2))
print(status, *state)
"""


@pytest.mark.usefixtures("own_parts")
def test_a_process_that_has_only_the_key_compiles_parts_without_deriving(fresh):
    """The first unit in the cache holds the texts."""
    key = mechc.compile(pendulum(3.5), outputs=()).build["key"]
    assert names_in_cache(key) == {"first"}
    done = subprocess.run(
        [sys.executable, "-c", AGAIN.format(key=key)],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        text=True,
        check=True,
    )  # fmt: skip
    assert done.stdout.split() == ["0", "0.3", "0.1"]
    assert names_in_cache(key) == {"first", "driver"}


@pytest.mark.usefixtures("own_parts")
def test_a_run_compiles_what_it_needs_and_nothing_else(fresh):
    model = mechc.compile(pendulum(3.75), outputs=())
    key = model.build["key"]
    model.simulate(0.1, [0.3, 0.1], method="dopri5")
    assert names_in_cache(key) == {"first", "driver", "explicit"}
    starts = [[0.3, 0.1], [0.2, 0.1]]
    model.simulate_batch(0.1, starts, method="gauss8", lockstep=False)
    assert names_in_cache(key) == {"first", "driver", "explicit", "collocation"}
    model.simulate_batch(0.1, starts, method="gauss8")
    assert names_in_cache(key) == {"first", "driver", "explicit", "collocation", "sweeps"}


@pytest.mark.usefixtures("own_parts")
def test_compiling_says_what_it_does(fresh, monkeypatch, capsys):
    """Also where stderr is no terminal, as in a script or a notebook."""
    monkeypatch.setattr("mechc.progress.SILENCE", 0.0)
    model = mechc.compile(pendulum(4.25), outputs=())
    compiled = [line for line in capsys.readouterr().err.splitlines() if line]
    assert "compiling rates and outputs of pendulum ..." in compiled
    model.simulate(0.1, [0.3, 0.1])
    assert "compiling the integrator (driver, taylor) ..." in capsys.readouterr().err
