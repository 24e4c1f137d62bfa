"""Results may be written over what they are computed from, as NumPy's are; runs begin at once."""

import threading
from dataclasses import replace

import numpy as np
import pytest
from mechc.native._driver import PARTS
from mechc_codegen import shipped_mechanism
from mechc_codegen.library.catalogue import SHIPPED
from sympy import Abs, Max, Piecewise, Rational, Symbol, atan2, cos, sin, tanh
from sympy.physics.mechanics import dynamicsymbols

import mechc
from mechc.compilation import build
from tests.support import scenes

pytestmark = pytest.mark.compiles


@pytest.mark.parametrize("count", [1, 3, 8, 17, 40])
def test_every_shift_of_out_against_the_states_gives_the_same(model, regular, count):
    params, start = regular
    width = len(start)
    draw = np.random.default_rng(6)
    states = start + 1e-3 * draw.standard_normal((count, width))
    wanted = model.rhs(0.0, states, params)
    for shift in range(-width * min(count, 12), width * min(count, 12) + 1):
        memory = np.zeros(3 * states.size + 2 * width)
        first = states.size + width
        y = memory[first : first + states.size].reshape(states.shape)
        out = memory[first + shift : first + shift + states.size].reshape(states.shape)
        y[...] = states
        assert model.rhs(0.0, y, params, out) is out
        assert np.array_equal(out, wanted), shift


def test_out_may_be_a_view_of_the_parameters(model, regular):
    _, start = regular
    values = np.array([model.defaults[name] for name in model.parameters])
    wanted = model.rhs(0.0, start[None], values.copy())
    out = values[: len(start)][None]
    assert np.array_equal(model.rhs(0.0, start[None], values, out), wanted)


# -- runs by the unit that is compiled once for all scenes of a kind ------------------------------


@pytest.fixture
def own_cache(tmp_path, monkeypatch):
    """A cache in which no other test has compiled the scene."""
    tmp_path.chmod(0o700)
    monkeypatch.setenv("MECHC_CACHE_DIR", str(tmp_path))
    monkeypatch.setattr(build, "_compiled", {})


METHODS = ("dopri5", "dop853", "gauss8", "radau5", "auto")


def walked_loops():
    return SHIPPED["windows"].build(count=3)


def damped_chain():
    """A chain that is walked and stiff."""
    chain = SHIPPED["planar_chain"].build(links=8)
    first = chain.bodies[0].frame
    torque = -300 * chain.speeds[0].symbol * chain.frame.z
    return replace(chain, loads=(*chain.loads, (first, torque)))


def numbers(model, end=3.0):
    """The bits of runs by each method, of states between steps, of what is measured on the way."""
    start = model.assemble()
    found = {}
    for method in METHODS:
        sol = model.simulate(end, start, method=method, rtol=1e-7)
        between = sol(np.linspace(0.0, sol.t[-1], 23))
        stats = {name: value for name, value in sol.stats.items() if name != "wall_s"}
        found[method] = sol.t.tobytes(), sol.y.tobytes(), between.tobytes(), stats
    return found


@pytest.mark.parametrize(
    "described",
    [
        lambda: scenes.swing(guided=True),
        scenes.bead_over_tables,
        pytest.param(damped_chain, marks=pytest.mark.slow(cases=2)),
        pytest.param(lambda: shipped_mechanism("slider_crank"), marks=pytest.mark.slow),
        pytest.param(lambda: shipped_mechanism("andrews"), marks=pytest.mark.slow),
        pytest.param(lambda: shipped_mechanism("bicycle"), marks=pytest.mark.slow),
        pytest.param(lambda: shipped_mechanism("windows"), marks=pytest.mark.slow),
        pytest.param(walked_loops, marks=pytest.mark.slow),
    ],
)
def test_the_general_unit_gives_the_bits_of_the_scenes_own(own_cache, described):
    model = mechc.compile(described())
    native = model.system.scene.evaluator
    assert native.serves_runs
    end = 0.03 if len(model.coordinates) == 7 else 3.0  # Andrews moves in hundredths
    general = numbers(model, end)
    assert not compiled_since(model)
    model.wait_compiled()
    assert {"driver", "explicit", "implicit"} <= compiled_since(model)
    own = numbers(model, end)
    for method in METHODS:
        assert own[method] == general[method], method


def cornered():
    """A bead with functions of the C library, corners and jumps in its load."""
    q, f = dynamicsymbols("q"), Symbol("f")
    jump = Piecewise((tanh(q), q > f / 9), (atan2(q, f), True))
    return scenes.bead_with(f * Abs(q) ** Rational(3, 2) + jump * Max(q, 0.1) / (2 + cos(q) ** 5))


def by_tape_and_in_lanes(model, native):
    """The outputs of eleven states by a tape, after they were the same when compiled in lanes."""
    assert native.serves_runs
    states = np.random.default_rng(4).uniform(-1.0, 1.0, (11, native.width))
    p, t = np.array([[model.defaults[name] for name in model.parameters]]), np.zeros(1)
    by_tape = {name: native.evaluate(name, t, states, p) for name in native.outputs}
    native.need(PARTS["outputs"])
    for name, found in by_tape.items():
        assert native.evaluate(name, t, states, p).tobytes() == found.tobytes(), name
    return by_tape


@pytest.mark.parametrize(
    "described", [lambda: scenes.swing(guided=True), cornered, scenes.bead_over_tables]
)
def test_outputs_by_a_tape_have_the_bits_of_those_compiled_in_lanes(own_cache, described):
    model = mechc.compile(described())
    by_tape_and_in_lanes(model, model.system.scene.evaluator)


