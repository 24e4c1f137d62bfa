"""``mechc sweep``: what varies, how it is drawn, what is told, written and drawn."""

import re
import tracemalloc

import numpy as np
import pytest
from sympy.physics.mechanics import dynamicsymbols

import mechc
from mechc.batch.sweeps.maps import _normalisation, draw_map
from mechc.batch.sweeps.sweep import members, plan, read_variation
from mechc.cli.commands import main
from tests.support.command_line import complaint, run_json

pytestmark = pytest.mark.usefixtures("here")
GRID = ("sweep", "four_bar", "--vary", "l_3=3.8:4.2:3", "--vary", "theta_0=60deg:120deg:4",
        "--t-end", "1", "--method", "gauss8", "--reduce", "max(theta_2)")  # fmt: skip


def test_a_grid_is_every_combination_and_json_writes_nothing(capsys, here):
    data = run_json(capsys, *GRID)
    assert data["members"] == 12
    assert data["shape"] == [3, 4]
    assert data["outcomes"] == {"finished": 12}
    assert data["vary"]["theta_0"] == pytest.approx([np.pi / 3, 2 * np.pi / 3])
    found = data["reductions"]["max(theta_2)"]
    model = mechc.load("four_bar")
    params = {"l_3": found["max_at"]["l_3"]}
    y0 = model.assemble({"theta_0": found["max_at"]["theta_0"]}, params=params)
    sol = model.simulate(1.0, y0, params, method="gauss8")
    assert found["max"] == pytest.approx(sol(np.linspace(0, 1, 5001))[:, 2].max(), abs=1e-6)
    assert list(here.iterdir()) == []


def test_it_writes_data_and_maps_and_goes_on_from_them(capsys, here):
    pytest.importorskip("zarr")
    assert main([*GRID, "--out", "found"]) == 0
    assert "12 members (3 x 4)" in capsys.readouterr().out
    assert {p.name for p in (here / "found").iterdir()} == {"batch", "map_0.png", "map_0.svg"}
    assert mechc.open(here / "found" / "batch")["max(theta_2)"].shape == (12,)
    assert main([*GRID, "--out", "found"]) == 0
    capsys.readouterr()
    assert main([*GRID, "--rtol", "1e-6", "--out", "found"]) == 2
    assert "rtol is 1e-09, not 1e-06" in capsys.readouterr().err


def test_a_sweep_that_was_stopped_goes_on_and_a_finished_one_is_kept(here, monkeypatch):
    pytest.importorskip("zarr")

    def interrupt(self, done):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr("mechc.batch.simulate.CountBar.update_count", interrupt)
        assert main([*GRID]) == 130
    for folders in (["mechc_sweep_four_bar"], ["mechc_sweep_four_bar", "mechc_sweep_four_bar_2"]):
        assert main([*GRID]) == 0
        assert sorted(path.name for path in here.iterdir()) == folders


@pytest.mark.parametrize("sampling", ["random", "sobol", "lhs"])
def test_drawn_members_fill_the_ranges_and_repeat_with_the_seed(sampling):
    model = mechc.load("four_bar")
    variations = [read_variation(model, "l_3=3.4:4.6"), read_variation(model, "m_1=1000g:3kg")]
    first, again, other = (plan(variations, sampling, 100, seed) for seed in (1, 1, 2))
    for name, low, high in (("l_3", 3.4, 4.6), ("m_1", 1.0, 3.0)):
        column = first.columns[name]
        assert column.shape == (100,)
        assert ((column >= low) & (column <= high)).all()
        assert column.min() < low + 0.1 * (high - low)
        assert column.max() > high - 0.1 * (high - low)
        assert np.array_equal(column, again.columns[name])
        assert not np.array_equal(column, other.columns[name])


@pytest.mark.parametrize(
    ("texts", "asked"),
    [
        (("l_3=3.4:4.6:1000", "m_1=1kg:3kg:300"), ()),
        (("l_3=3.4:4.6", "m_1=1kg:3kg"), ("lhs", 300_000)),
    ],
)
def test_a_plan_is_checked_before_its_members_take_memory(texts, asked):
    model = mechc.load("four_bar")
    variations = [read_variation(model, text) for text in texts]
    tracemalloc.start()
    chosen = plan(variations, *asked)
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert len(chosen) == 300_000
    assert most < 8 * len(chosen)  # bytes of one column
    assert {len(column) for column in chosen.columns.values()} == {300_000}


def legend(figure):
    return {text.get_text() for shown in figure.legends for text in shown.get_texts()}


def swept(model, chosen, t_end, reduction, **policy):
    starts, params = members(model.system, chosen, params={}, start={}, guess={})
    return model.simulate_batch(t_end, starts, params, reduce=reduction, **policy)


