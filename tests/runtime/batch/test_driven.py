"""Inputs given with a batch: every member as it runs alone, to the last bit."""

import pickle

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

import mechc
from tests.support import LOCKSTEP, by

METHODS = ("dopri5", "dop853", "gauss8", LOCKSTEP, "radau5")
TIMES = np.array([0.0, 0.4, 0.5, 1.3, 2.0, 3.1])
VALUES = np.array([1.0, -2.0, 0.5, 0.5, 3.0, -1.0])
END, COUNT = 3.0, 7
AT = np.array([0.0, 0.4, 0.5, 0.77, 2.0, 3.0])
STARTS = np.column_stack([np.linspace(-1, 1, COUNT), np.linspace(0.5, -0.3, COUNT)])


def alone(model, k, force, method, stiffness):
    params = {"k": stiffness[k]}
    return model.simulate(
        END, STARTS[k], params, inputs={"F": force}, **by(method), rtol=1e-8, t_eval=AT
    )


def power_of(sol):
    return sol.model.output("power", sol.y, sol.params, sol.t)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("kind", ["previous", "linear", "cubic"])
def test_members_with_a_signal_are_the_runs_of_their_own(pushed, method, kind):
    signal, stiffness = mechc.Signal(TIMES, VALUES, kind), np.linspace(0.5, 9.0, COUNT)
    batch = pushed.simulate_batch(
        END, STARTS, {"k": stiffness}, inputs={"F": signal}, **by(method), rtol=1e-8, t_eval=AT,
        outputs=["power"], threads=2,
    )  # fmt: skip
    assert batch.ok.all()
    for k in range(COUNT):
        sol = alone(pushed, k, signal, method, stiffness)
        np.testing.assert_array_equal(batch["y_eval"][k], sol.y)
        np.testing.assert_array_equal(batch["power"][k], power_of(sol))
        assert batch["steps"][k] == sol.stats["steps"]


@pytest.mark.parametrize("method", METHODS)
def test_members_have_numbers_of_their_own(pushed, method):
    forces, stiffness = np.linspace(-3.0, 5.0, COUNT), np.linspace(0.5, 9.0, COUNT)
    batch = pushed.simulate_batch(
        END, STARTS, {"k": stiffness}, inputs={"F": forces}, **by(method), rtol=1e-8, t_eval=AT,
        outputs=["power"], reduce=["max(power)"], threads=2,
    )  # fmt: skip
    for k in range(COUNT):
        sol = alone(pushed, k, float(forces[k]), method, stiffness)
        np.testing.assert_array_equal(batch["y_eval"][k], sol.y)
        np.testing.assert_array_equal(batch["power"][k], power_of(sol))
        assert batch["max(power)"][k] >= power_of(sol).max() - 1e-12
    np.testing.assert_array_equal(batch.to_xarray()["F"], forces)


def test_a_long_run_is_cut_into_pieces_without_a_trace(pushed):
    """Many steps between the kinks, and kinks just after states were dropped."""
    times = np.linspace(0.0, 40.0, 23) ** 1.01
    signal = mechc.Signal(times, np.sin(times), "linear")
    batch = pushed.simulate_batch(
        40.0, STARTS, {"k": 30.0}, inputs={"F": signal}, method="dopri5", rtol=1e-9
    )
    for k in (0, 3, 6):
        sol = pushed.simulate(
            40.0, STARTS[k], {"k": 30.0}, inputs={"F": signal}, method="dopri5", rtol=1e-9
        )
        assert sol.stats["steps"] > 300
        np.testing.assert_array_equal(batch.y[k], sol.y[-1])


def test_a_crossing_ends_a_member_in_any_segment(pushed):
    signal = mechc.Signal([0.0, 1.0, 2.0, 3.0], [1.0, -12.0, 6.0, 0.0], "previous")
    batch = pushed.simulate_batch(
        END, [[0.0, 1.0], [0.0, 20.0]], {"k": 0.0}, inputs={"F": signal}, until="q < 0.5"
    )
    assert batch.status(0).code == "stopped by an event"
    s = (1.5 + np.sqrt(1.5**2 + 4 * 3 * 0.75)) / 6  # 1.25 + 1.5 s - 3 s^2 = 0.5, from 1 s on
    assert batch.t[0] == pytest.approx(1.0 + s, abs=1e-9)
    assert batch.status(1).code == "finished"


