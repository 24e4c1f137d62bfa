"""Simulation: any span, step and output wanted; bad requests refused before any work."""

import builtins
import inspect
from itertools import pairwise

import numpy as np
import pytest

import mechc
from mechc.errors import (
    AssemblyError,
    MechcError,
    UnknownNameError,
    ValueOutOfBoundsError,
)
from tests.support import fake_linkage

METHODS = ("dopri5", "dop853")


def exact(t):
    return fake_linkage.exact_state(np.asarray(t, dtype=float))


def test_the_motion_is_the_exact_one(sol):
    assert sol.status.ok
    assert sol.t[0] == 0.0
    assert sol.t[-1] == 2.0
    np.testing.assert_allclose(sol.y, exact(sol.t), rtol=0, atol=1e-8)
    np.testing.assert_array_equal(np.hstack([sol.q, sol.u]), sol.y)
    np.testing.assert_array_equal(sol["omega_1"], sol.y[:, 4])
    assert len(sol) == len(sol.t)


def test_every_state_is_on_the_constraints(sol):
    t = np.linspace(0, 2, 3001)
    dense = sol(t)
    for y in (sol.y, dense):
        assert np.abs(sol.model.constraints(y, sol.params)).max() < 1e-13
        assert np.abs(sol.model.velocity_constraints(y, sol.params)).max() < 1e-13
    assert sol.closure.max() < 1e-13
    assert sol.velocity_closure.max() < 1e-13
    assert sol.closure.shape == sol.velocity_closure.shape == sol.energy.shape == sol.t.shape


@pytest.mark.parametrize("method", METHODS)
def test_dense_output_is_as_good_as_the_steps(model, regular, method):
    params, start = regular
    sol = model.simulate((0, 2), start, params, rtol=1e-8, method=method)
    t = np.linspace(0, 2, 1001)
    np.testing.assert_allclose(sol(t), exact(t), rtol=0, atol=2e-6)
    np.testing.assert_allclose(sol(sol.t), sol.y, rtol=0, atol=1e-13)


def test_dense_output_takes_times_of_any_shape(sol):
    t = np.array([[0.1, 0.2, 0.3], [1.9, 2.0, 0.0]])
    assert sol(t).shape == (2, 3, 6)
    assert sol(0.5).shape == (6,)
    np.testing.assert_array_equal(sol(t)[1, 0], sol(1.9))
    assert sol([]).shape == (0, 6)


@pytest.mark.parametrize("t", [-1e-9, 2.0 + 1e-9, np.nan, [0.5, 3.0]])
def test_dense_output_refuses_times_that_were_not_simulated(sol, t):
    with pytest.raises(ValueOutOfBoundsError, match=r"0 \.\.\. 2 s"):
        sol(t)


def test_energy_stays(sol):
    hand = fake_linkage.kinetic(sol.q, sol.u) + fake_linkage.potential(sol.q)
    np.testing.assert_allclose(sol.energy, hand, rtol=1e-13)
    assert 0 < sol.energy_drift < 1e-9


def test_angles_too_large_for_the_tolerance_are_warned_of(model, regular):
    params, start = regular
    turned = start + np.repeat([2e5 * np.pi, 0.0], 3)
    (told,) = model.simulate(0.5, turned, params).status.warnings
    assert told.startswith("theta_0 comes to 6.28e+05 rad, where doubles lie 1e-10 rad apart")
    assert not model.simulate(0.5, start, params, rtol=1e-12).status.warnings


def test_the_energy_drift_is_that_of_all_steps_whatever_is_reported(model, regular):
    params, start = regular
    whole = model.simulate(2, start, params, rtol=1e-6)
    end = model.simulate(2, start, params, rtol=1e-6, t_eval=[2.0])
    assert end.energy_drift == whole.energy_drift > 0


@pytest.mark.parametrize("method", METHODS)
def test_the_error_falls_with_the_tolerance(model, regular, method):
    params, start = regular
    errors = []
    for rtol in (1e-4, 1e-6, 1e-8, 1e-10):
        sol = model.simulate((0, 3), start, params, rtol=rtol, method=method)
        errors.append(np.abs(sol.y[-1] - exact(3.0)).max())
        assert errors[-1] < 200 * rtol
    assert all(later < 0.1 * earlier for earlier, later in pairwise(errors))


def test_a_higher_order_takes_fewer_steps(model, regular):
    params, start = regular
    steps = [
        model.simulate((0, 2), start, params, rtol=1e-10, method=m).stats["steps"] for m in METHODS
    ]
    assert steps[1] < 0.5 * steps[0]