def test_the_map_shows_what_cannot_be_assembled_and_change_points():
    model = mechc.load("four_bar")
    chosen = plan([read_variation(model, text) for text in ("l_3=3:5:3", "theta_0=60deg:180deg:3")])
    batch = swept(model, chosen, 3.0, "max(theta_2)", method="gauss8")
    assert batch.counts["not assembled"] == 2  # l_3 = 5 m at 120 and 180 degrees
    assert (batch["change_points"] > 0).reshape(3, 3)[1].any()  # l_3 = 4 m
    figure = draw_map(batch, chosen, "max(theta_2)")
    assert legend(figure) >= {"cannot be assembled", "met a change point"}
    drawn = figure.axes[0].collections[0].get_array()
    np.testing.assert_allclose(
        np.ma.filled(drawn, np.nan).reshape(3, 3),
        np.degrees(np.where(batch.ok, batch["max(theta_2)"], np.nan)).reshape(3, 3),
    )


def test_a_grid_of_three_has_a_map_for_each_value_of_the_third():
    model = mechc.load("four_bar")
    varied = ("l_3=3.4:3.6:3", "theta_0=60deg:70deg:2", "m_1=1kg:2kg:4")
    chosen = plan([read_variation(model, text) for text in varied])
    batch = swept(model, chosen, 0.5, "max(theta_2)", method="gauss8")
    *maps, bar = draw_map(batch, chosen, "max(theta_2)").axes
    expected = np.degrees(batch["max(theta_2)"]).reshape(3, 2, 4)
    for k, axes in enumerate(maps):
        drawn = np.ma.filled(axes.collections[0].get_array(), np.nan)
        np.testing.assert_allclose(drawn.reshape(3, 2), expected[:, :, k])
        assert f"= {np.linspace(1, 2, 4)[k]:.4g} kg" in axes.get_title(loc="left")
    assert len(maps) == 4
    assert "max(theta_2)" in bar.get_ylabel()


def test_colours_span_the_members_that_met_no_change_point():
    """At l_3 = 4 m the reaction grows without bound, and says nothing of the others."""
    model = mechc.load("four_bar")
    chosen = plan([read_variation(model, v) for v in ("l_3=3.8:4.2:3", "theta_0=80deg:90deg:2")])
    reaction = "max(norm(multipliers))"
    batch = swept(model, chosen, 3.0, reaction, rtol=1e-8)
    met = batch["change_points"] > 0
    colours = draw_map(batch, chosen, reaction).axes[0].collections[0].norm
    assert met.any()
    assert colours.vmax == batch[reaction][~met].max() < 1e-3 * batch[reaction][met].max()


@pytest.mark.parametrize(
    ("values", "kind"),
    [
        ([1.0, 2.0, 900.0], "Normalize"),
        ([1.0, 2.0, 1001.0], "LogNorm"),
        ([-1.0, 0.0, 1.0, 2.0], "Normalize"),
        ([0.0, 1e-9, 1e-8, 1.0], "SymLogNorm"),
        ([-1e5, -2.0, 1e-7, 3.0, 4.0], "SymLogNorm"),
        ([0.0, 0.0], "Normalize"),
    ],
)
def test_a_scale_is_logarithmic_where_the_range_asks_for_it(values, kind):
    norm = _normalisation(np.array(values))
    assert type(norm).__name__ == kind
    assert (norm.vmin, norm.vmax) == (min(values), max(values))


def test_grey_without_a_value_is_in_the_legend():
    model = mechc.load("four_bar")
    chosen = plan([read_variation(model, v) for v in ("l_3=3.4:3.6:2", "theta_0=80deg:90deg:2")])
    batch = swept(model, chosen, 0.1, "mean(energy)", method="gauss8")
    batch["mean(energy)"][1] = np.nan
    assert legend(draw_map(batch, chosen, "mean(energy)")) == {"has no value"}


def test_what_is_printed_has_units_and_degrees(capsys):
    assert main([*GRID, "--out", "found"]) == 0
    printed = capsys.readouterr().out
    assert re.search(r"max\(theta_2\): -?[\d.]+° \.\.\. -?[\d.]+°", printed)
    assert re.search(r"largest at l_3 = [\d.]+ m, theta_0 = [\d.]+°", printed)


