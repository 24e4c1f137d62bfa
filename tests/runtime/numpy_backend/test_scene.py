"""Models without compiled code: the same outputs, and runs that are right or say they are not."""

import json
import pickle
from functools import cache

import numpy as np
import pytest
import sympy
from mechc_codegen.library.chains.pendulum import pendulum
from mechc_codegen.library.chains.rods import closed_chain, planar_chain, spatial_chain
from mechc_codegen.library.chains.windows import windows
from mechc_codegen.library.planar.andrews import andrews
from mechc_codegen.library.planar.car_axis import car_axis
from mechc_codegen.library.planar.redundant import spatial, two_rockers
from mechc_codegen.library.planar.slider_crank import slider_crank
from mechc_codegen.library.spatial.flyball_governor import flyball_governor
from mechc_codegen.library.spatial.heavy_top import heavy_top
from mechc_codegen.library.spatial.rigid_body import rigid_body
from sympy.physics.mechanics import dynamicsymbols

import mechc
from mechc.compilation import build, toolchain
from mechc.errors import CompilerError, MechcError, UnknownNameError, ValueOutOfBoundsError
from tests.support import DATA, scenes
from tests.support.marks import slow_among

SCENES = {
    "andrews": andrews,
    "car_axis": car_axis,
    "flyball_governor": flyball_governor,
    "heavy_top": heavy_top,
    "pendulum_5": lambda: pendulum(5),
    "planar_chain": lambda: planar_chain(8),  # trees of links
    "spatial_chain": lambda: spatial_chain(8),
    "closed_chain": lambda: closed_chain(8, spatial=True),
    "rigid_body": rigid_body,
    "slider_crank": slider_crank,
    "spatial": spatial,
    "two_rockers": two_rockers,
    "swing": lambda: scenes.swing(guided=True),  # one row on the motion alone, that moves with time
    "windows_2": lambda: windows(2),
    "windows_4": lambda: windows(4),
}
LARGE = ("andrews", "closed_chain", "spatial_chain", "windows_2", "windows_4")
STATES = 25
REGULAR = {"l_3": 3.5}


@cache
def without_c(scene):
    return mechc.compile(SCENES[scene](), backend="numpy")


@cache
def four_bar():
    return mechc.load("four_bar", backend="numpy")


def states(model, count, seed=1):
    rng = np.random.default_rng(seed)
    y = rng.normal(size=(count, len(model.coordinates) + len(model.speeds)))
    return rng.uniform(0, 3, count), y


def conditioning(compiled, y, t):
    """Of the constraint rows that are not redundant (n,), 1 where there are none."""
    rows = compiled.constraint_jacobian(y, None, t)
    if not rows.shape[1]:
        return np.ones(len(y))
    singular = np.linalg.svd(rows, compute_uv=False)
    kept = np.where(singular > 1e-9 * singular[:, :1], singular, np.inf)
    return singular[:, 0] / kept.min(axis=1)


def assert_same_outputs(model, compiled, bound=1e-12):
    """Every output at random states: each state's largest error against its largest value.

    What is solved for may be off by as much more as the rows are badly conditioned.
    """
    t, y = states(model, STATES)
    assert model.system.scene.outputs == compiled.system.scene.outputs
    for name in compiled.system.scene.outputs:
        found, wanted = (m.output(name, y, None, t).reshape(len(y), -1) for m in (model, compiled))
        assert np.isfinite(wanted).all(), name
        solved = name == "rates" or "multipliers" in name or "jacobian" in name
        allowed = bound * (conditioning(compiled, y, t) if solved else 1.0)
        size = np.abs(wanted).max(axis=1, initial=0.0)
        error = np.abs(found - wanted).max(axis=1, initial=0.0)
        assert (error <= allowed * size).all(), (name, (error / allowed / size).max())


# -- outputs ----------------------------------------------------------------------------------


@pytest.mark.parametrize("scene", slow_among(SCENES, LARGE))
def test_every_output_is_the_compiled_one_to_rounding(scene):
    assert_same_outputs(without_c(scene), mechc.compile(SCENES[scene]()))


