"""Batches: each member is the run that simulate makes, whatever lies around it."""

import itertools
import time

import numpy as np
import pytest

import mechc
from mechc.native._codes import METHODS
from tests.support import LOCKSTEP, by, scenes

TIMES = np.linspace(0, 2, 9)
REDUCTIONS = ("max(theta_2)", "min(omega_0)", "mean(theta_1)", "first(theta_0 > 100deg)")


@pytest.fixture(scope="module", params=["gauss8", "dop853", LOCKSTEP])
def method(request):
    """Stages of one trajectory in the lanes, or trajectories abreast."""
    return request.param


@pytest.fixture(scope="module")
def drawn():
    """Twelve members that can be assembled, and one that cannot: (Assembly, parameters)."""
    draw = np.random.default_rng(5)
    theta, length = draw.uniform(0.8, 2.0, 13), draw.uniform(3.3, 3.7, 13)
    theta[6], length[6] = 0.0, 4.5 + 2  # the coupler cannot reach
    return mechc.Assembly({"theta_0": theta}, {"omega_0": 0.3}), {"l_3": length, "m_1": 2.5}


@pytest.fixture(scope="module")
def batch(model, drawn, method):
    start, params = drawn
    return model.simulate_batch(
        2.0, start, params, t_eval=TIMES, reduce=REDUCTIONS, **by(method), threads=1
    )


def test_every_array_is_an_attribute_too(batch):
    for name in ("y0", "y_eval", "steps", "rejected", "rhs_evaluations", "least_singular"):
        assert np.array_equal(getattr(batch, name), batch[name], equal_nan=True)
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        batch.nothing  # noqa: B018


def one(params, member):
    return {n: float(v[member]) if np.ndim(v) else v for n, v in params.items()}


def test_a_member_is_the_run_that_simulate_makes_to_the_last_bit(model, drawn, batch, method):
    _, params = drawn
    for member in np.flatnonzero(batch.ok):
        sol = model.simulate(2.0, batch["y0"][member], one(params, member), **by(method))
        assert np.array_equal(sol.y[-1], batch.y[member])
        assert np.array_equal(sol(TIMES), batch["y_eval"][member])
        assert batch["steps"][member] == sol.stats["steps"]
        assert batch["rhs_evaluations"][member] == sol.stats["rhs_evaluations"]


def test_the_end_alone_is_the_same_after_many_turns(model, method):
    """Where nothing else is asked for no other state is kept; turns are taken out on the way."""
    params = {"l_3": np.linspace(2.9, 3.1, 9)}
    start = mechc.Assembly({"theta_0": np.linspace(1.0, 2.0, 9)}, {"omega_0": 45.0})
    batch = model.simulate_batch(2.0, start, params, **by(method), threads=1)
    assert np.abs(batch.y[:, 0]).min() > 9 * 2 * np.pi
    for member in range(9):
        sol = model.simulate(2.0, batch["y0"][member], one(params, member), **by(method))
        assert np.array_equal(sol.y[-1], batch.y[member])
        assert batch["steps"][member] == sol.stats["steps"]


@pytest.mark.parametrize("method", ["auto", "dop853", "radau5"])
def test_every_method_is_the_same_in_a_batch(model, regular, method):
    params, start = regular
    batch = model.simulate_batch((0, -1), start, params, **by(method), rtol=1e-7)
    sol = model.simulate((0, -1), start, params, **by(method), rtol=1e-7)
    assert np.array_equal(sol.y[-1], batch.y[0])


@pytest.mark.parametrize("method", ["dop853", "dop853 in lockstep", LOCKSTEP])
def test_members_abreast_are_single_runs_whether_they_meet_change_points_or_not(model, method):
    """l_3 = 4 m passes one; beside it runs leave the lanes, each when it must, and come back."""
    length = np.concatenate([np.linspace(3.5, 4.5, 11), 4 + np.logspace(-3, -7, 5), [4.0, 4.0]])
    theta = np.radians(np.linspace(75, 100, len(length)))
    start = mechc.Assembly({"theta_0": theta})
    asked = {**by(method), "rtol": 1e-8}
    batch = model.simulate_batch(10.0, start, {"l_3": length}, threads=1, **asked)
    dense = model.simulate_batch(
        10.0, start, {"l_3": length}, t_eval=[5.0], reduce="max(theta_2)", threads=2, **asked
    )
    assert batch["change_points"][-1] >= 4
    assert batch.ok.all()
    for name in ("y", "t", "status", "steps", "rejected", "rhs_evaluations", "least_singular"):
        assert np.array_equal(batch[name], dense[name]), name
    for member in range(len(batch)):
        sol = model.simulate(10.0, batch["y0"][member], {"l_3": length[member]}, **asked)
        assert np.array_equal(sol.y[-1], batch.y[member])
        assert sol.stats["rejected"] == batch["rejected"][member]
        assert len(sol.change_points) == batch["change_points"][member]


