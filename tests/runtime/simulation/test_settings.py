"""Settings of a run: times to report at, tolerances, and what ``method="auto"`` takes."""

import copy
import math
import pickle

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from sympy import Matrix

import mechc
from mechc.errors import UnknownNameError, ValueOutOfBoundsError
from mechc.native._codes import METHODS
from mechc.simulation.settings import checked_times
from tests.support import scenes

SPAN = (-0.25, 3.0)
SLACK = 8 * math.ulp(3.0)
ENDS = [end + k * math.ulp(3.0) for end in SPAN for k in (-9, -8, -1, 0, 1, 8, 9)]
TIMES = st.lists(st.one_of(st.sampled_from(ENDS), st.floats(-0.3, 3.1)), max_size=5)


def by_numpy(times, span):
    """The times with their ends put right; None where they are refused."""
    low, high = sorted(span)
    times = np.where(np.abs(times - low) <= SLACK, low, times)
    times = np.where(np.abs(times - high) <= SLACK, high, times)
    forwards = np.diff(times) * (1 if span[1] >= span[0] else -1) > 0
    return times if ((times >= low) & (times <= high)).all() and forwards.all() else None


@given(TIMES, st.sampled_from([SPAN, SPAN[::-1]]), st.sampled_from([None, 1, -1]))
def test_times_are_read_as_numpy_reads_them(times, span, order):
    given = np.array(times if order is None else sorted(times)[::order])
    wanted = by_numpy(given, span)
    if wanted is None:
        with pytest.raises(ValueOutOfBoundsError):
            checked_times(given, span)
    else:
        assert np.array_equal(checked_times(given, span), wanted)


@pytest.mark.parametrize("wrong", [2**20 - 1, 2**20, 2**20 + 1, 2**21 + 5])
def test_a_wrong_time_is_found_in_any_block(wrong):
    times = np.linspace(0, 1, 2**21 + 7)
    assert np.array_equal(checked_times(times, (0, 1)), times)
    times[wrong] = times[wrong - 1]
    with pytest.raises(ValueOutOfBoundsError, match="strictly"):
        checked_times(times, (0, 1))
    times[wrong] = math.nan
    with pytest.raises(ValueOutOfBoundsError, match="within"):
        checked_times(times, (0, 1))


@pytest.mark.parametrize("span", [SPAN, SPAN[::-1], (1.0, 1.0), (0.0, 0.0)])
def test_the_ends_are_within_the_span_in_its_direction(span):
    times = list(dict.fromkeys(span))
    assert checked_times(times, span).tolist() == times


def test_an_end_that_is_off_by_rounding_becomes_the_end():
    times = checked_times([-0.25 - 3e-17, 1.0, 3.0 + 4e-16], SPAN)
    assert times.tolist() == [-0.25, 1.0, 3.0]


@pytest.mark.parametrize("times", [[math.nan], [0.0, math.nan, 1.0], [-0.3], [3.1], [[1.0]], 1.0])
def test_times_beyond_the_span_are_refused(times):
    with pytest.raises(ValueOutOfBoundsError, match="within the span"):
        checked_times(times, SPAN)


@pytest.mark.parametrize("times", [[1.0, 1.0], [2.0, 1.0], [3.0 - SLACK / 2, 3.0]])
def test_times_that_do_not_advance_are_refused(times):
    with pytest.raises(ValueOutOfBoundsError, match="strictly"):
        checked_times(times, SPAN)


@pytest.mark.parametrize(
    ("scipys", "ours"), [("RK45", "dopri5"), ("DOP853", "dop853"), ("Radau", "radau5")]
)
def test_methods_have_scipys_names_too(model, regular, scipys, ours):
    params, start = regular
    runs = [model.simulate(0.5, start, params, method=method) for method in (scipys, ours)]
    assert np.array_equal(runs[0].y, runs[1].y)
    assert runs[0].policy == runs[1].policy


def test_a_method_that_is_only_scipys_is_refused(model, regular):
    with pytest.raises(UnknownNameError, match=r"no method is called 'LSODA'; known are auto, "):
        model.simulate(0.5, regular[1], regular[0], method="LSODA")


def test_a_start_may_be_a_column_and_nothing_else(model, regular):
    params, start = regular
    sol = model.simulate(0.5, Matrix(start.tolist()), params)
    assert np.array_equal(sol.y, model.simulate(0.5, start, params).y)
    with pytest.raises(ValueError, match=r"y0 must have the shape \(6,\)"):
        model.simulate(0.5, start.reshape(2, 3), params)