@pytest.mark.slow(cases=99)
@pytest.mark.parametrize(
    ("described", "angle", "speed"),
    [
        (lambda: scenes.swing(guided=True), "phi", "w"),
        (lambda: shipped_mechanism("heavy_top"), "theta", "w_z"),
        (lambda: shipped_mechanism("slider_crank"), "phi", "v"),
    ],
)
def test_jacobians_by_a_tape_have_the_bits_of_those_compiled_in_lanes(
    own_cache, described, angle, speed
):
    own = dynamicsymbols(speed).diff() * sin(dynamicsymbols(angle))
    model = mechc.compile(described(), outputs={"own": own})
    native = model.system.including("state_jacobian", "parameter_jacobian").scene.evaluator
    found = by_tape_and_in_lanes(model, native)
    for name in ("state_jacobian", "own_state_jacobian", "own_parameter_jacobian"):
        assert np.any(found[name]), name


def derivatives(model, end, start):
    """The bits of derivatives of runs by each method, forwards, and of integrals, backwards."""
    names, found = list(model.parameters)[:3], {}
    for method in METHODS:
        sol = model.simulate(end, start, method=method, rtol=1e-7, sensitivities=[*names, "y0"])
        by_name = sol.sensitivity
        gradient = sol.gradient(model.coordinates[0], {model.speeds[0]: 1.0}, names)
        found[method] = (
            [np.asarray(by_name[name]).tobytes() for name in names],
            [np.asarray(gradient[name]).tobytes() for name in names],
        )
    return found


@pytest.mark.parametrize(
    "described",
    [
        cornered,
        pytest.param(scenes.bead_over_tables, marks=pytest.mark.slow(cases=3)),
        pytest.param(lambda: shipped_mechanism("slider_crank"), marks=pytest.mark.slow(cases=3)),
        pytest.param(lambda: shipped_mechanism("heavy_top"), marks=pytest.mark.slow(cases=3)),
        pytest.param(lambda: shipped_mechanism("bicycle"), marks=pytest.mark.slow(cases=3)),
        pytest.param(lambda: shipped_mechanism("windows"), marks=pytest.mark.slow(cases=3)),
    ],
)
def test_derivatives_by_tapes_have_the_bits_of_those_by_parts_of_the_scenes_own(
    own_cache, described
):
    model = mechc.compile(described(), outputs=("sensitivities",))
    native, start = model.system.scene.evaluator, model.assemble()
    assert native.serves_runs
    start = start if np.any(start) else start + 0.3
    general = derivatives(model, 1.0, start)
    assert not compiled_since(model)
    native.need(PARTS["derivatives"])  # beside runs by tapes
    assert derivatives(model, 1.0, start) == general
    model.wait_compiled()
    assert "derivatives" in compiled_since(model)
    assert derivatives(model, 1.0, start) == general


def of_batches(model, end):
    """The bits of batches by each method, in lanes and one by one, with reductions."""
    start = model.assemble()
    speed = model.speeds[0]
    starts = np.tile(start, (11, 1))
    found = {}
    for method in METHODS:
        for lockstep in (None, False):
            batch = model.simulate_batch(
                end, starts, method=method, rtol=1e-7, lockstep=lockstep, threads=2,
                reduce=[f"max({speed})", f"mean({speed})"],
            )  # fmt: skip
            arrays = {name: values.tobytes() for name, values in batch.arrays.items()}
            if batch.method == "taylor in lockstep":  # alone until it is compiled: other work
                del arrays["rhs_evaluations"], arrays["closure_iterations"]
            found[method, lockstep] = arrays
    return found


@pytest.mark.parametrize(
    "described",
    [
        scenes.bead_over_tables,
        pytest.param(walked_loops, marks=pytest.mark.slow),
        pytest.param(lambda: scenes.swing(guided=True), marks=pytest.mark.slow),
        pytest.param(lambda: shipped_mechanism("heavy_top"), marks=pytest.mark.slow),
        pytest.param(lambda: shipped_mechanism("slider_crank"), marks=pytest.mark.slow),
        pytest.param(lambda: shipped_mechanism("andrews"), marks=pytest.mark.slow),
        pytest.param(lambda: shipped_mechanism("windows"), marks=pytest.mark.slow),
    ],
)
def test_batches_go_over_from_tapes_to_parts_of_the_scenes_own(own_cache, described):
    model = mechc.compile(described())
    members = model.system.scene.of_members
    assert members.goes_over
    end = 0.03 if len(model.coordinates) == 7 else 1.0
    general = of_batches(model, end)
    assert members.goes_over
    model.wait_compiled()
    model.simulate_batch(end, model.assemble()[None])
    assert not members.goes_over
    assert of_batches(model, end) == general


@pytest.mark.parametrize(
    "described",
    [lambda: scenes.swing(guided=True), pytest.param(walked_loops, marks=pytest.mark.slow)],
)
def test_a_thread_with_a_small_stack_runs_by_the_general_unit(described):
    """Arrays of that unit are as large as its bounds; work then has a stack of its own."""
    model = mechc.compile(described(), outputs=("points",))
    assert model.system.scene.evaluator.serves_runs
    wanted, found = numbers(model), {}
    before = threading.stack_size(96 * 1024)
    try:
        thread = threading.Thread(target=lambda: found.update(numbers(model)))
        thread.start()
        thread.join()
    finally:
        threading.stack_size(before)
    assert found == wanted


def compiled_since(model):
    """The parts of the scene's own that were compiled here."""
    own = {"driver", "collocation", "explicit", "implicit", "derivatives"}
    return set(model.build["seconds"]) & own