@pytest.mark.slow
@pytest.mark.parametrize("rtol", [1e-4, 1e-8])
def test_stiff_members_leave_the_lanes_and_the_others_do_not_notice(rtol):
    """Sweeps do not converge where a motion is stiff: gauss8 alone has Newton's iteration."""
    model, start = mechc.compile(scenes.drawn_bead(), outputs=()), [0.5, 0.0]
    stiffness = np.repeat([1.0, 5.0, 30.0, 100.0, 1e3, 1e4, 1e6], 2)[::-1].reshape(2, 7).T.ravel()
    asked = {**by(LOCKSTEP), "rtol": rtol}
    batch = model.simulate_batch(20.0, start, {"f": stiffness}, threads=1, **asked)
    for member, f in enumerate(stiffness):
        alone = model.simulate(20.0, start, {"f": f}, **asked)
        assert np.array_equal(alone.y[-1], batch.y[member])
        assert alone.stats["steps"] == batch["steps"][member]
        by_gauss8 = model.simulate(20.0, start, {"f": f}, method="gauss8", rtol=rtol)
        assert batch["steps"][member] < 1.5 * by_gauss8.stats["steps"]
        exact = model.simulate(20.0, start, {"f": f}, method="radau5", rtol=1e-11).y[-1]
        np.testing.assert_allclose(batch.y[member], exact, atol=10 * rtol)


@pytest.mark.slow
@pytest.mark.parametrize("method", ["dop853", LOCKSTEP])
@pytest.mark.parametrize("scene", ["pendulum", "four_bar", "bicycle"])
def test_members_share_the_lanes(scene, method):
    """Without constraints, with loops, with rolling wheels; one by one they take two to nine times
    as long."""
    model = mechc.load(scene, **({"links": 5} if scene == "pendulum" else {}))
    start = model.assemble({"theta_0": 1.2}) if scene == "four_bar" else model.assemble()
    span, asked = (0, 5.0 if scene == "four_bar" else 1.0), {**by(method), "rtol": 1e-9}
    members = np.tile(start, (32, 1))
    ratios = []
    for _ in range(5):
        begun = time.process_time()
        model.simulate_batch(span, members, threads=1, **asked)
        between = time.process_time()
        for member in members:
            model.simulate(span, member, **asked)
        ratios.append((between - begun) / (time.process_time() - between))
    assert min(ratios) < 0.65


def test_members_start_as_assemble_would_have_them(model, drawn, batch):
    start, params = drawn
    for member in np.flatnonzero(batch.ok):
        theta = start.coordinates["theta_0"][member]
        y0 = model.assemble({"theta_0": theta}, {"omega_0": 0.3}, params=one(params, member))
        np.testing.assert_allclose(batch["y0"][member], y0, atol=1e-13)


def test_near_dead_points_too_what_assemble_prefers_is_taken(model):
    """Both assemblies are close to each other there; the wrong one would be another motion."""
    theta = np.radians(np.linspace(20, 178, 24))
    # the coupler and rocker, 2 and 3 m, nearly stretched: crank tip and far pivot 5 m apart
    stretched = np.cos(np.pi - theta)
    length = np.sqrt(25 - 1 + stretched**2) - stretched
    length *= 1 - np.logspace(-1, -9, 24)
    batch = model.simulate_batch(0.0, mechc.Assembly({"theta_0": theta}), {"l_3": length})
    assert batch.ok.all()
    for y0, angle, far in zip(batch["y0"], theta, length, strict=True):
        alone = model.assemble({"theta_0": angle}, params={"l_3": far})
        np.testing.assert_allclose(y0, alone, atol=1e-10 / np.sin(alone[1] - alone[2]))


@pytest.mark.parametrize("instruction_set", ["baseline", "avx2"])
def test_a_batch_equals_single_runs_on_every_instruction_set(instruction_set, drawn, batch, method):
    try:
        model = mechc.load("four_bar", instruction_set=instruction_set)
    except ValueError:
        pytest.skip(f"no {instruction_set} here")
    start, params = drawn
    narrow = model.simulate_batch(2.0, start, params, **by(method))
    for member in np.flatnonzero(narrow.ok)[:4]:
        sol = model.simulate(2.0, narrow["y0"][member], one(params, member), **by(method))
        assert np.array_equal(sol.y[-1], narrow.y[member])
    np.testing.assert_allclose(narrow.y[narrow.ok], batch.y[batch.ok], atol=1e-7)