@pytest.mark.parametrize("method", ["auto", *METHODS])
def test_the_method_used_is_told(model, regular, method):
    params, start = regular
    sol = model.simulate((0, 0.1), start, params, method=method)
    assert sol.stats["method"] == ("gauss8" if method == "auto" else method)
    assert sol.stats["rhs_evaluations"] > sol.stats["steps"] > 0
    assert sol.stats["wall_s"] > 0


def test_the_times_asked_for_are_the_times_reported(model, regular):
    params, start = regular
    wanted = np.array([0.0, 0.3, 1.0, 1.7, 2.0])
    sol = model.simulate((0, 2), start, params, t_eval=wanted)
    np.testing.assert_array_equal(sol.t, wanted)
    np.testing.assert_allclose(sol.y, exact(wanted), rtol=0, atol=1e-8)
    assert sol(0.15).shape == (6,)
    wanted[0] = 0.1
    assert sol.t[0] == 0.0


def test_no_times_at_all_may_be_asked_for(model, regular):
    params, start = regular
    sol = model.simulate((0, 1), start, params, t_eval=[])
    assert sol.y.shape == (0, 6)
    assert 0 < sol.energy_drift < 1e-9  # of the steps


def test_time_runs_backwards_too(model, regular):
    params, _ = regular
    sol = model.simulate((2.0, 0.5), exact(2.0), params, t_eval=[1.8, 1.0, 0.5])
    np.testing.assert_array_equal(sol.t, [1.8, 1.0, 0.5])
    np.testing.assert_allclose(sol.y, exact(sol.t), rtol=0, atol=1e-7)
    assert sol.span == (2.0, 0.5)
    np.testing.assert_allclose(sol(1.3), exact(1.3), rtol=0, atol=1e-7)


def test_a_span_may_start_anywhere_or_be_its_end_alone(model, regular):
    params, start = regular
    moved = model.simulate((5.0, 6.0), start, params)
    np.testing.assert_allclose(moved.y[-1], exact(1.0), rtol=0, atol=1e-8)
    np.testing.assert_allclose(model.simulate(1.0, start, params).y[-1], exact(1.0), atol=1e-8)


def test_a_span_of_no_length_is_its_start(model, regular):
    params, start = regular
    sol = model.simulate((3.0, 3.0), start, params)
    assert sol.status.ok
    np.testing.assert_array_equal(sol.t, [3.0])
    np.testing.assert_allclose(sol.y, start[None], rtol=0, atol=1e-15)
    np.testing.assert_array_equal(sol(3.0), sol.y[0])


def test_the_first_step_and_the_largest_are_kept(model, regular):
    params, start = regular
    first = model.simulate((0, 1), start, params, first_step=1e-4)
    assert first.t[1] == 1e-4
    short = model.simulate((0, 1), start, params, max_step=1e-3)
    assert np.diff(short.t).max() <= 1e-3 * (1 + 1e-12)
    np.testing.assert_allclose(short.y[-1], exact(1.0), rtol=0, atol=1e-10)


def test_absolute_tolerances_are_as_in_scipy(model, regular):
    params, start = regular
    each = np.array([1e-9, 1e-9, 1e-9, 1e-8, 1e-8, 1e-8])
    for atol in (1e-10, each):
        sol = model.simulate((0, 1), start, params, rtol=1e-9, atol=atol)
        np.testing.assert_allclose(sol.y[-1], exact(1.0), rtol=0, atol=1e-7)
    loose = model.simulate((0, 1), start, params, rtol=1e-9, atol=1e-3)
    assert loose.stats["steps"] < sol.stats["steps"]


def test_a_run_goes_on_where_another_ended(model, regular):
    params, start = regular
    first = model.simulate((0, 1), start, params)
    second = model.simulate((1, 2), first.y[-1], params)
    np.testing.assert_allclose(second.y[-1], exact(2.0), rtol=0, atol=1e-8)


def test_a_run_gives_the_same_to_the_bit_whenever_it_is_made(model, regular, sol):
    params, start = regular
    again = model.simulate((0, 2), start, params)
    np.testing.assert_array_equal(again.t, sol.t)
    np.testing.assert_array_equal(again.y, sol.y)


def test_neither_start_nor_parameters_are_touched_or_kept(model, regular):
    start, params = regular[1].copy(), model.system.parameter_set.resolve(regular[0])
    sol = model.simulate((0, 1), start, params)
    np.testing.assert_array_equal(start, regular[1])
    before = model.energy(sol.y, sol.params)
    params[:] = 9.0
    start[:] = 9.0
    np.testing.assert_array_equal(sol.energy, before)
    np.testing.assert_allclose(sol(0.0), regular[1], atol=1e-15)


