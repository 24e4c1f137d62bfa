"""Fits of pendulum recordings: values, uncertainty, robustness, starts, and what is refused."""

import itertools

import numpy as np
import pytest
from scipy.optimize import curve_fit

import mechc
from mechc.fitting.problem import Problem
from tests.support.differences import apart, extrapolated

T = np.linspace(0.0, 4.0, 161)
TRUE = {"l_0": 1.3, "g": 9.2}
BOUNDS = {"l_0": (0.3, 3.0)}


@pytest.fixture(scope="module")
def pendulum():
    return mechc.load("pendulum", outputs=("energy", "points", "sensitivities"))


def recorded(model, start=(0.8, 0.3), noise=0.0, seed=0, times=T):
    sol = model.simulate(times[-1], np.array(start), TRUE, t_eval=times, rtol=1e-12)
    draw = np.random.default_rng(seed)
    return sol["theta_0"] + noise * draw.normal(size=len(times))


def columns(model, **options):
    return {"t": T, "theta_0": recorded(model, **options)}


KNOWN = {"params": {"g": TRUE["g"]}, "y0": {"theta_0": 0.8, "omega_0": 0.3}}


def test_several_recordings_each_with_its_own_start(pendulum):
    angles = [recorded(pendulum, start) for start in ((0.8, 0.3), (-0.4, 1.5))]
    angles[0][30:60] = np.nan
    result = pendulum.fit(
        [(T, angles[0]), {"time": T, "theta_0": angles[1]}],
        {"l_0": (0.3, 3.0), "theta_0": None, "omega_0": (-3.0, 3.0)},
        {"theta_0": 0.01},
        params={"g": TRUE["g"]},
    )
    wanted = {
        "l_0": 1.3, "theta_0[0]": 0.8, "theta_0[1]": -0.4, "omega_0[0]": 0.3, "omega_0[1]": 1.5,
    }  # fmt: skip
    assert result.converged
    assert result.values == pytest.approx(wanted, abs=1e-7)
    assert result.problem.count == 2 * len(T) - 30
    for start, sol in zip(result.starts, result.solutions, strict=True):
        again = pendulum.simulate(4.0, start, result.params)
        np.testing.assert_array_equal(again.y[-1], sol(4.0))
    left = result.residuals[0]
    assert np.isnan(left[30:60]).all()
    assert np.nanmax(np.abs(left)) < 1e-6


def test_the_jacobian_is_that_of_the_residuals(pendulum):
    free = {"l_0": None, "theta_0": None, "omega_0": None}
    measured = {"theta_0": 0.02, "points[1,1]": 0.1, "energy": 0.5}
    sol = pendulum.simulate(4.0, {"theta_0": 0.7, "omega_0": 0.2}, t_eval=T)
    data = {"t": T, "theta_0": sol["theta_0"], "energy": sol.energy}
    data["points[1,1]"] = pendulum.points(sol.y)[:, 1, 1]
    problem = pendulum.fit(data, free, measured, rtol=1e-12).problem
    x = np.array([1.1, 0.6, 0.25])
    found = problem.jacobian(x)
    for k, h in enumerate(np.eye(3)):
        wanted = extrapolated(lambda s, h=h: problem.residuals(x + s * h), 0.01)
        assert apart(found[:, k], wanted) < 1e-8


@pytest.mark.parametrize("sigma", [0.02, None])
def test_values_and_covariance_are_those_of_curve_fit(pendulum, sigma):
    data = columns(pendulum, noise=0.02)
    measured = ["theta_0"] if sigma is None else {"theta_0": sigma}
    result = pendulum.fit(data, BOUNDS | {"omega_0": None}, measured, **KNOWN)

    def motion(_, length, speed):
        run = {"l_0": length, "g": TRUE["g"]}
        return pendulum.simulate(4.0, np.array([0.8, speed]), run, rtol=1e-12, t_eval=T)["theta_0"]

    errors = None if sigma is None else np.full(len(T), sigma)
    values, covariance = curve_fit(
        motion, T, data["theta_0"], [1.2, 0.2], sigma=errors, absolute_sigma=sigma is not None
    )
    np.testing.assert_allclose(result.x, values, rtol=1e-5)
    np.testing.assert_allclose(result.covariance, covariance, rtol=1e-3)
    low, high = result.intervals["l_0"]
    factor = (high - low) / 2 / result.standard_errors["l_0"]
    assert factor == pytest.approx(1.959964 if sigma else 1.974996, abs=1e-4)  # normal, Student 159