def test_a_member_that_cannot_be_assembled_has_a_status_and_harms_nobody(batch):
    assert batch.counts == {"finished": 12, "not assembled": 1}
    assert batch.status(6).code == "not assembled"
    assert batch["miss"][6] == pytest.approx(6.5 - 6.0, rel=1e-9)  # 1 + 2 + 3 m reach 6 m
    assert np.isnan(batch["y_eval"][6]).all()
    assert np.isnan(batch["max(theta_2)"][6])
    assert "1 not assembled" in batch.warnings[0]


def test_results_do_not_depend_on_threads_chunks_or_order(model, drawn, batch, method):
    start, params = drawn
    order = np.random.default_rng(0).permutation(13)
    turned = mechc.Assembly({"theta_0": start.coordinates["theta_0"][order]}, start.speeds)
    again = model.simulate_batch(
        2.0, turned, params | {"l_3": params["l_3"][order]}, t_eval=TIMES, reduce=REDUCTIONS,
        **by(method), threads=3, chunk=5,
    )  # fmt: skip
    for name, values in batch.arrays.items():
        assert np.array_equal(values[order], again[name], equal_nan=True), name


def test_reductions_are_those_of_the_dense_output(model, drawn, batch, method):
    _, params = drawn
    t = np.linspace(0, 2, 20_001)
    for member in np.flatnonzero(batch.ok):
        sol = model.simulate(2.0, batch["y0"][member], one(params, member), **by(method))
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


def test_outputs_are_reduced_and_kept(model, regular, method):
    params, start = regular
    asked = ("range(energy)", "max(norm(multipliers))", "max(abs(points[3, 1]))", "final(theta_0)")
    batch = model.simulate_batch(
        2.0, start, params, t_eval=TIMES, states=False, outputs=["points"], reduce=asked,
        **by(method),
    )  # fmt: skip
    sol = model.simulate(2.0, start, params, **by(method))
    y = sol(np.linspace(0, 2, 20_001))
    assert "y_eval" not in batch.arrays
    assert np.array_equal(batch["points"][0], model.points(sol(TIMES), params))
    assert batch["range(energy)"][0] < 1e-6
    reaction = np.linalg.norm(model.multipliers(y, params), axis=1).max()
    assert batch["max(norm(multipliers))"][0] == pytest.approx(reaction, rel=1e-5)
    height = np.abs(model.points(y, params)[:, 3, 1]).max()
    assert batch["max(abs(points[3,1]))"][0] == pytest.approx(height, abs=1e-6)
    assert batch["final(theta_0)"][0] == sol["theta_0"][-1]


def test_reductions_together_are_those_that_each_is_by_itself(model, drawn, method):
    """Quantities share what they look at; a run that ends at a crossing has looked beyond it."""
    start, params = drawn
    asked = (
        "range(energy)", "max(energy)", "mean(energy)", "first(kinetic_energy > 20)",
        "max(norm(multipliers))", "range(points[3, 1])",
    )  # fmt: skip
    for until in (None, "kinetic_energy > 25"):
        together = model.simulate_batch(2.0, start, params, reduce=asked, **by(method), until=until)
        for each in asked:
            alone = model.simulate_batch(2.0, start, params, reduce=each, **by(method), until=until)
            name = each.replace(" ", "")
            assert np.array_equal(alone[name], together[name], equal_nan=True), name


def test_a_reduction_may_be_a_pair_by_name(model, regular):
    params, start = regular
    single = model.simulate_batch(1.0, start, params, reduce=("max", "theta_2"))
    two = model.simulate_batch(1.0, start, params, reduce=("max(theta_2)", "min(theta_2)"))
    assert single["max(theta_2)"] == two["max(theta_2)"]
    assert two["min(theta_2)"] < two["max(theta_2)"]