def test_a_start_off_by_rounding_is_projected(model, regular):
    params, start = regular
    sol = model.simulate((0, 0.1), np.round(start, 10), params)
    assert sol.closure[0] < 1e-14
    assert 0 < np.abs(sol.y[0] - start).max() < 1e-9


def test_a_start_off_the_manifold_is_refused_with_the_gap(model, regular):
    params, start = regular
    off = start + np.array([0, 0, 1e-3, 0, 0, 0])
    gap = np.abs(model.constraints(off, params)).max()
    with pytest.raises(AssemblyError, match=f"open by {gap:.6g} m; .*model.assemble"):
        model.simulate((0, 1), off, params)
    off = start + np.array([0, 0, 0, 1.0, 0, 0])
    drift = np.abs(model.velocity_constraints(off, params)).max()
    with pytest.raises(AssemblyError, match=f"at {drift:.6g} m/s; .*speeds"):
        model.simulate((0, 1), off, params)


def test_starts_that_are_no_states_are_refused(model, regular):
    params, start = regular
    with pytest.raises(ValueError, match=r"shape \(6,\): theta_0, .*omega_2"):
        model.simulate((0, 1), start[:5], params)
    for index, name in ((1, "theta_1"), (5, "omega_2")):
        bad = start.copy()
        bad[index] = np.nan
        with pytest.raises(ValueOutOfBoundsError, match=f"y0: {name} is not a finite number"):
            model.simulate((0, 1), bad, params)


@pytest.mark.parametrize(
    ("policy", "told"),
    [
        ({"rtol": 0.0}, "rtol = 0.0 must be positive"),
        ({"rtol": np.nan}, "rtol = nan must be positive"),
        ({"rtol": np.inf}, "rtol = inf must be"),
        ({"atol": -1.0}, "atol must be positive"),
        ({"atol": [1.0, np.nan, 1, 1, 1, 1]}, "atol must be positive and finite"),
        ({"first_step": 0.0}, "first_step = 0.0 must be positive"),
        ({"max_step": -1.0}, "max_step = -1.0 must be positive"),
        ({"max_steps": 0}, "max_steps = 0 must be positive"),
        ({"t_eval": [0.5, 1.5]}, r"within the span 0 \.\.\. 1 s"),
        ({"t_eval": [0.5, 0.5]}, "strictly in the direction"),
        ({"t_eval": [0.6, 0.5]}, "strictly in the direction"),
        ({"t_eval": [np.nan]}, "within the span"),
        ({"t_eval": [[0.5]]}, "a sequence of times"),
    ],
)
def test_policies_out_of_bounds_are_refused_by_name(model, regular, policy, told):
    params, start = regular
    with pytest.raises(ValueOutOfBoundsError, match=told):
        model.simulate((0, 1), start, params, **policy)


@pytest.mark.parametrize("span", [(0, np.nan), (0, np.inf), (-np.inf, 0), np.nan])
def test_spans_are_finite(model, regular, span):
    with pytest.raises(ValueOutOfBoundsError, match="must be finite"):
        model.simulate(span, regular[1], regular[0])


@pytest.mark.parametrize("span", [5e-324, -1e-310, (0.0, 1e-320)])
def test_spans_without_fractions_are_refused(model, regular, span):
    """5e-324 s filled a gigabyte with steps of zero length."""
    with pytest.raises(ValueOutOfBoundsError, match=r"at least 2\.22507e-308 s long"):
        model.simulate(span, regular[1], regular[0])
    assert model.simulate(3e-308, regular[1], regular[0]).stats["steps"] < 10


@pytest.mark.parametrize("span", [((0, 1), 2), "soon", None, (0, "x"), ()])
def test_spans_are_one_or_two_numbers(model, regular, span):
    with pytest.raises(ValueError, match=r"t_span(?: must be|: '\w+' is not a number)"):
        model.simulate(span, regular[1], regular[0])


def test_unknown_methods_are_met_with_the_nearest(model, regular):
    with pytest.raises(UnknownNameError, match=r"'dop583'.*'dop853'"):
        model.simulate((0, 1), regular[1], regular[0], method="dop583")


def test_one_set_of_parameters_at_a_time(model, regular):
    with pytest.raises(ValueOutOfBoundsError, match="one set of parameters"):
        model.simulate((0, 1), regular[1], {"l_3": np.array([3.5, 3.5])})