def test_one_state_gives_what_many_give():
    """One is computed with floats, many with arrays."""
    model = four_bar()
    t, y = states(model, 7)
    for name in model.system.scene.outputs:
        many = model.output(name, y, None, t)
        for k in range(7):
            one = model.output(name, y[k], None, t[k])
            np.testing.assert_allclose(one, many[k], rtol=1e-13, atol=1e-13)


def test_more_states_than_fit_a_block_and_parameters_of_each():
    model, compiled = four_bar(), mechc.load("four_bar")
    t, y = states(model, 2500)
    params = {"l_0": np.linspace(0.5, 2.0, 2500), "g": 9.0}
    for name in ("rates", "points", "multipliers"):
        wanted = compiled.output(name, y, params, t)
        found = model.output(name, y, params, t)
        np.testing.assert_allclose(found, wanted, rtol=1e-9, atol=1e-11)


def test_dependent_rows_get_the_multipliers_of_least_norm():
    """On closed configurations, where rows of both scenes are redundant."""
    for scene in ("spatial", "two_rockers"):
        model, compiled = without_c(scene), mechc.compile(SCENES[scene]())
        y = model.assemble({"theta_0": 1.0}, speeds={"omega_0": 1.5})
        np.testing.assert_allclose(model.rhs(0.0, y), compiled.rhs(0.0, y), rtol=1e-11, atol=1e-11)
        wanted = compiled.multipliers(y)
        np.testing.assert_allclose(model.multipliers(y), wanted, atol=1e-11 * np.abs(wanted).max())


def test_a_state_that_is_not_finite_is_nan_there_alone():
    model = four_bar()
    _, y = states(model, 4)
    y[2, 1] = np.inf
    rates = model.rhs(0.0, y)
    assert np.isnan(rates[2, 3:]).all()
    assert np.isfinite(rates[[0, 1, 3]]).all()
    assert np.isnan(model.rhs(0.0, y[2])[3:]).all()


def test_every_function_that_c_has_is_there_for_floats_and_for_arrays():
    """Powers, long sums and functions; outside their domain NaN, and no error."""
    q, u = dynamicsymbols("q u")
    of_one = {f.__name__: f for f in (
        sympy.sin, sympy.cos, sympy.tan, sympy.asin, sympy.acos, sympy.atan, sympy.sinh,
        sympy.cosh, sympy.tanh, sympy.exp, sympy.log, sympy.Abs, sympy.sqrt,
    )}  # fmt: skip
    asked = {name: f(q) for name, f in of_one.items()}
    asked |= {"atan2": sympy.atan2(q, u), "cube": (q + u) ** 3, "over": 1 / (q + u) ** 2}
    asked |= {"root": (2 + q) ** sympy.Rational(1, 3), "inverse root": 1 / sympy.sqrt(2 + q)}
    asked |= {"long": sum(sympy.cos(k * q) * u**k / k for k in range(1, 120))}
    model = mechc.compile(scenes.bead_with(q), outputs=(asked,), backend="numpy")
    y = np.array([[0.4, 0.7], [-0.3, 0.2], [0.9, -0.5]])
    for name, expression in asked.items():
        exact = [expression.subs({q: a, u: b}).evalf(30) for a, b in y.tolist()]
        wanted = [float(x) if x.is_real else np.nan for x in exact]
        np.testing.assert_allclose(model.output(name, y), wanted, rtol=1e-13, err_msg=name)
        one_by_one = [model.output(name, state) for state in y]
        np.testing.assert_allclose(one_by_one, wanted, rtol=1e-13, err_msg=name)


def test_jacobians_and_outputs_that_hold_the_motion():
    """Of a scene whose kinematics are no identity, and of a loop."""
    lift = {"pull": 3 * mechc.multiplier(0) ** 2, "speeding": dynamicsymbols("omega_1").diff()}
    for mechanism, own in ((rigid_body, {}), (two_rockers, lift)):
        names = ("state_jacobian", "parameter_jacobian", "points", "accelerations")
        compiled = mechc.compile(mechanism(), outputs=(*names, own))
        model = mechc.compile(mechanism(), outputs=(*names, own), backend="numpy")
        assert_same_outputs(model, compiled, bound=1e-11)


# -- what needs more than outputs ---------------------------------------------------------------