def test_extremes_and_means_of_the_energies_are_those_of_the_motion(model, regular, method):
    params, start = regular
    asked = ("max(kinetic_energy)", "mean(kinetic_energy)", "range(energy)")
    batch = model.simulate_batch(5.0, start, params, reduce=asked, **by(method))
    sol = model.simulate(5.0, start, params, **by(method))
    t = np.linspace(0, 5, 50_001)
    kinetic = model.kinetic_energy(sol(t), params)
    energy = model.energy(sol(t), params)
    assert kinetic.max() - 1e-12 <= batch["max(kinetic_energy)"][0] <= kinetic.max() + 1e-5
    assert batch["mean(kinetic_energy)"][0] == pytest.approx(np.trapezoid(kinetic, t) / 5, rel=1e-7)
    assert np.ptp(sol.energy) <= batch["range(energy)"][0] <= 1.05 * np.ptp(energy)


def test_change_points_are_counted_and_warned_about_once(model, method):
    start = model.assemble({"theta_0": np.radians(85)})
    batch = model.simulate_batch(3.0, np.tile(start, (4, 1)), **by(method))
    sol = model.simulate(3.0, start, **by(method))
    assert (batch["change_points"] == len(sol.change_points)).all()
    assert len(sol.change_points) > 0
    assert len(batch.warnings) == 1
    stopped = model.simulate_batch(3.0, start, **by(method), on_change_point="stop")
    assert stopped.status(0).code == "stopped at a change point"


def test_a_start_that_is_open_or_not_finite_has_a_status(model, regular, method):
    params, start = regular
    starts = np.tile(start, (3, 1))
    starts[1, 1] += 1e-3
    starts[2, 4] = np.nan
    batch = model.simulate_batch(1.0, starts, params, **by(method))
    assert batch["status"].tolist() == [1, 111, 111]


def test_the_dataset_names_dimensions_and_parameters(batch, drawn):
    data = batch.to_xarray()
    assert dict(data.sizes) == {"member": 13, "state": 6, "time": 9}
    assert np.array_equal(data.l_3, drawn[1]["l_3"])
    assert data.l_3.attrs["units"] == "m"
    assert data["max_theta_2_"].attrs == {"long_name": "max(theta_2)", "units": "rad"}
    assert float(data.y.sel(state="omega_1")[0]) == batch.y[0, 4]


def test_a_crossing_ends_a_member_and_what_is_reduced_ends_with_it(model, drawn):
    start, params = drawn
    asked = {"reduce": ["max(theta_0)", "mean(theta_1)", "final(theta_0)"], "t_eval": TIMES}
    batch = model.simulate_batch(2.0, start, params, until="theta_0 > 100deg", **asked)
    assert batch.counts["stopped by an event"] > 0
    for member in np.flatnonzero(batch.ok):
        stop = mechc.Event("theta_0 > 100deg", terminal=True)
        sol = model.simulate(2.0, batch["y0"][member], one(params, member), events=stop)
        assert batch.status(member).code == sol.status.code
        end = sol.t[-1]
        assert batch.t[member] == pytest.approx(end, abs=1e-9)
        np.testing.assert_allclose(batch.y[member], sol.y[-1], atol=1e-7)
        known = end >= TIMES
        assert np.isfinite(batch["y_eval"][member][known]).all()
        assert np.isnan(batch["y_eval"][member][~known]).all()
        t = np.linspace(0, end, 20_001)
        y = sol(t)
        assert batch["max(theta_0)"][member] == pytest.approx(y[:, 0].max(), abs=1e-6)
        mean = np.trapezoid(y[:, 1], t) / end
        assert batch["mean(theta_1)"][member] == pytest.approx(mean, abs=1e-7)
        assert batch["final(theta_0)"][member] == batch.y[member, 0]


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
        ({"until": "max(theta_0)"}, "level"),
        ({"params": {"l_3": [3.5, 3.6], "m_1": [1.0, 2.0, 3.0]}}, "numbers of members differ"),
        ({"params": {"l_3": [3.5, -1.0]}}, "l_3"),
        ({"outputs": ["points"]}, "t_eval"),
        ({"on_change_point": "raise"}, "raises no error"),
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


def test_a_guess_chooses_the_assembly(model, method):
    theta, params = np.array([1.0, 1.2]), {"l_3": 3.5}
    guess = {"theta_1": -1.0}
    batch = model.simulate_batch(
        0.0, mechc.Assembly({"theta_0": theta}, guess=guess), params, **by(method)
    )
    for y, angle in zip(batch["y0"], theta, strict=True):
        alone = model.assemble({"theta_0": angle}, guess=guess, params=params)
        np.testing.assert_allclose(y, alone, atol=1e-13)


