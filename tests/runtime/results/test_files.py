"""A solution as a table, as files and as HTML: complete, read back, and safe with any name."""

import csv
import json
import sys
from dataclasses import replace
from html.parser import HTMLParser
from types import SimpleNamespace

import numpy as np
import pytest

import mechc
from mechc.errors import MechcError, ValueOutOfBoundsError
from mechc.results import files as storage
from mechc.results import summary as report
from mechc.system.reference import ModelReference
from tests.support import fake_linkage

NAMES = ("theta_0", "theta_1", "theta_2", "omega_0", "omega_1", "omega_2")
HOSTILE = (
    "</script><img src=x onerror=alert(1)>", "$\\frac", "a/b", '"quoted", \'too\'', "=1+1", "名前",
    "time", "float", "1st", "", "x" * 400, "two\nlines",
)  # fmt: skip


@pytest.fixture
def hostile(sol):
    """The solution, with coordinates and speeds called anything."""
    names = HOSTILE[:3], HOSTILE[3:6]
    units = dict.fromkeys(HOSTILE, "rad") | dict(sol.model.units)
    stand_in = SimpleNamespace(
        name=HOSTILE[0], title=HOSTILE[0], coordinates=names[0], speeds=names[1], units=units,
        quantities=fake_linkage.quantities(units), gap_unit="m",
        parameters=sol.model.parameters, defaults=sol.model.defaults,
        reference=ModelReference(HOSTILE[0], custom=True, key=64 * "0", state=HOSTILE[:6]),
        constraint_names=sol.model.constraint_names, knows_energy=True, driven=None,
    )  # fmt: skip
    columns = dict(zip((*names[0], *names[1]), sol.y.T, strict=True))

    class Renamed:
        model = system = stand_in
        status = replace(sol.status, warnings=(HOSTILE[0],))

        def __getattr__(self, name):
            return getattr(sol, name)

        def __getitem__(self, name):
            return columns[name]

        def __call__(self, t):
            return sol(t)

    return Renamed()


def test_the_dataset_holds_everything_over_time(sol):
    data = sol.to_xarray()
    assert set(data.data_vars) == {*NAMES, "energy", "closure", "velocity_closure"}
    np.testing.assert_array_equal(data["time"], sol.t)
    for name in NAMES:
        np.testing.assert_array_equal(data[name], sol[name])
        assert data[name].attrs["units"] == sol.model.units[name]
    np.testing.assert_array_equal(data["energy"], sol.energy)
    assert "finished" in data.attrs["status"]
    assert data.sel(time=2.0)["theta_0"].item() == sol["theta_0"][-1]


def same(again, sol):
    np.testing.assert_array_equal(again.t, sol.t)
    np.testing.assert_allclose(again.y, sol.y, rtol=0, atol=1e-9)
    np.testing.assert_array_equal(again.params, sol.params)
    assert again.status == sol.status
    assert again.model.name == sol.model.name
    assert str(again.policy) == str(sol.policy._replace(dense=True))
    middle = (sol.span[0] + sol.span[1]) / 2
    assert again(middle).shape == (6,)


@pytest.mark.parametrize(
    "policy",
    [
        pytest.param({}, id="as it comes"),
        pytest.param({"rtol": 1e-6, "method": "dopri5"}, id="another method"),
        pytest.param({"atol": 1e-8, "first_step": 1e-3, "max_step": 0.1}, id="steps chosen"),
        pytest.param({"t_eval": np.linspace(0.0, 2.0, 9)}, id="times chosen"),
        pytest.param({"dense": False}, id="not dense"),
        pytest.param({"method": "radau5", "rtol": 1e-6}, id="an implicit method"),
        pytest.param({"on_change_point": "raise"}, id="no change point allowed"),
        pytest.param({"max_steps": 30}, id="cut short"),
        pytest.param({"max_steps": 30, "t_eval": np.linspace(0, 2, 99)}, id="times cut short"),
    ],
)
def test_what_was_saved_opens_again(model, regular, tmp_path, policy):
    params, start = regular
    sol = model.simulate((0, 2), start, params, **policy)
    path = sol.save(tmp_path / "run.nc")
    same(mechc.open(path), sol)
    same(mechc.open(str(path)), sol)