def test_a_wrong_number_of_tolerances_is_named(model, regular):
    with pytest.raises(ValueOutOfBoundsError, match="each of the 6 components of a state"):
        model.simulate(0.5, regular[1], regular[0], atol=[1e-9, 1e-9])


@pytest.mark.slow
def test_auto_takes_few_steps_however_stiff_a_motion_is():
    """A bead that stiff springs and dampers draw along sin(t): collocation by Newton's iteration
    serves where stability limits both the plain iteration and explicit methods."""
    model = mechc.compile(scenes.drawn_bead(), outputs=())
    start = {"q": 0.5, "u": 0.0}

    def steps(stiffness, rtol, method="auto"):
        run = model.simulate(20.0, start, {"f": stiffness}, rtol=rtol, method=method)
        assert run.status.ok
        return run.stats["steps"], run.y[-1]

    for stiffness, rtol, most in (
        (30.0, 1e-8, 200), (30.0, 1e-10, 200), (100.0, 1e-10, 600), (100.0, 1e-4, 200),
        (1e3, 1e-6, 500), (1e4, 1e-8, 1500), (1e6, 1e-10, 1500),
    ):  # fmt: skip
        count, end = steps(stiffness, rtol)
        assert count < most
        assert steps(stiffness, rtol, "gauss8")[0] < most
        np.testing.assert_allclose(end, steps(stiffness, 1e-10, "radau5")[1], atol=10 * rtol)


@pytest.mark.parametrize("rtol", [1e-17, 2e-16, 1e-300])
def test_an_rtol_that_no_double_holds_is_refused(model, regular, rtol):
    params, start = regular
    with pytest.raises(ValueOutOfBoundsError, match=r"less than the spacing of doubles, 2\.2e-16"):
        model.simulate(1.0, start, params, rtol=rtol)
    assert model.simulate(1e-3, start, params, rtol=3e-16).status.t


# -- what auto takes for a run by itself -----------------------------------------------------------

TOP = [0.0, 0.6, 0.0, 1.0, 50.0, -2.0]
NAMES = {number: name for name, number in METHODS.items()}


@pytest.fixture(scope="module")
def pendulum():
    return mechc.load("pendulum", outputs=("energy", "sensitivities"))


def taken(sol):
    """The methods of its steps."""
    return {NAMES[number] for number in sol.record.last.steps.methods()}


@pytest.mark.parametrize(
    ("name", "start", "method"),
    [("pendulum", [1.0, 0.0], "taylor"), ("heavy_top", TOP, "taylor"),
     ("planar_chain", None, "gauss8"), ("four_bar", None, "gauss8")],
)  # fmt: skip
def test_series_are_taken_where_no_order_waits_for_linear_equations(name, start, method):
    model = mechc.load(name)
    sol = model.simulate(0.5, model.assemble() if start is None else start, rtol=1e-9)
    assert sol.method == method
    assert taken(sol) == {method}
    other = model.simulate(0.5, sol.y[0], rtol=1e-12, method="dop853")
    np.testing.assert_allclose(sol.y[-1], other.y[-1], rtol=0, atol=1e-7)
    again = model.simulate(0.5, sol.y[0], rtol=1e-9, method=sol.method)
    assert np.array_equal(again.y, sol.y)


def test_long_runs_are_left_to_collocation_before_the_first_step(pendulum):
    """It is symmetric: the phase of a series drifts with the square of the time."""
    sol = pendulum.simulate(200.0, [1.0, 0.0], rtol=1e-9)
    assert taken(sol) == {"gauss8"}
    assert sol.method == "gauss8"
    assert taken(pendulum.simulate(200.0, [1.0, 0.0], rtol=1e-9, method="taylor")) == {"taylor"}
    exact = pendulum.simulate(200.0, [1.0, 0.0], rtol=1e-13, method="gauss8")
    np.testing.assert_allclose(sol.y[-1], exact.y[-1], rtol=0, atol=1e-9)


@pytest.mark.parametrize("duration", [2.0, 50.0])
def test_members_alone_are_left_to_collocation_too(pendulum, duration):
    starts = np.array([[0.5 + 0.1 * k, 0.0] for k in range(5)])
    batch = pendulum.simulate_batch(duration, starts, lockstep=False, progress=False)
    for k, start in enumerate(starts):
        assert np.array_equal(batch.y[k], pendulum.simulate(duration, start).y[-1])


