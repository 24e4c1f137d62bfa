"""Batches: each member is the run that simulate makes, whatever lies around it."""

import itertools

import numpy as np
import pytest

import mechc

METHOD = "gauss8"
TIMES = np.linspace(0, 2, 9)
REDUCTIONS = ("max(theta_2)", "min(omega_0)", "mean(theta_1)", "first(theta_0 > 100deg)")


@pytest.fixture(scope="module")
def drawn():
    """Twelve members that can be assembled, and one that cannot: (Assembly, parameters)."""
    draw = np.random.default_rng(5)
    theta, length = draw.uniform(0.8, 2.0, 13), draw.uniform(3.3, 3.7, 13)
    theta[6], length[6] = 0.0, 4.5 + 2  # the coupler cannot reach
    return mechc.Assembly({"theta_0": theta}, {"omega_0": 0.3}), {"l_3": length, "m_1": 2.5}


@pytest.fixture(scope="module")
def batch(model, drawn):
    start, params = drawn
    return model.simulate_batch(
        2.0, start, params, t_eval=TIMES, reduce=REDUCTIONS, method=METHOD, threads=1
    )


def one(params, member):
    return {n: float(v[member]) if np.ndim(v) else v for n, v in params.items()}


def test_a_member_is_the_run_that_simulate_makes_to_the_last_bit(model, drawn, batch):
    _, params = drawn
    for member in np.flatnonzero(batch.ok):
        sol = model.simulate(2.0, batch["y0"][member], one(params, member), method=METHOD)
        assert np.array_equal(sol.y[-1], batch.y[member])
        assert np.array_equal(sol(TIMES), batch["y_eval"][member])
        assert batch["steps"][member] == sol.stats["steps"]
        assert batch["rhs_evaluations"][member] == sol.stats["rhs_evaluations"]


@pytest.mark.parametrize("method", ["auto", "dop853", "radau5"])
def test_every_method_is_the_same_in_a_batch(model, regular, method):
    params, start = regular
    batch = model.simulate_batch((0, -1), start, params, method=method, rtol=1e-7)
    sol = model.simulate((0, -1), start, params, method=method, rtol=1e-7)
    assert np.array_equal(sol.y[-1], batch.y[0])


def test_members_start_as_assemble_would_have_them(model, drawn, batch):
    start, params = drawn
    for member in np.flatnonzero(batch.ok):
        theta = start.coordinates["theta_0"][member]
        y0 = model.assemble({"theta_0": theta}, {"omega_0": 0.3}, params=one(params, member))
        np.testing.assert_allclose(batch["y0"][member], y0, atol=1e-13)


def test_a_member_that_cannot_be_assembled_has_a_status_and_harms_nobody(batch):
    assert batch.counts == {"finished": 12, "not assembled": 1}
    assert batch.status(6).code == "not assembled"
    assert batch["miss"][6] == pytest.approx(6.5 - 6.0, rel=1e-9)  # 1 + 2 + 3 m reach 6 m
    assert np.isnan(batch["y_eval"][6]).all()
    assert np.isnan(batch["max(theta_2)"][6])
    assert "1 not assembled" in batch.warnings[0]


def test_results_do_not_depend_on_threads_chunks_or_order(model, drawn, batch):
    start, params = drawn
    order = np.random.default_rng(0).permutation(13)
    turned = mechc.Assembly({"theta_0": start.coordinates["theta_0"][order]}, start.speeds)
    again = model.simulate_batch(
        2.0, turned, params | {"l_3": params["l_3"][order]}, t_eval=TIMES, reduce=REDUCTIONS,
        method=METHOD, threads=3, chunk=5,
    )  # fmt: skip
    for name, values in batch.arrays.items():
        assert np.array_equal(values[order], again[name], equal_nan=True), name


def test_reductions_are_those_of_the_dense_output(model, drawn, batch):
    _, params = drawn
    t = np.linspace(0, 2, 20_001)
    for member in np.flatnonzero(batch.ok):
        sol = model.simulate(2.0, batch["y0"][member], one(params, member), method=METHOD)
        y = sol(t)
        high, low = batch["max(theta_2)"][member], batch["min(omega_0)"][member]
        assert y[:, 2].max() - 1e-9 <= high <= y[:, 2].max() + 1e-6
        assert y[:, 3].min() - 1e-4 <= low <= y[:, 3].min() + 1e-9
        assert batch["mean(theta_1)"][member] == pytest.approx(
            np.trapezoid(y[:, 1], t) / 2, abs=1e-7
        )
        level = np.radians(100)
        up = np.flatnonzero((y[:-1, 0] < level) & (y[1:, 0] >= level))
        when = batch["first(theta_0 > 100deg)"][member]
        if len(up):
            assert t[up[0]] - 1e-9 <= when <= t[up[0] + 1] + 1e-9
            assert sol(when)[0] == pytest.approx(level, abs=1e-9)
        else:
            assert np.isnan(when)