def test_a_contact_that_lasts_in_a_run_by_another_method_opens_again(model, tmp_path):
    start = model.assemble({"theta_0": 1.2})
    sol = model.simulate(1, start, events=[mechc.Stop("2 - theta_0")], method="gauss8")
    assert sol.segments[-1].contacts == ("held",)
    same(mechc.open(sol.save(tmp_path / "run.nc")), sol)


@pytest.mark.parametrize("on_change_point", ["continue", "stop"])
def test_a_run_through_a_change_point_opens_again(model, tmp_path, on_change_point):
    start = model.assemble({"theta_0": np.radians(85)})
    sol = model.simulate((0, 1), start, on_change_point=on_change_point)
    assert len(sol.change_points) == 1
    again = mechc.open(sol.save(tmp_path / "run.nc"))
    assert again.status == sol.status
    np.testing.assert_array_equal(again.t, sol.t)
    np.testing.assert_allclose(again.y, sol.y, rtol=0, atol=1e-7)


def test_files_that_are_no_saved_solutions_are_refused(tmp_path, sol):
    path = tmp_path / "other.nc"
    path.write_bytes(b"CDF\x01 and then nothing")
    with pytest.raises(MechcError, match=r"other\.nc"):
        mechc.open(path)
    path.write_text("t,y\n0,1\n")
    with pytest.raises(MechcError, match=r"other\.nc"):
        mechc.open(path)
    sol.to_xarray().drop_attrs().to_netcdf(path, engine="scipy")
    with pytest.raises(MechcError, match=r"other\.nc"):
        mechc.open(path)
    with pytest.raises(FileNotFoundError):
        mechc.open(tmp_path / "missing.nc")


@pytest.mark.parametrize(
    "change",
    [
        {"y0": [0.0]},
        {"y0": "here"},
        {"params": [1.0]},
        {"params": [-1.0] * 11},
        {"span": [0.0]},
        {"span": [0.0, None]},
        {"mechanism": "../four_bar"},
        {"mechanism": ["four_bar"]},
        {"options": {"crank_torque": "__import__('os').getpid()"}},
        {"options": {"wheels": True}},
        {"options": None},
        {"policy": {"method": "dop853"}},
        {"policy": None},
        {"state": None},
        {"state": ["closure"]},
        {"status": {}},
        {"format": 99},
        {"custom": True},
    ],
    ids=str,
)
def test_a_tampered_file_is_refused_by_name(tmp_path, sol, change):
    """A file is somebody's input: nothing in it is trusted to have the right size or kind."""
    data = sol.to_xarray()
    data.attrs["mechc"] = json.dumps(json.loads(data.attrs["mechc"]) | change)
    data.attrs["sha256"] = storage.digest(data)
    path = tmp_path / "tampered.nc"
    data.to_netcdf(path, engine="scipy")
    with pytest.raises(MechcError, match=r"tampered\.nc"):
        mechc.open(path)


def test_a_saved_motion_that_comes_out_different_is_refused(tmp_path, sol):
    data = sol.to_xarray()
    data["theta_1"] = data["theta_1"] + 1e-3
    data.attrs["sha256"] = storage.digest(data)
    data.to_netcdf(tmp_path / "other.nc", engine="scipy")
    with pytest.raises(MechcError, match="differs from the one saved"):
        mechc.open(tmp_path / "other.nc")


def test_csv_has_units_in_its_header_and_every_digit(tmp_path, sol):
    path = sol.save(tmp_path / "run.csv")
    with path.open(newline="", encoding="utf-8") as file:
        header, *rows = csv.reader(file)
    assert header[:3] == ["t [s]", "theta_0 [rad]", "theta_1 [rad]"]
    assert header[-3:] == ["energy [J]", "closure [m]", "velocity closure [m/s]"]
    table = np.array(rows, dtype=float)
    np.testing.assert_array_equal(table[:, 0], sol.t)
    np.testing.assert_array_equal(table[:, 1:7], sol.y)
    np.testing.assert_array_equal(table[:, 7], sol.energy)