def test_derivatives_and_steppers_have_collocation(pendulum):
    assert pendulum.simulate(1.0, [1.0, 0.0], sensitivities=["l_0"]).method == "gauss8"
    assert pendulum.simulate(1.0, [1.0, 0.0], checkpoints=1e6).method == "gauss8"
    assert pendulum.stepper([1.0, 0.0])._policy.method == "gauss8"
    batch = pendulum.simulate_batch(1.0, [[1.0, 0.0]], sensitivities=["l_0"], progress=False)
    assert batch.method == "gauss8"


@pytest.mark.parametrize("more", [{}, {"sensitivities": ["l_0"]}])
def test_a_solution_is_read_by_the_method_that_it_began_with(pendulum, tmp_path, more):
    sol = pendulum.simulate(2.0, [1.0, 0.0], **more)
    sol.save(tmp_path / "run.nc")
    for again in (mechc.open(tmp_path / "run.nc"), pickle.loads(pickle.dumps(sol)), copy.copy(sol)):
        assert again.method == sol.method
        assert np.array_equal(again.y, sol.y)
        assert np.array_equal(again(np.linspace(0, 2, 7)), sol(np.linspace(0, 2, 7)))


def test_stiff_runs_go_over_from_series(pendulum):
    from sympy import Symbol
    from sympy.physics.mechanics import dynamicsymbols

    from benchmarks.problems.particle import particle

    q, u = dynamicsymbols("q u")
    k, c = Symbol("k"), Symbol("c")
    damped = mechc.compile(
        particle([q], [u], [-k * q - c * u]), defaults={k: 1.0, c: 1e3, "m": 1.0}, outputs=()
    )
    sol = damped.simulate(0.15, [1.0, 0.0], rtol=1e-8)
    fast = np.roots([1.0, 1e3, 1.0])[0]
    slow = 1.0 / fast  # of the product 1, without the cancellation
    exact = (np.exp(slow * 0.15) * -fast + np.exp(fast * 0.15) * slow) / (slow - fast)
    assert sol.method == "taylor"
    assert sol.stats["steps"] < 100
    assert sol.y[-1, 0] == pytest.approx(exact, abs=1e-9)


def test_loose_runs_with_other_speeds_than_derivatives_take_the_steps_of_a_member():
    """Collocation, whose iteration contracts slowly there, has no use for such tolerances."""
    from sympy.physics.mechanics import KanesMethod, Particle, Point, ReferenceFrame, dynamicsymbols

    x, y, u, v, force = dynamicsymbols("x y u v F")
    frame, centre, origin = ReferenceFrame("N"), Point("P"), Point("O")
    origin.set_vel(frame, 0)
    centre.set_pos(origin, x * frame.x + y * frame.y)
    centre.set_vel(frame, 2 * u * frame.x + 2 * v * frame.y)
    kane = KanesMethod(
        frame, [x, y], [u], [x.diff() - 2 * u, y.diff() - 2 * v],
        u_dependent=[v], velocity_constraints=[u - v],
    )  # fmt: skip
    load = (force - x) * frame.x + (force - y) * frame.y
    kane.kanes_equations([Particle("m", centre, 1)], [(centre, load)])
    open_model = mechc.compile(kane, inputs=[force], configuration_constraints=[])
    model = open_model.with_inputs({"F": "0.75*cos(t/2)"})
    start = [1.0, 1.0, 0.0, 0.0]
    position, speed = np.cos(2.5), -np.sin(2.5) / 4
    for rtol, method in ((1e-3, "dop853"), (1e-5, "dop853"), (9e-6, "gauss8")):
        sol = model.simulate(5.0, start, rtol=rtol)
        assert sol.method == method + " in lockstep" * (method == "dop853")
        np.testing.assert_allclose(sol.y[-1], [position] * 2 + [speed] * 2, rtol=0, atol=rtol)
        lanes = method == "dop853"
        batch = model.simulate_batch(5.0, [start], rtol=rtol, lockstep=lanes, progress=False)
        assert np.array_equal(batch.y[0], sol.y[-1])
        assert np.array_equal(model.simulate(5.0, start, rtol=rtol, method=sol.method).y, sol.y)
    assert model.simulate(5.0, start, rtol=1e-3, lockstep=False).method == "gauss8"


def test_a_method_that_auto_cannot_begin_with_is_refused(pendulum):
    with pytest.raises(mechc.UnknownNameError, match="nothing"):
        pendulum.simulate(1.0, [1.0, 0.0], method="auto from nothing")