def test_ctrl_c_keeps_what_is_done(model, regular, monkeypatch, method):
    from mechc.batch import simulate as batch

    params, start = regular
    looks = itertools.count()

    def interrupt(self, done):
        if next(looks) == 2:
            raise KeyboardInterrupt

    monkeypatch.setattr(batch.CountBar, "update_count", interrupt)
    with pytest.raises(KeyboardInterrupt) as stopped:
        model.simulate_batch(
            1.0, np.tile(start, (40, 1)), params, **by(method), chunk=10, threads=2
        )
    cut = stopped.value.batch
    assert not cut.complete
    assert 0 < cut.counts["finished"] < 40
    assert cut.counts["not run"] == 40 - cut.counts["finished"]


# -- what auto takes ------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def pendulum():
    return mechc.load("pendulum")


@pytest.mark.parametrize(
    ("name", "rtol", "taken"),
    [
        ("four_bar", 1e-6, "dop853 in lockstep"),
        ("four_bar", 1e-9, "gauss8 in lockstep"),
        ("pendulum", 1e-6, "taylor in lockstep"),
        ("pendulum", 1e-9, "taylor in lockstep"),
    ],
)
def test_a_member_is_repeated_by_the_method_that_the_batch_took(name, rtol, taken):
    model = mechc.load(name)
    starts = np.array([model.assemble({"theta_0": 0.9 + 0.1 * i}) for i in range(9)])
    batch = model.simulate_batch(2.0, starts, rtol=rtol, progress=False)
    assert batch.method == taken
    for member in (0, 4, 8):
        sol = model.simulate(2.0, starts[member], rtol=rtol, method=batch.method)
        assert sol.method == taken
        np.testing.assert_array_equal(sol.y[-1], batch.y[member])
        np.testing.assert_array_equal(batch[member].y[-1], batch.y[member])
        exact = model.simulate(2.0, starts[member], rtol=1e-12).y[-1]
        np.testing.assert_allclose(batch.y[member], exact, rtol=0, atol=100 * rtol)


def test_beside_a_change_point_collocation_takes_over_from_the_pair():
    model = mechc.load("four_bar")
    start = model.assemble({"theta_0": "85deg"})
    names = {number: name for name, number in METHODS.items()}

    def taken(method):
        sol = model.simulate(3.0, start, rtol=1e-6, method=method)
        return [names[number] for number in sol.record.last.steps.methods()]

    methods = taken("dop853 in lockstep")
    first = methods.index("gauss8")
    assert set(methods[:first]) == {"dop853"}
    assert set(methods[first:]) <= {"gauss8", "dop853"}  # the pair bridges crossings
    assert methods[-1] == "gauss8"
    assert taken("dop853")[-1] == "dop853"


def test_members_with_sensitivities_are_runs_of_their_own(pendulum):
    model = mechc.load("pendulum", outputs=("sensitivities",))
    batch = model.simulate_batch(1.0, [[1.0, 0.0]], sensitivities=["y0"], progress=False)
    assert batch.method == "gauss8"


@pytest.mark.parametrize(
    ("method", "lockstep", "told"),
    [
        ("radau5 in lockstep", None, "no lockstep"),
        ("gauss8 in lockstep", False, "omit lockstep=False, or take 'gauss8'"),
        ("auto in lockstep", None, "take 'auto' and lockstep=True"),
        ("auto in lockstep", True, "take 'auto' and lockstep=True"),
    ],
)
def test_words_after_a_method_that_it_cannot_have_are_refused(pendulum, method, lockstep, told):
    for run, start in ((pendulum.simulate, [1.0, 0.0]), (pendulum.simulate_batch, [[1.0, 0.0]])):
        with pytest.raises(mechc.ValueOutOfBoundsError, match=told):
            run(1.0, start, method=method, lockstep=lockstep)


def test_the_name_of_a_method_in_lockstep_is_taken_by_every_run(pendulum):
    """By itself, step by step and with derivatives, where lockstep is not asked for otherwise."""
    method, start = "gauss8 in lockstep", np.array([1.0, 0.0])
    sol = pendulum.simulate(1.0, start, method=method)
    assert sol.method == method
    assert pendulum.simulate(1.0, start, method="gauss8").method == "gauss8"
    batch = pendulum.simulate_batch(1.0, start, method=method)
    np.testing.assert_array_equal(batch.y[0], sol.y[-1])
    stepper = pendulum.stepper(start, method=method)
    np.testing.assert_allclose(stepper.step(1.0), sol.y[-1], rtol=0, atol=1e-9)
    other = mechc.load("pendulum", outputs=("sensitivities",))
    found = other.simulate_batch(1.0, start, method=method, sensitivities=["y0"])
    assert found.method == method