@pytest.mark.slow
def test_assembly_limits_and_equilibria_are_those_of_the_compiled_model():
    model, compiled = four_bar(), mechc.load("four_bar")
    y = model.assemble({"theta_0": 1.0}, speeds={"omega_0": 2.0}, params=REGULAR)
    wanted = compiled.assemble({"theta_0": 1.0}, speeds={"omega_0": 2.0}, params=REGULAR)
    np.testing.assert_allclose(y, wanted, rtol=0, atol=1e-13)
    np.testing.assert_allclose(
        model.limits("theta_0", REGULAR), compiled.limits("theta_0", REGULAR), atol=1e-12
    )
    found, known = model.equilibria(REGULAR), compiled.equilibria(REGULAR)
    assert [e.stable for e in found] == [e.stable for e in known]
    for one, other in zip(found, known, strict=True):
        np.testing.assert_allclose(one.y, other.y, atol=1e-9)
    assert "redundant constraints: none" in model.report()


def test_batches_and_capsules_say_what_is_missing():
    model = four_bar()
    y0 = model.assemble({"theta_0": 1.0}, params=REGULAR)
    with pytest.raises(MechcError, match="has no compiled code"):
        model.simulate_batch(1.0, np.stack([y0, y0]), REGULAR)
    with pytest.raises(MechcError, match="has no compiled code"):
        _ = model.capsule
    with pytest.raises(ValueOutOfBoundsError, match="'dop853' only"):
        model.simulate(1.0, y0, REGULAR, method="gauss8")
    with pytest.raises(UnknownNameError, match="backend"):
        mechc.load("four_bar", backend="numba")
    assert (model.backend, model.instruction_set) == ("numpy", "numpy")
    assert pickle.loads(pickle.dumps(model)).backend == "numpy"


def test_no_compiler_is_run_or_needed_and_the_error_offers_this(monkeypatch):
    monkeypatch.setattr(toolchain, "find_compiler", lambda: None)
    monkeypatch.setattr(build, "_compiled", {})
    with pytest.raises(CompilerError, match="backend='numpy'"):
        mechc.compile(pendulum(3))
    model = mechc.compile(pendulum(3), backend="numpy")
    assert model.simulate(0.1, np.zeros(6)).status.ok


# -- runs -------------------------------------------------------------------------------------


@pytest.mark.slow
def test_the_regular_four_bar_follows_its_exact_motion():
    data = json.loads((DATA / "four_bar_regular.json").read_text("utf-8"))["states"]
    times = [t for t in sorted(map(float, data)) if t <= 4]
    model = four_bar()
    y0 = model.assemble({"theta_0": np.radians(85)}, params=REGULAR)
    sol = model.simulate(max(times), y0, REGULAR, rtol=1e-10, t_eval=times)
    assert sol.status.ok
    known = {float(t): list(map(float, y)) for t, y in data.items()}
    np.testing.assert_allclose(sol.y, [known[t] for t in times], rtol=0, atol=2e-8)
    grid = np.linspace(0, max(times), 501)
    assert np.abs(model.constraints(sol(grid), REGULAR)).max() < 1e-13
    assert np.abs(model.velocity_constraints(sol(grid), REGULAR)).max() < 2e-13
    assert sol.energy_drift < 1e-9
    back = model.simulate((max(times), 0.0), sol.y[-1], REGULAR, rtol=1e-10)
    np.testing.assert_allclose(back.y[-1], y0, atol=2e-8)


def test_a_pendulum_is_back_after_one_period():
    """Let go level: K(1/2) quarter periods of the elliptic integral."""
    model = mechc.compile(pendulum(1), backend="numpy")
    period = 4 * 1.854074677301371918434 / np.sqrt(9.81)
    y0 = np.zeros(len(model.coordinates) + len(model.speeds))
    sol = model.simulate(period, y0, rtol=1e-11)
    assert sol.status.ok
    np.testing.assert_allclose(sol.y[-1], y0, atol=1e-9)