def test_a_robust_loss_sets_outliers_aside(pendulum):
    data = columns(pendulum, noise=0.01)
    data["theta_0"][::18] += 1.5
    data["theta_0"][9::18] -= 1.5
    plain, robust = (
        pendulum.fit(data, BOUNDS, {"theta_0": 0.01}, loss=loss, **KNOWN)
        for loss in ("linear", "cauchy")
    )
    low, high = robust.intervals["l_0"]
    assert low < TRUE["l_0"] < high
    assert high - low < 0.01
    assert abs(plain["l_0"] - TRUE["l_0"]) > 5 * abs(robust["l_0"] - TRUE["l_0"])


def test_what_the_data_leave_open_is_said(pendulum):
    data = columns(pendulum, noise=0.01)
    result = pendulum.fit(
        data, {"l_0": None, "g": None, "m_0": None}, {"theta_0": 0.01}, y0=KNOWN["y0"]
    )
    told = [str(one) for one in result.undetermined]
    assert "m_0: changes nothing that was measured" in told
    assert sorted(told)[0] in ("l_0 +1 %, g +1 %: changes nothing that was measured",
                               "g +1 %, l_0 +1 %: changes nothing that was measured")  # fmt: skip
    assert result["g"] / result["l_0"] == pytest.approx(TRUE["g"] / TRUE["l_0"], rel=1e-2)
    assert np.isinf(result.standard_errors["m_0"])
    assert "do not determine m_0" in str(result)


def test_ctrl_c_leaves_the_best_values_tried(pendulum, monkeypatch):
    calls, inner = itertools.count(), Problem.jacobian

    def interrupt(self, x):
        if next(calls) == 3:
            raise KeyboardInterrupt
        return inner(self, x)

    monkeypatch.setattr(Problem, "jacobian", interrupt)
    data, first = columns(pendulum, noise=0.01), {"params": {"l_0": 4.0}, "y0": KNOWN["y0"]}
    with pytest.raises(mechc.RunInterrupt) as stopped:
        pendulum.fit(data, {"l_0": None}, {"theta_0": 0.01}, **first)
    result = stopped.value.fit
    assert not result.converged
    assert "ended early: it was interrupted" in str(result)
    whole = pendulum.fit(data, {"l_0": None}, {"theta_0": 0.01}, **first)
    assert whole.cost < result.cost
    assert result["l_0"] != 4.0


@pytest.mark.parametrize("refined", [0, 2])
def test_ctrl_c_at_the_first_motion_of_a_start_leaves_those_before(pendulum, monkeypatch, refined):
    told, inner = [], Problem.residuals

    def interrupt(self, x):
        if len(told) == 1 + refined:  # one beside those of each start
            told.append("interrupted")
            raise KeyboardInterrupt
        return inner(self, x)

    monkeypatch.setattr(Problem, "residuals", interrupt)
    given = columns(pendulum, noise=0.01), {"l_0": (0.05, 20.0)}, {"theta_0": 0.01}
    with pytest.raises(KeyboardInterrupt) as stopped:
        pendulum.fit(*given, **KNOWN, starts=8, progress=lambda *note: told.append(note))
    if not refined:
        assert not isinstance(stopped.value, mechc.RunInterrupt)
        return
    ends = pendulum.fit(*given, **KNOWN, starts=8, refined=refined).ends
    assert [cost for _, cost in stopped.value.fit.ends] == [cost for _, cost in ends]