def test_outputs_are_reduced_and_kept(model, regular):
    params, start = regular
    asked = ("range(energy)", "max(norm(multipliers))", "max(abs(points[3, 1]))", "final(theta_0)")
    batch = model.simulate_batch(
        2.0, start, params, t_eval=TIMES, states=False, outputs=["points"], reduce=asked,
        method=METHOD,
    )  # fmt: skip
    sol = model.simulate(2.0, start, params, method=METHOD)
    y = sol(np.linspace(0, 2, 20_001))
    assert "y_eval" not in batch.arrays
    assert np.array_equal(batch["points"][0], model.points(sol(TIMES), params))
    assert batch["range(energy)"][0] < 1e-6
    reaction = np.linalg.norm(model.multipliers(y, params), axis=1).max()
    assert batch["max(norm(multipliers))"][0] == pytest.approx(reaction, rel=1e-5)
    height = np.abs(model.points(y, params)[:, 3, 1]).max()
    assert batch["max(abs(points[3,1]))"][0] == pytest.approx(height, abs=1e-6)
    assert batch["final(theta_0)"][0] == sol["theta_0"][-1]


def test_change_points_are_counted_and_warned_about_once(model):
    start = model.assemble({"theta_0": np.radians(85)})
    batch = model.simulate_batch(3.0, np.tile(start, (4, 1)), method=METHOD)
    sol = model.simulate(3.0, start, method=METHOD)
    assert (batch["change_points"] == len(sol.change_points)).all()
    assert len(sol.change_points) > 0
    assert len(batch.warnings) == 1
    stopped = model.simulate_batch(3.0, start, method=METHOD, on_change_point="stop")
    assert stopped.status(0).code == "stopped at a change point"


def test_a_start_that_is_open_or_not_finite_has_a_status(model, regular):
    params, start = regular
    starts = np.tile(start, (3, 1))
    starts[1, 1] += 1e-3
    starts[2, 4] = np.nan
    batch = model.simulate_batch(1.0, starts, params, method=METHOD)
    assert batch["status"].tolist() == [1, 111, 111]


def test_the_dataset_names_dimensions_and_parameters(batch, drawn):
    data = batch.to_xarray()
    assert dict(data.sizes) == {"member": 13, "state": 6, "time": 9}
    assert np.array_equal(data.l_3, drawn[1]["l_3"])
    assert data.l_3.attrs["units"] == "m"
    assert data["max_theta_2_"].attrs == {"long_name": "max(theta_2)", "units": "rad"}
    assert float(data.y.sel(state="omega_1")[0]) == batch.y[0, 4]


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        ({"reduce": "max(theta_9)"}, "theta_2"),
        ({"reduce": "__import__('os')"}, "no reduction is called"),
        ({"reduce": "max(theta_2) + 1"}, "not a reduction"),
        ({"reduce": "max(points)"}, r"points\[0,0\]"),
        ({"reduce": "max(points[9,0])"}, "shape"),
        ({"reduce": "first(theta_0 > 3 parsec)"}, "rad or deg"),
        ({"reduce": "first(theta_0)"}, "level"),
        ({"params": {"l_3": [3.5, 3.6], "m_1": [1.0, 2.0, 3.0]}}, "counted differently"),
        ({"params": {"l_3": [3.5, -1.0]}}, "l_3"),
        ({"outputs": ["points"]}, "t_eval"),
        ({"on_change_point": "raise"}, "does not raise"),
        ({"threads": 0}, "threads"),
    ],
)
def test_what_cannot_be_is_refused_before_anything_runs(model, regular, arguments, complaint):
    params, start = regular
    with pytest.raises((mechc.MechcError, ValueError), match=complaint):
        model.simulate_batch(1.0, start, **({"params": params} | arguments))


def test_loops_with_a_choice_need_a_guess(model):
    with pytest.raises(mechc.AssemblyError, match="guess"):
        model.simulate_batch(1.0, mechc.Assembly({}), {"l_3": [3.5, 3.6]})


def test_a_guess_chooses_the_assembly(model):
    theta, params = np.array([1.0, 1.2]), {"l_3": 3.5}
    guess = {"theta_1": -1.0}
    batch = model.simulate_batch(
        0.0, mechc.Assembly({"theta_0": theta}, guess=guess), params, method=METHOD
    )
    for y, angle in zip(batch["y0"], theta, strict=True):
        alone = model.assemble({"theta_0": angle}, guess=guess, params=params)
        np.testing.assert_allclose(y, alone, atol=1e-13)


def test_ctrl_c_keeps_what_is_done(model, regular, monkeypatch):
    from mechc import batch

    params, start = regular
    looks = itertools.count()

    def interrupt(self, done):
        if next(looks) == 2:
            raise KeyboardInterrupt

    monkeypatch.setattr(batch.CountBar, "update_count", interrupt)
    cut = model.simulate_batch(
        1.0, np.tile(start, (40, 1)), params, method=METHOD, chunk=10, threads=2
    )
    assert not cut.complete
    assert 0 < cut.counts["finished"] < 40
    assert cut.counts["not run"] == 40 - cut.counts["finished"]