def test_one_variation_is_a_line_and_drawn_ones_are_points():
    model = mechc.load("four_bar")
    line = plan([read_variation(model, "l_3=3.4:3.6:5")])
    cloud = plan([read_variation(model, t) for t in ("l_3=3.4:3.6", "omega_0=0:1")], "lhs", 20)
    for chosen in (line, cloud):
        batch = swept(model, chosen, 0.5, "mean(energy)", method="gauss8")
        assert batch.ok.all()
        figure = draw_map(batch, chosen, "mean(energy)")
        assert figure.axes[0].has_data()
        assert legend(figure) == set()


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ((), "nothing varies"),
        (("--vary", "l_3=3.4:4.6"), "needs a count"),
        (("--vary", "l_3=3.4"), "LOW:HIGH:COUNT"),
        (("--vary", "l_3=3.4:4.6:0"), "not a count"),
        (("--vary", "l_3=3.4:nan:3"), "finite"),
        (("--vary", "l_3=-1:1:3"), "l_3"),
        (("--vary", "l_9=3.4:4.6:3"), "l_3"),
        (("--vary", "l_3=3.4:4.6:3", "--vary", "l_3=3.4:4.6:3"), "varies twice"),
        (("--vary", "l_3=3.4:4.6:3", "--set", "l_3=3.5"), "varies and is fixed"),
        (("--vary", "l_3=3.4:4.6:3", "--sample", "sobol"), "only a grid"),
        (("--vary", "l_3=3.4:4.6", "--sample", "dice"), "no sampling"),
        (("--vary", "l_3=3.4:4.6:3", "--count", "9"), "omit the count"),
        (("--vary", "l_3=3.4:4.6:3", "--reduce", "max(theta_2"), "not a reduction"),
        (("--vary", "l_3=1:2:99999", "--vary", "l_2=1:2:99999"), "too many"),
        (("--vary", "l_3=3.4:4.6:3", "--threads", "some"), "whole number"),
    ],
)
def test_bad_input_is_one_line_and_exit_code_2(capsys, options, words):
    assert words in complaint(capsys, "sweep", "four_bar", "--json", *options)


# -- in Python --------------------------------------------------------------------------------


def test_a_sweep_in_python_is_that_of_the_shell(capsys, model):
    vary = {"l_3": (3.8, "4200 mm", 3), "theta_0": ("60deg", "120deg", 4)}
    found = model.sweep(1, vary, method="gauss8", reduce="max(theta_2)", progress=False)
    told = found.to_json()
    shell = run_json(capsys, *GRID)
    for name in ("wall_s", "members_per_s"):
        del told[name], shell[name]
    assert told == shell
    assert found["max(theta_2)"].shape == (3, 4)
    assert found["max(theta_2)"][2, 1] == found.batch["max(theta_2)"][9]
    assert found[dynamicsymbols("steps")].shape == (3, 4)
    np.testing.assert_array_equal(found[9].y[-1], found.batch.y[9])
    assert "12 members (3 x 4)" in str(found)
    assert repr(found) == (
        "<mechc.Sweep of l_3, theta_0: <mechc.Batch of four_bar: 12 members, 12 finished>>"
    )


def test_a_sweep_takes_texts_values_for_all_and_draws(model, here):
    found = model.sweep(
        0.5, ["l_3=3.4:3.6"], {"m_1": "2500 g"}, sample="lhs", count=8, seed=3,
        start={"theta_0": "80deg"}, progress=False,
    )  # fmt: skip
    assert found["max(theta_2)"].shape == (8,)
    assert found.batch.y0[:, 0] == pytest.approx(np.radians(80))
    assert found.batch[0].params[model.parameters.index("m_1")] == 2.5
    assert [path.name for path in found.save_maps(here)] == ["map_0.png", "map_0.svg"]
    assert found.plot().axes


@pytest.mark.parametrize(
    ("vary", "told"),
    [
        ({}, "nothing varies"),
        ({"l_3": 3.5}, "l_3 varies over .low, high."),
        ({"l_3": (3.4, 3.6)}, "a grid needs a count"),
        ({"l_3": (3.4, "3deg", 2)}, "'deg' in '3deg'"),
        ({"l_9": (3.4, 3.6, 2)}, "did you mean"),
        ({"l_3": (3.4, 3.6, 2.5j)}, "not a count"),
        ({"theta_0": ("60", "120", 3)}, "for degrees write 60deg"),
    ],
)
def test_wrong_ranges_are_told_in_words(model, vary, told):
    with pytest.raises(mechc.MechcError, match=told):
        model.sweep(1.0, vary)


def test_ctrl_c_in_a_sweep_has_what_was_computed(model, monkeypatch):
    def interrupt(self, done):
        if done > 0:
            raise KeyboardInterrupt

    monkeypatch.setattr("mechc.batch.simulate.CountBar.update_count", interrupt)
    with pytest.raises(mechc.RunInterrupt) as stopped:
        model.sweep(200.0, {"l_3": (3.4, 3.6, 2000)}, threads=1)
    assert stopped.value.sweep.batch is stopped.value.batch
    assert "not run" in str(stopped.value.sweep)
