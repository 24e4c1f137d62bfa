"""Members of a batch as motions, and a batch as a table."""

import pickle

import numpy as np
import pytest

import mechc

START = mechc.Assembly({"theta_0": np.linspace(0.9, 1.5, 5)})
LENGTHS = {"l_3": [3.5, 3.6, 3.4, 3.5, 9.0]}  # the last does not close


@pytest.fixture(scope="module")
def batch(model):
    return model.simulate_batch(1.0, START, LENGTHS, reduce=["max(theta_2)"])


@pytest.mark.parametrize(
    "options",
    [
        {"method": "gauss8", "lockstep": True},
        {"method": "dop853"},
        {"events": [mechc.Event("theta_0 > 2", terminal=True)]},
        {"events": [lambda t, y: y[0] - 2.0]},
    ],
    ids=["lockstep", "dop853", "an event", "a function"],
)
def test_a_member_is_the_motion_to_the_last_bit(model, options):
    batch = model.simulate_batch(1.0, START, LENGTHS, **options)
    for number in range(4):
        sol = batch[number]
        assert np.array_equal(sol.y[-1], batch.y[number])
        assert sol.status.code == batch.status(number).code
        assert sol.stats["steps"] == batch.steps[number]
        assert sol.params[3] == LENGTHS["l_3"][number]
        assert sol.model is model


def test_a_member_ends_where_until_ended_it(model):
    batch = model.simulate_batch(3.0, START, LENGTHS, until="theta_0 > 100deg")
    sol = batch[3]
    assert sol.t[-1] == batch.t[3] < 3.0
    assert sol["theta_0"][-1] == pytest.approx(np.radians(100), abs=1e-9)


def test_members_have_their_own_inputs(pushed):
    forces = np.array([1.0, 2.0])
    signal = mechc.Signal([0.0, 2.0], [0.0, 1.0], "linear")
    batch = pushed.simulate_batch(1.0, [0.0, 0.0], inputs={"F": forces})
    assert np.array_equal(batch[1].y[-1], batch.y[1])
    controllers = [mechc.Sampled(lambda t, k=k: k, 0.1) for k in (1.0, 3.0)]
    for inputs in ({"F": signal}, {"F": lambda t: 2.0 * t}, {"F": controllers}):
        batch = pushed.simulate_batch(1.0, [0.0, 0.0], inputs=inputs)
        assert np.array_equal(batch[-1].y[-1], batch.y[-1])


def test_a_loop_goes_over_the_motions(batch):
    motions = iter(batch)
    assert next(motions).t[-1] == 1.0
    assert len(batch) == 5
    assert np.array_equal([sol.y[-1] for _, sol in zip(range(4), batch, strict=False)], batch.y[:4])


def test_a_coordinate_by_name_is_told_where_it_is(batch):
    with pytest.raises(mechc.UnknownNameError, match=r"batch\.y\[:, 1\] at the end"):
        batch["theta_1"]


def test_what_is_no_member_is_refused_in_words(batch):
    with pytest.raises(mechc.MechcError, match="member 4 has no motion: not assembled"):
        batch[4]
    with pytest.raises(IndexError, match="the batch has 5 members"):
        batch[5]
    with pytest.raises(TypeError, match="one member"):
        batch[1:3]


def test_members_of_a_folder_are_known(model, tmp_path):
    pytest.importorskip("zarr")
    options = {"reduce": ["max(theta_2)"], "method": "gauss8"}
    batch = model.simulate_batch(1.0, START, LENGTHS, **options, out=tmp_path / "kept")
    again = mechc.open(tmp_path / "kept")
    assert np.array_equal(again[2].y, batch[2].y)
    event = {"events": [mechc.Event("theta_0 > 2")]}
    model.simulate_batch(1.0, START, LENGTHS, **event, out=tmp_path / "events")
    with pytest.raises(mechc.MechcError, match="events of a batch that was read"):
        mechc.open(tmp_path / "events")[0]


def test_a_batch_with_functions_can_be_sent_without_them(pushed):
    batch = pushed.simulate_batch(1.0, [0.0, 0.0], inputs={"F": lambda t: t})
    assert np.array_equal(pickle.loads(pickle.dumps(batch)).y, batch.y)


def test_a_table_has_a_row_a_member(batch):
    table = batch.to_dataframe()
    assert list(table.columns[:5]) == ["l_3", "theta_0", "status", "t", "max(theta_2)"]
    assert list(table.status) == ["finished"] * 4 + ["not assembled"]
    np.testing.assert_array_equal(table.theta_2_end, batch.y[:, 2])
    np.testing.assert_array_equal(table.steps, batch.steps)
    assert list(table[table.l_3 < 3.55].index) == [0, 2, 3]


def test_the_options_are_those_of_help(model):
    import inspect

    shown = inspect.signature(model.simulate_batch).parameters
    assert {"rtol", "reduce", "until", "out", "threads"} <= {*shown}
    swept = inspect.signature(model.sweep).parameters
    assert {*shown} - {"y0"} <= {*swept}
    for signature in (shown, swept, inspect.signature(model.widget).parameters):
        assert not any(one.kind is one.VAR_KEYWORD for one in signature.values())


def test_histograms_count_the_members_that_reached_the_end():
    model = mechc.load("four_bar")
    starts = mechc.Assembly({"theta_0": np.linspace(1.0, 2.0, 40)})
    lengths = {"l_3": np.where(np.arange(40) < 5, 9.0, 3.5)}  # five cannot be assembled
    batch = model.simulate_batch(1.0, starts, lengths, reduce=["max(theta_2)"], progress=False)
    figure = batch.plot()
    (axes,) = figure.axes
    bars = axes.patches
    assert sum(bar.get_height() for bar in bars) == 35
    ends = np.degrees(batch["max(theta_2)"][5:])
    assert (bars[0].get_x(), bars[-1].get_x() + bars[-1].get_width()) == pytest.approx(
        (ends.min(), ends.max())
    )
    assert axes.get_xlabel().endswith("[°]")
    assert "35 finished" in figure.get_suptitle()
    assert len(batch.plot("theta_0", "omega_1", "max(theta_2)").axes) == 3
    plain = model.simulate_batch(1.0, starts, {"l_3": 3.5}, progress=False)
    assert [a.get_xlabel().partition(" at the end")[1] for a in plain.plot().axes] == [
        " at the end"
    ] * 3
    with pytest.raises(mechc.UnknownNameError, match="'max"):
        batch.plot("max(theta_1)")


def test_a_table_of_members_is_described_without_a_warning():
    """Members that met no critical configuration have no gap, which is NaN."""
    model = mechc.load("four_bar")
    starts = mechc.Assembly({"theta_0": np.linspace(1.0, 2.0, 100)})
    batch = model.simulate_batch(1.0, starts, progress=False)
    assert np.isinf(batch["critical_gap"]).any()
    table = batch.to_dataframe()
    np.testing.assert_array_equal(table["critical_gap"].isna(), np.isinf(batch["critical_gap"]))
    assert table.describe().loc["max", "critical_gap"] == np.nanmax(table["critical_gap"])