def test_batches_with_inputs_are_kept_in_files_and_pickled(pushed, tmp_path):
    pytest.importorskip("zarr")
    forces = np.linspace(-3.0, 5.0, COUNT)
    options = {"inputs": {"F": forces}, "rtol": 1e-6}
    batch = pushed.simulate_batch(1.0, STARTS, {"k": 1.0}, **options)
    pushed.simulate_batch(1.0, STARTS, {"k": 1.0}, out=tmp_path / "kept", **options)
    again = mechc.open(tmp_path / "kept", pushed)
    np.testing.assert_array_equal(again.y, batch.y)
    np.testing.assert_array_equal(again.recipe.inputs.numbers["F"], forces)
    np.testing.assert_array_equal(pickle.loads(pickle.dumps(batch)).y, batch.y)


def ramp(t):
    return 10.0 * t


@pytest.mark.parametrize("force", [ramp, mechc.Sampled(ramp, 0.1)])
def test_a_pickled_batch_repeats_no_member_with_inputs_of_the_model_instead(pushed, force):
    """Functions are not pickled: the model's own constant input was taken in their place."""
    model = pushed.with_inputs({"F": 0.0})
    batch = model.simulate_batch(1.0, STARTS, {"k": 1.0}, inputs={"F": force})
    np.testing.assert_array_equal(batch[2].y[-1], batch.y[2])
    again = pickle.loads(pickle.dumps(pickle.loads(pickle.dumps(batch))))
    np.testing.assert_array_equal(again.y, batch.y)
    with pytest.raises(mechc.MechcError, match=r"^F: inputs that are functions"):
        again.member(2)


def test_a_pickled_batch_has_the_functions_that_its_model_is_driven_by(pushed):
    batch = pushed.with_inputs({"F": ramp}).simulate_batch(1.0, STARTS, {"k": 1.0})
    again = pickle.loads(pickle.dumps(batch))
    np.testing.assert_array_equal(again[2].y[-1], batch.y[2])


@pytest.mark.parametrize("kind", ["previous", "cubic", "interpolant"])
def test_signals_are_kept_in_folders(pushed, tmp_path, kind):
    """To the last bit; an interrupted call goes on, another signal is another request."""
    pytest.importorskip("zarr")
    signal = mechc.Signal(TIMES, VALUES, kind, outside="hold") if kind != "interpolant" else None
    signal = signal or CubicSpline(TIMES, VALUES)
    options = {"inputs": {"F": signal}, "rtol": 1e-6, "chunk": 2, "out": tmp_path / "kept"}
    batch = pushed.simulate_batch(3.0, STARTS, {"k": 1.0}, inputs={"F": signal}, rtol=1e-6)
    pushed.simulate_batch(3.0, STARTS, {"k": 1.0}, **options)
    next((tmp_path / "kept" / "mechc").glob("*2*.json")).unlink()  # a chunk that was not finished
    assert (pushed.simulate_batch(3.0, STARTS, {"k": 1.0}, **options).y == batch.y).all()
    again = mechc.open(tmp_path / "kept", pushed)
    np.testing.assert_array_equal(again.y, batch.y)
    kept = again.recipe.inputs.signals["F"]
    np.testing.assert_array_equal(kept(np.linspace(0, 3, 50)), batch.recipe.inputs.signals["F"](
        np.linspace(0, 3, 50)))  # fmt: skip
    options["inputs"] = {"F": mechc.Signal(TIMES, VALUES + 1e-9)}
    with pytest.raises(mechc.MechcError, match="another request: signals"):
        pushed.simulate_batch(3.0, STARTS, {"k": 1.0}, **options)
    held = tmp_path / "kept" / "mechc" / "inputs.json"
    held.write_text(held.read_text().replace('"smoothness": ', '"smoothness": 1'))
    with pytest.raises(mechc.MechcError, match="is damaged"):
        mechc.open(tmp_path / "kept", pushed)


@pytest.mark.parametrize(
    ("inputs", "told"),
    [
        ({}, "no value: F"),
        ({"G": 1.0}, "'G'"),
        ({"F": [1.0, np.nan]}, "F must be a finite number"),
        ({"F": [1.0, 2.0]}, r"numbers of members differ: F \(2\), y0 \(7\)"),
        ({"F": (TIMES[:3], VALUES[:3])}, r"sampled from 0 to 0.5 s, but is needed at 3 s"),
    ],
)
def test_inputs_that_a_batch_cannot_have_are_refused(pushed, inputs, told):
    with pytest.raises(mechc.MechcError, match=told):
        pushed.simulate_batch(END, STARTS, inputs=inputs)