def test_other_endings_are_refused(tmp_path, sol):
    for name in ("run.xlsx", "run", "run.nc.gz"):
        with pytest.raises(ValueOutOfBoundsError, match=r"end it in \.nc or \.csv"):
            sol.save(tmp_path / name)


def test_hostile_names_survive_csv_and_are_no_formula(tmp_path, hostile):
    path = storage.save(hostile, tmp_path / "run.csv")
    with path.open(newline="", encoding="utf-8") as file:
        header = next(csv.reader(file))
    told = [f"{name} [rad]" for name in HOSTILE[:6]]
    assert header[1:7] == [f"'{text}" if text.startswith("=") else text for text in told]


def test_hostile_names_survive_netcdf(tmp_path, hostile):
    xarray = pytest.importorskip("xarray")
    path = storage.save(hostile, tmp_path / "run.nc")
    with xarray.open_dataset(path, engine="scipy") as data:
        names = {variable.attrs.get("long_name") for variable in data.data_vars.values()}
        assert set(HOSTILE[:6]) <= names
        assert not [key for key in data.variables if "/" in key]
    with pytest.raises(MechcError, match="not a shipped one"):
        mechc.open(path)


def test_netcdf_names_are_distinct_legal_and_none_of_ours():
    names = (*HOSTILE, "a b", "a_b", "a?b", "energy", "Bool", "string")
    keys = storage.netcdf_names(names)
    assert list(keys.values()) == list(names)
    for key in keys:
        assert key.isidentifier()
        assert key.isascii()
        assert len(key) < 256
        assert key not in storage.TAKEN


class Tags(HTMLParser):
    def __init__(self, text):
        super().__init__()
        self.tags, self.text = set(), ""
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.tags.add(tag)

    def handle_data(self, data):
        self.text += data


TABLE = {"b", "table", "tr", "th", "td"}


def test_models_and_solutions_show_themselves_in_jupyter(model, sol):
    page = Tags(model._repr_html_())
    assert page.tags <= TABLE
    assert all(text in page.text for text in model.descriptions.values())
    page = Tags(sol._repr_html_())
    assert page.tags <= TABLE
    assert "finished" in page.text
    assert "l_3 = 3.5 m" in page.text


def test_hostile_names_are_text_in_html(model, hostile):
    page = Tags(report.solution_html(hostile))
    assert page.tags <= TABLE
    assert HOSTILE[0] in page.text
    quantity = replace(model.quantities["l_0"], name=HOSTILE[0], description=HOSTILE[0])
    stand_in = SimpleNamespace(
        title=HOSTILE[0],
        headline=HOSTILE[0],
        quantities={HOSTILE[0]: quantity},
        defaults={HOSTILE[0]: 1.0},
    )
    page = Tags(report.model_html(stand_in))
    assert page.tags <= TABLE
    assert page.text.count(HOSTILE[0]) > 2


def test_repr_is_one_line(model, sol):
    assert repr(model).startswith("<mechc.Model four_bar: 3 coordinates")
    assert repr(sol).startswith("<mechc.Solution of four_bar")
    assert "\n" not in repr(model) + repr(sol)


def test_a_solution_is_a_table(sol):
    table = sol.to_dataframe()
    np.testing.assert_array_equal(table.index, sol.t)
    np.testing.assert_array_equal(table.theta_1, sol["theta_1"])
    np.testing.assert_array_equal(table.energy, sol.energy)


def test_without_pandas_a_table_is_refused_in_words(sol, monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(mechc.MissingPackageError, match="pip install pandas"):
        sol.to_dataframe()


def test_a_run_with_events_goes_on_from_its_file_only_with_them(tmp_path):
    """The file has times of events alone: what follows would be a motion without resets."""
    bounce = mechc.Event("theta_0", direction=-1, reset={"omega_0": "-0.5*omega_0"})
    sol = mechc.load("pendulum").simulate(1.0, [1.0, 0.0], events=bounce)
    sol.save(tmp_path / "run.nc")
    read = mechc.open(tmp_path / "run.nc")
    assert read.events[0].t == pytest.approx(sol.events[0].t)
    with pytest.raises(mechc.MechcError, match=r"events=\.\.\."):
        read.continue_to(2.0)