def test_many_starts_find_what_one_does_not(pendulum):
    data = columns(pendulum, noise=0.01)
    free, far = (
        {"l_0": (0.05, 20.0)},
        {"params": KNOWN["params"] | {"l_0": 15.0}, "y0": KNOWN["y0"]},
    )
    stuck = pendulum.fit(data, free, {"theta_0": 0.01}, **far)
    found = pendulum.fit(data, free, {"theta_0": 0.01}, starts=64, **far)
    assert stuck.cost > 10 * found.cost
    assert stuck.probability < 1e-9
    assert "larger than their noise" in str(stuck)
    assert 0.01 < found.probability < 1.0
    assert "larger than their noise" not in str(found)
    assert found["l_0"] == pytest.approx(1.3, abs=0.01)
    costs = [cost for _, cost in found.ends]
    assert costs == sorted(costs)


def test_a_value_at_its_bound_has_no_interval(pendulum):
    data = columns(pendulum, noise=0.01)
    free = {"l_0": (1.4, 3.0), "omega_0": None}
    result = pendulum.fit(data, free, {"theta_0": 0.01}, **KNOWN)
    assert result["l_0"] == pytest.approx(1.4, abs=1e-6)
    assert np.isnan(result.standard_errors["l_0"])
    assert np.isfinite(result.standard_errors["omega_0"])
    assert "l_0 lies at its lower bound" in str(result)


def test_a_dataset_of_xarray(pendulum):
    sol = pendulum.simulate(4.0, KNOWN["y0"], TRUE)
    result = pendulum.fit(sol.to_xarray(), BOUNDS, {"theta_0": 0.01}, **KNOWN)
    assert result["l_0"] == pytest.approx(1.3, abs=1e-6)
    in_minutes = sol.to_xarray()
    in_minutes["time"].attrs["units"] = "min"
    in_degrees = sol.to_xarray()
    in_degrees["theta_0"].attrs["units"] = "deg"
    for wrong, words in ((in_minutes, "are in 'min'"), (in_degrees, "is in 'deg'")):
        with pytest.raises(mechc.MechcError, match=words):
            pendulum.fit(wrong, BOUNDS, {"theta_0": 0.01}, **KNOWN)


DAYS = np.arange("2020-01-01", "2020-01-09", dtype="M8[D]")
DATA = {"t": T, "theta_0": np.zeros(len(T))}
WRONG = {
    "no parameter, coordinate or speed is called 'l_9'": {"free": {"l_9": None}},
    "the lower bound 3 must be below 1": {"free": {"l_0": (3, 1)}},
    "exceed its own": {"free": {"l_0": (-1, 1)}},
    "l_0 begins at 4, outside": {"params": {"l_0": 4.0}},
    "nothing is free": {"free": {}},
    "no quantity is called 'theta_7'": {"measured": {"theta_7": 1}},
    "write one of its numbers": {"measured": {"points": 1}},
    "must be a positive number": {"measured": {"theta_0": 0.0}},
    "no column of the recording is called 'omega_0'": {"measured": {"omega_0": 1}},
    "has no times": {"measurements": {"theta_0": DATA["theta_0"]}},
    "must be finite and rise": {"measurements": (T[::-1], DATA["theta_0"])},
    "its values have the shape": {"measurements": (T, np.zeros((5, 1)))},
    "a missing sample is NaN": {"measurements": (T, T + np.inf)},
    "are in 'datetime64": {"measurements": (DAYS, T[:8])},
    "measured nowhere": {"measurements": (T, T * np.nan)},
    "2 samples do not determine 3": {"measurements": (T[:2], T[:2]),
                                     "free": {"l_0": None, "theta_0": None, "omega_0": None}},
    "y0 is a whole state": {"free": {"theta_0": None}, "y0": [0.1, 0.2]},
    "no loss is called": {"loss": "tukey"},
    "begins after the first sample": {"t0": 1.0},
}  # fmt: skip