@pytest.mark.parametrize("scene", ["rigid_body", pytest.param("swing", marks=pytest.mark.slow)])
def test_runs_of_other_kinds_are_those_of_the_compiled_pair(scene):
    """Quaternions whose rates are no speeds; a constraint on the motion that moves with time."""
    model, compiled = without_c(scene), mechc.compile(SCENES[scene]())
    y0 = np.zeros(len(model.coordinates) + len(model.speeds))
    for name, value in model.start.items():
        y0[model.state_index(name)] = value
    runs = [m.simulate(0.5, y0, rtol=1e-10, method="dop853") for m in (model, compiled)]
    assert all(run.status.ok for run in runs)
    np.testing.assert_allclose(runs[0].y[-1], runs[1].y[-1], rtol=1e-7, atol=1e-7)
    assert runs[0].velocity_closure.max() < 1e-12


def test_redundant_rows_are_not_taken_for_a_change_point():
    """The four-bar with its rocker doubled moves as the four-bar."""
    model, plain = without_c("two_rockers"), mechc.load("four_bar")
    params = {"l_3": 3.5}
    y0 = model.assemble({"theta_0": 1.2}, speeds={"omega_0": 0.0}, params=params)
    sol = model.simulate(0.5, y0, params, rtol=1e-10)
    assert sol.status.ok, str(sol.status)
    wanted = plain.simulate(0.5, [*y0[:3], 0.0, 0.0, 0.0], params, rtol=1e-11)
    np.testing.assert_allclose(sol.q[-1, :3], wanted.q[-1], atol=1e-7)


def test_events_end_a_run_and_it_is_continued():
    model = four_bar()
    y0 = model.assemble({"theta_0": 1.0}, params=REGULAR)
    event = mechc.Event(lambda t, y: y[0] - 0.5, terminal=True)
    sol = model.simulate(5.0, y0, REGULAR, events=[event])
    wanted = mechc.load("four_bar").simulate(5.0, y0, REGULAR, events=[event])
    assert sol.status.code == "stopped by an event"
    assert sol.events[0].t[0] == pytest.approx(wanted.events[0].t[0], abs=1e-8)
    further = sol.continue_to(sol.t[-1] + 0.1)
    whole = model.simulate(sol.t[-1] + 0.1, y0, REGULAR)
    np.testing.assert_allclose(further.y[-1], whole.y[-1], atol=1e-7)


# -- change points ------------------------------------------------------------------------------


@pytest.mark.parametrize("rtol", [1e-5, 1e-9])
def test_a_run_ends_before_a_change_point_and_says_why(rtol):
    model, compiled = four_bar(), mechc.load("four_bar")
    y0 = model.assemble({"theta_0": np.radians(85)})
    passage = compiled.simulate(2.0, y0, rtol=1e-10).change_points[0].t
    sol = model.simulate(2.0, y0, rtol=rtol)
    assert sol.status.code == "undecided"
    assert "Install a C compiler" in str(sol.status)
    assert 0.9 * passage < sol.t[-1] < passage
    wanted = compiled.simulate(sol.t[-1], y0, rtol=1e-11).y[-1]
    np.testing.assert_allclose(sol.y[-1], wanted, atol=max(1e-6, 1e3 * rtol))


@pytest.mark.parametrize("off", [0.3, 1e-3, 1e-6, 1e-10])
@pytest.mark.parametrize("side", [1, -1])
def test_near_misses_are_right_or_undecided_and_never_wrong(off, side):
    model, compiled = four_bar(), mechc.load("four_bar")
    params = {"l_3": 4 + side * off}
    y0 = model.assemble({"theta_0": np.radians(85)}, params=params)
    sol = model.simulate(1.5, y0, params, rtol=1e-8)
    assert sol.status.code in ("finished", "undecided")
    assert sol.status.ok or off < 0.1
    wanted = compiled.simulate(1.5, y0, params, rtol=1e-11)
    np.testing.assert_allclose(sol.y[-1], wanted(sol.t[-1]), atol=1e-4)


def test_a_start_at_a_change_point_leads_on_along_its_branch():
    model, compiled = four_bar(), mechc.load("four_bar")
    starts = [m.assemblies({"theta_0": np.pi}, speeds={"omega_0": 3.0}) for m in (model, compiled)]
    np.testing.assert_allclose(starts[0], starts[1], atol=1e-9)
    runs = [m.simulate(0.1, starts[1][0], rtol=1e-10) for m in (model, compiled)]
    assert runs[0].status.ok
    np.testing.assert_allclose(runs[0].y[-1], runs[1].y[-1], atol=1e-7)