def test_without_dense_output_there_is_none(model, regular, sol):
    params, start = regular
    bare = model.simulate((0, 2), start, params, dense=False)
    np.testing.assert_array_equal(bare.t, sol.t)
    np.testing.assert_array_equal(bare.y, sol.y)
    with pytest.raises(MechcError, match="simulate with dense=True"):
        bare(0.5)
    for picture in (bare.plot, bare.animate):
        with pytest.raises(MechcError, match="simulate with dense=True"):
            picture()


def test_the_docstring_of_simulate_names_every_argument(model):
    section = inspect.getdoc(model.simulate).partition("Parameters\n")[2].partition("Raises\n")[0]
    heads = [line for line in section.splitlines() if line[:1].isalpha()]
    documented = [name for line in heads for name in line.split(", ")]
    assert sorted(documented) == sorted(inspect.signature(model.simulate).parameters)


def test_a_star_import_leaves_pythons_own_names_alone():
    names = {}
    exec("from mechc import *", names)  # the test's own text
    assert "Model" in names
    assert "load" in names
    assert not set(mechc.__all__) & set(dir(builtins))
    assert callable(mechc.open)
    assert callable(mechc.compile)


def test_progress_is_told_in_rising_fractions(model, regular):
    params, start = regular
    told = []
    model.simulate((0, 1000), start, params, progress=told.append)
    assert len(told) > 2
    assert told == sorted(told)
    assert 0 < told[0] < told[-1] <= 1


@pytest.mark.parametrize("span", [(3.0, 3.0), (-2.0, -2.0)])
@pytest.mark.parametrize("method", ["dopri5", "dop853", "gauss8", "radau5"])
def test_a_span_of_no_length_has_every_output(model, regular, span, method):
    params, start = regular
    ticking = lambda t, y: y[0]  # noqa: E731
    sol = model.simulate(span, start, params, method=method, events=[ticking], t_eval=[span[0]])
    assert sol.status.ok
    np.testing.assert_array_equal(sol.t, [span[0]])
    assert sol.stats["steps"] == 0
    assert sol.energy_drift == 0
    assert sol.events[0].t.shape == (0,)
    np.testing.assert_array_equal(sol(span[0]), sol.y[0])


@pytest.mark.parametrize("method", ["dopri5", "dop853", "gauss8", "radau5"])
def test_every_method_takes_times_steps_and_tolerances_in_both_directions(model, regular, method):
    params, start = regular
    each = np.array([1e-8, 1e-8, 1e-8, 1e-7, 1e-7, 1e-7])
    for end in (1.0, -1.0):
        times = np.linspace(0, end, 33)
        sol = model.simulate(
            end, start, params, rtol=1e-8, atol=each, t_eval=times, method=method, max_step=0.02,
            first_step=0.003,
        )  # fmt: skip
        np.testing.assert_array_equal(sol.t, times)
        np.testing.assert_allclose(sol.y, exact(times), rtol=0, atol=2e-6)
        steps = np.abs(np.diff(sol.record.states()[0]))
        assert steps[0] == pytest.approx(0.003, rel=1e-12)
        assert steps.max() <= 0.02 * (1 + 1e-12)


def test_a_loose_component_is_not_controlled(model, regular):
    """atol of one component alone: the others decide the steps."""
    params, start = regular
    tight = np.full(6, 1e-11)
    loose = np.array([1e-11, 1e3, 1e3, 1e3, 1e3, 1e3])
    one, all_of_them = (
        model.simulate(2, start, params, rtol=1e-11, atol=atol, method="dop853").stats["steps"]
        for atol in (loose, tight)
    )
    assert one < all_of_them


@pytest.mark.parametrize(
    ("method", "tightest"), [("dopri5", 11), ("dop853", 13), ("gauss8", 13), ("radau5", 11)]
)
def test_the_global_error_follows_rtol_over_its_decades(model, regular, method, tightest):
    """No plateau above the rounding floor: every decade of rtol gains, down to 1e-12 rad."""
    params, start = regular
    decades = range(tightest - 8, tightest + 1)
    errors = []
    for decade in decades:
        sol = model.simulate(3.0, start, params, rtol=10.0**-decade, method=method, dense=False)
        errors.append(float(np.abs(sol.y[-1] - exact(3.0)).max()))
    floor = 3e-12
    for decade, error in zip(decades, errors, strict=True):
        assert error < max(300 * 10.0**-decade, floor), (decade, errors)
    apart = 5 if method == "radau5" else 2  # its error goes up and down more
    for before, after in zip(errors, errors[apart:], strict=False):
        assert after < max(before / 5, floor), errors