@pytest.mark.parametrize("words", WRONG)
def test_wrong_arguments_are_refused(pendulum, words):
    given = {"measurements": DATA, "free": BOUNDS, "measured": {"theta_0": 0.01}} | WRONG[words]
    with pytest.raises((mechc.MechcError, TypeError), match=words):
        pendulum.fit(**given)


@pytest.mark.parametrize("low", [-np.pi, 0.0])
def test_angles_reduced_to_one_turn(pendulum, low):
    """A pendulum that turns over, recorded within a turn: the fit "converged" at 0.55 m."""
    times, start = np.linspace(0.0, 3.0, 121), {"theta_0": 0.4, "omega_0": 8.0}
    sol = pendulum.simulate(3.0, start, {"l_0": 1.3}, t_eval=times)
    assert np.ptp(sol["theta_0"]) > 10.0
    recorded = (sol["theta_0"] - low) % (2 * np.pi) + low
    recorded[10:14] = np.nan
    found = pendulum.fit(
        {"t": times, "theta_0": recorded}, {"l_0": (0.5, 4.0)}, ["theta_0"], y0=start,
        params={"l_0": 1.25},
    )  # fmt: skip
    assert found.converged
    assert found["l_0"] == pytest.approx(1.3, rel=1e-7)


def test_names_alone_free_and_every_known_column_counts(pendulum):
    data = columns(pendulum) | {"remark": T}
    result = pendulum.fit(data, ["l_0"], **KNOWN)
    assert result["l_0"] == pytest.approx(TRUE["l_0"], rel=1e-6)
    assert [one.name for one in result.problem.measured] == ["theta_0"]
    with pytest.raises(mechc.MechcError, match="what was measured"):
        pendulum.fit((T, data["theta_0"]), ["l_0"], **KNOWN)
    with pytest.raises(mechc.MechcError, match="no column is a quantity"):
        pendulum.fit({"t": T, "remark": T}, ["l_0"], **KNOWN)


@pytest.mark.parametrize("measured", [["theta_0", "omega_0"], ["theta_0"]])
def test_without_a_start_it_begins_at_the_first_samples(pendulum, measured):
    start = (0.8, 0.3 if "omega_0" in measured else 0.0)
    sol = pendulum.simulate(4.0, np.array(start), TRUE, t_eval=T, rtol=1e-12)
    data = {"t": T, **{name: sol[name] for name in measured}}
    given = {"params": {"g": TRUE["g"], "l_0": 1.2}}
    found = pendulum.fit(data, {"l_0": None}, measured, **given)
    assert found["l_0"] == pytest.approx(TRUE["l_0"], rel=1e-6)
    np.testing.assert_allclose(found.solutions[0].y[0], start, atol=1e-12)
    freed = pendulum.fit(data, {"l_0": None, "omega_0": (-1.0, 1.0)}, measured, **given)
    np.testing.assert_allclose(freed.solutions[0].y[0], start, atol=1e-5)


@pytest.mark.parametrize("seed", range(3))
def test_of_a_linkage_the_loops_follow_the_samples(seed):
    """All angles and speeds were measured, more than are free; either assembly."""
    model, rng = mechc.load("four_bar"), np.random.default_rng(seed)
    guess = {"theta_1": float(rng.choice([-1.0, 1.0]))}
    params = {"l_3": 3.5, "m_1": float(rng.uniform(1.5, 4.0))}
    start = model.assemble({"theta_0": rng.uniform(1.2, 2.0)}, {"omega_0": 1.0}, guess, params)
    times = np.linspace(0.0, 1.5, 31)
    sol = model.simulate(1.5, start, params, t_eval=times, rtol=1e-12)
    data = {"t": times, **{name: sol[name] for name in (*model.coordinates, *model.speeds)}}
    found = model.fit(data, {"m_1": (1.0, 5.0)}, params={"l_3": 3.5})
    assert found["m_1"] == pytest.approx(params["m_1"], rel=1e-5)
    np.testing.assert_allclose(found.solutions[0].y[0], start, atol=1e-9)
