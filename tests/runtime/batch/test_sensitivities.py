"""Sensitivities in batches: every member has those of the run of its own."""

import numpy as np
import pytest

import mechc
from tests.runtime.sensitivities.test_loops import REGULAR, bar
from tests.runtime.sensitivities.test_run import GIVEN, T, swing

__all__ = ["bar", "swing"]  # compiled scenes of other tests
pytestmark = pytest.mark.slow  # compiles much
AT = np.array([0.0, 0.4, 1.3, T])
COUNT = 5
STARTS = np.column_stack([np.linspace(-1, 1, COUNT), np.linspace(0.5, -0.3, COUNT)])


def compared(batch, member, sol, names):
    for k, name in enumerate(names):
        found = sol.sensitivity[name]
        np.testing.assert_array_equal(batch["sensitivity"][member, ..., k], found)
        np.testing.assert_array_equal(batch["sensitivity_final"][member, :, k], found[-1])
        largest = np.abs(found).max(axis=0)
        np.testing.assert_array_equal(batch["sensitivity_max"][member, :, k], largest)


@pytest.mark.parametrize("method", ["gauss8", "dop853"])
def test_members_with_parameters_and_inputs_of_their_own(swing, method):
    lengths, forces = np.linspace(0.5, 1.2, COUNT), np.linspace(-1.0, 1.0, COUNT)
    by, policy = ["l", "c", "F"], {"method": method, "t_eval": AT, "rtol": 1e-8}
    batch = swing.simulate_batch(
        T, STARTS, {"l": lengths}, inputs={"F": forces}, sensitivities=by, threads=2, **policy
    )
    for k in range(COUNT):
        sol = swing.simulate(
            T, STARTS[k], {"l": lengths[k]}, inputs={"F": forces[k]}, sensitivities=by, **policy
        )
        compared(batch, k, sol, by)
        np.testing.assert_array_equal(batch["y_eval"][k], sol.y)


def test_with_error_control_of_their_own(swing):
    """Of a member at rest, whose motion alone would let steps be long."""
    by, rest = ["q", "F"], {"q": -np.pi / 2, "u": np.array([0.0, 0.4])}
    policy = {"inputs": {"F": 0.0}, "t_eval": [1.0, 10.0], "sensitivities": by, "method": "dop853",
              "sensitivity_error_control": True}  # fmt: skip
    batch = swing.simulate_batch(10.0, rest, GIVEN, **policy)
    for k, u in enumerate(rest["u"]):
        compared(batch, k, swing.simulate(10.0, rest | {"u": u}, GIVEN, **policy), by)


def test_members_with_a_signal(swing):
    values = np.array([0.3, -0.8, 0.5, 0.9])
    torque = mechc.Signal(np.linspace(0.0, T, 4), values, "linear")
    by = ["F[1]", "l"]
    batch = swing.simulate_batch(
        T, STARTS, GIVEN, inputs={"F": torque}, sensitivities=by, t_eval=AT
    )
    sol = swing.simulate(T, STARTS[3], GIVEN, inputs={"F": torque}, sensitivities=by, t_eval=AT)
    compared(batch, 3, sol, by)


def test_members_that_are_assembled(bar):
    angles, masses = np.array([1.2, 1.4, 1.5]), np.array([1.0, 2.0, 2.5])
    by = ["theta_0", "m_1", "l_3"]
    start = {"theta_0": angles, "omega_0": 0.3}
    params = REGULAR | {"m_1": masses}
    batch = bar.simulate_batch(1.0, start, params, t_eval=[0.3, 1.0], sensitivities=by)
    for k in range(3):
        sol = bar.simulate(
            1.0, start | {"theta_0": angles[k]}, params | {"m_1": masses[k]}, t_eval=[0.3, 1.0],
            sensitivities=by,
        )  # fmt: skip
        compared(batch, k, sol, by)


def test_past_change_points_lengths_have_none(bar):
    start = {"theta_0": np.radians([85.0, 80.0])}
    batch = bar.simulate_batch(2.0, start, sensitivities=["l_3", "m_1"])
    assert np.isnan(batch["sensitivity_final"][..., 0]).all()
    assert np.isfinite(batch["sensitivity_final"][..., 1]).all()
    assert any("2 members have no derivative" in told for told in batch.warnings)


def test_they_are_labelled(swing):
    batch = swing.simulate_batch(
        T, STARTS, GIVEN, inputs={"F": 0.3}, sensitivities=["l", "c"], t_eval=AT
    )
    data = batch.to_xarray()
    assert data["sensitivity"].dims == ("member", "time", "state", "by")
    one = data["sensitivity_final"].sel(member=2, state="q", by="c")
    assert float(one) == batch["sensitivity_final"][2, 0, 1]


def test_by_every_component_of_a_whole_start(bar):
    """Of a closed loop, where a start is moved to the nearest one that closes it."""
    y0 = bar.assemble({"theta_0": 1.4}, {"omega_0": 0.3}, params=REGULAR)
    batch = bar.simulate_batch(0.5, np.stack([y0, y0]), REGULAR, sensitivities=["l_3", "y0"])
    sol = bar.simulate(0.5, y0, REGULAR, sensitivities=["y0", "l_3", "y0[4]"])
    wanted = np.column_stack([sol.sensitivity["l_3"][-1], sol.sensitivity["y0"][-1]])
    np.testing.assert_array_equal(batch["sensitivity_final"], [wanted, wanted])
    np.testing.assert_array_equal(sol.sensitivity["y0[4]"], sol.sensitivity["y0"][..., 4])
    assert batch.to_xarray()["by"].values.tolist() == ["l_3", *(f"y0[{k}]" for k in range(6))]


def test_they_are_streamed_to_a_folder(swing, tmp_path):
    """Chunk by chunk; a folder is opened with them, and resumed for the same names only."""
    pytest.importorskip("zarr")

    def batch(by, **policy):
        given = {"inputs": {"F": 0.3}, "t_eval": AT, "sensitivities": by}
        return swing.simulate_batch(T, STARTS, GIVEN, **given, **policy)

    kept, folder = batch(["l", "c"]), tmp_path / "batch"
    batch(["l", "c"], out=folder, chunk=3)
    found = mechc.open(folder, swing)
    for name in ("sensitivity", "sensitivity_final", "sensitivity_max"):
        np.testing.assert_array_equal(found[name], kept[name])
    assert found.to_xarray()["sensitivity"].dims == ("member", "time", "state", "by")
    with pytest.raises(mechc.MechcError, match="sensitivities"):
        batch(["l"], out=folder, chunk=3)


def test_what_is_refused_is_named(swing):
    def batch(**policy):
        return swing.simulate_batch(T, STARTS, GIVEN, inputs={"F": 0.3}, **policy)

    with pytest.raises(mechc.UnknownNameError, match="mass"):
        batch(sensitivities=["mass"])
    with pytest.raises(mechc.ValueOutOfBoundsError, match=r"y0\[2\]: a state has 2 components"):
        batch(sensitivities=["y0[2]"])
    with pytest.raises(mechc.ValueOutOfBoundsError, match="until="):
        batch(sensitivities=["l"], until="q < 0")
