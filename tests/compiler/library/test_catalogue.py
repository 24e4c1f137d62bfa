"""The library: each mechanism is there by name and runs from a start of its own."""

import pickle

import numpy as np
import pytest
from mechc_codegen.library.catalogue import SHIPPED, shipped_mechanism

import mechc
from mechc.assembly.initial_values import filled_start
from mechc.cli.commands import main
from mechc.compilation.library.catalogue import LIBRARY
from mechc.compilation.library.library import beyond_default
from tests.support.command_line import run_json
from tests.support.marks import slow_among

COMPILED = [name for name in LIBRARY if name != "bicycle"]  # whose C takes longest: see below
SIZED = {"pendulum": ("links", 5), "windows": ("count", 3), "planar_chain": ("links", 7),
         "spatial_chain": ("links", 4)}  # fmt: skip
CONSERVATIVE = ("four_bar", "heavy_top", "pendulum", "planar_chain", "rigid_body",
                "spatial_chain", "windows")  # fmt: skip
LONG_TO_COMPILE = (  # or compiled by no other test
    "planar_chain", "spatial_chain", "andrews", "car_axis", "flyball_governor", "windows",
)  # fmt: skip
DRIVEN = {"andrews": ("beta", "T"), "slider_crank": ("theta", "T")}  # angle, torque on it


@pytest.fixture(scope="module")
def run():
    """What ``mechc run NAME`` simulates, by name."""
    runs = {}

    def of(name):
        if name not in runs:
            model = mechc.load(name)
            runs[name] = model.simulate(LIBRARY[name].seconds, model.assemble())
        return runs[name]

    return of


# -- names and sizes ------------------------------------------------------------------------------


def test_the_runtime_and_the_compiler_know_the_same_mechanisms():
    assert LIBRARY.keys() == SHIPPED.keys()
    assert mechc.mechanisms() == tuple(LIBRARY)


@pytest.mark.parametrize("name", LIBRARY)
def test_a_mechanism_is_called_as_it_is_asked_for_and_says_what_all_its_numbers_mean(name):
    mechanism = shipped_mechanism(name)
    assert mechanism.name == name
    assert name in SIZED or mechanism.title == LIBRARY[name].title
    described = (*mechanism.coordinates, *mechanism.speeds, *mechanism.parameters)
    assert all(each.quantity.unit and each.quantity.description for each in described)
    assert all(parameter.default is not None for parameter in mechanism.parameters)
    known = {point.name for point in mechanism.points}
    drawn = {point for _, points in mechanism.drawing.links for point in points}
    assert drawn
    assert drawn | {*mechanism.drawing.ground, *mechanism.drawing.traced} <= known
    assert mechanism.start


@pytest.mark.parametrize(("name", "bodies"), [
    ("pendulum", 5), ("windows", 7), ("planar_chain", 7), ("spatial_chain", 4),
])  # fmt: skip
def test_a_size_is_the_number_of_what_it_counts(name, bodies):
    option, count = SIZED[name]
    sized = shipped_mechanism(name, {option: count})
    assert sized.name == name
    assert len(sized.bodies) == bodies
    assert len(shipped_mechanism(name, {option: str(count)}).bodies) == bodies
    assert {str(s) for s in (*sized.q, *sized.u)} >= {f"{n}(t)" for n in sized.start}


@pytest.mark.parametrize("value", [0, -1, 101, 2.0, True, None, "two", "2.5", "-3", "1_0", "", "٣"])
def test_a_size_that_is_none_is_refused_with_the_range(value):
    with pytest.raises(mechc.MechcError, match=r"links must be a whole number from 1 to 100, not"):
        mechc.load("pendulum", links=value)


def test_the_default_size_given_is_the_default_scene_and_digits_are_a_number():
    assert beyond_default("pendulum", {"links": 1}) == {}
    assert beyond_default("pendulum", {"links": " 5 "}) == {"links": 5}
    assert beyond_default("pendulum", {"links": np.int64(5)}) == {"links": 5}
    assert beyond_default("four_bar", {"crank_torque": 3, "friction": False}) == {
        "crank_torque": "3"
    }


def test_a_wrong_option_is_told_the_right_ones():
    with pytest.raises(mechc.UnknownNameError, match=r"'link'.*did you mean 'links'"):
        mechc.load("pendulum", link=2)
    with pytest.raises(
        mechc.UnknownNameError, match=r"no option of andrews.*'links'; there is none"
    ):
        mechc.load("andrews", links=2)
    with pytest.raises(mechc.UnknownNameError, match="did you mean 'pendulum'"):
        mechc.load("double_pendulum")
    with pytest.raises(ValueError, match="compiled on demand are for this processor only"):
        mechc.load("andrews", instruction_set="baseline")


# -- what they do ---------------------------------------------------------------------------------


@pytest.mark.parametrize("name", slow_among(COMPILED, LONG_TO_COMPILE))
def test_each_runs_from_its_own_start_and_stays_closed(run, name):
    sol = run(name)
    assert sol.status.ok, str(sol.status)
    assert sol.t[-1] == LIBRARY[name].seconds
    assert sol.closure.max(initial=0.0) < 1e-13
    assert sol.velocity_closure.max(initial=0.0) < 1e-12
    assert np.ptp(sol.q, axis=0).max() > 0.05


@pytest.mark.parametrize("name", slow_among(CONSERVATIVE, {*LONG_TO_COMPILE} & {*CONSERVATIVE}))
def test_energy_is_kept_where_nothing_takes_it(run, name):
    assert run(name).energy_drift < 1e-9


@pytest.mark.slow
@pytest.mark.parametrize("name", DRIVEN)
def test_energy_grows_by_the_work_of_the_torque(run, name):
    angle, torque = DRIVEN[name]
    sol = run(name)
    work = sol.model.defaults[torque] * (sol[angle] - sol[angle][0])
    np.testing.assert_allclose(sol.energy - sol.energy[0], work, atol=1e-8 * abs(work[-1]), rtol=0)


@pytest.mark.slow
def test_the_dampers_of_the_governor_take_energy_and_no_angular_momentum(run):
    sol = run("flyball_governor")
    assert (np.diff(sol.energy) < 1e-9).all()
    about_the_shaft = sol.model.momenta(sol.y).angular[:, :, 2].sum(axis=1)
    np.testing.assert_allclose(about_the_shaft, about_the_shaft[0], rtol=1e-9)


@pytest.fixture(scope="module")
def bicycle():
    return mechc.load("bicycle", outputs=("energy",))


@pytest.mark.slow
def test_the_bicycle_comes_upright_again_and_keeps_its_energy(bicycle):
    sol = bicycle.simulate(2.0, bicycle.assemble(), rtol=1e-6)
    assert sol.status.ok, str(sol.status)
    assert np.degrees(sol["roll"].max()) > 4
    assert np.degrees(np.abs(sol["roll"][sol.t > 1.5]).max()) < 3
    assert sol.energy_drift < 1e-6
    assert sol.closure.max() < 1e-13


# -- where they start -----------------------------------------------------------------------------


def test_what_is_given_of_a_start_replaces_its_own_and_the_rest_stays(capsys):
    told = run_json(capsys, "run", "pendulum", "--with", "links=2", "--start", "theta_0=60deg",
                     "--t-end", "1e-9")  # fmt: skip
    np.testing.assert_allclose(told["q_end"], np.radians([60, 90]), atol=1e-9)


@pytest.mark.slow
def test_another_crank_angle_of_andrews_mechanism_is_assembled_as_it_is_published(run):
    """Of the ways that the loops close the one that goes over into the published start."""
    sol = run("andrews")
    later = sol(0.004)[:7]
    y0 = sol.model.assemble({"beta": later[0]})
    np.testing.assert_allclose(y0[:7], later, atol=1e-9)


@pytest.mark.slow
def test_a_start_follows_the_parameters():
    """Only as many coordinates are kept as there are freedoms; the loops close by the others."""
    model = mechc.load("slider_crank")
    y0 = model.assemble(params={"l_0": 0.3})
    np.testing.assert_allclose(y0[:3], [0.0, 0.0, 1.3], atol=1e-15)
    andrews = mechc.load("andrews")
    assert np.abs(andrews.constraints(andrews.assemble(params={"rr": 0.0071}), {"rr": 0.0071})
                  ).max() < 1e-15  # fmt: skip


@pytest.mark.slow
def test_a_coordinate_for_which_there_is_no_freedom_leaves_the_others_as_a_guess(capsys):
    """The windows stay upright: each of them also closes crossed."""
    told = run_json(capsys, "run", "windows", "--start", "q_0=80deg", "--t-end", "1e-9")
    square = np.radians([80, -80, -100, 0, -100])
    np.testing.assert_allclose(told["q_end"], square, atol=1e-8)
    assert told["u_end"][0] == pytest.approx(-1.0, abs=1e-6)


@pytest.mark.slow
def test_the_bicycle_keeps_its_speed_when_it_is_given_a_roll(bicycle):
    y0 = bicycle.assemble(*filled_start(bicycle.system, {"roll": 0.1}, {"roll_rate": 0.0}, {}))
    told = dict(zip((*bicycle.coordinates, *bicycle.speeds), y0.tolist(), strict=True))
    assert np.hypot(told["x_rate"], told["y_rate"]) == pytest.approx(4.8, rel=1e-12)
    assert told["roll"] == 0.1
    assert told["roll_rate"] == 0.0


# -- as any other model ---------------------------------------------------------------------------


def test_a_size_survives_pickling_and_is_the_same_model():
    model = mechc.load("pendulum", links=2)
    assert model.options == {"links": 2}
    assert pickle.loads(pickle.dumps(model)) is model
    assert mechc.load("pendulum", links="2") is model
    plain = mechc.load("pendulum")
    assert mechc.load("pendulum", links=1) is plain
    assert plain.options == {}
    assert plain is not model


def test_a_saved_run_is_opened_again(run, tmp_path):
    run("slider_crank").save(tmp_path / "run.nc")
    assert mechc.open(tmp_path / "run.nc").model is run("slider_crank").model


def test_parameters_are_fixed_and_outputs_left_out():
    model = mechc.load("pendulum", fix={"g": 0.0}, outputs=["energy"])
    assert "g" not in model.parameters
    sol = model.simulate(0.1, model.assemble(speeds={"omega_0": 2.0}))
    assert sol.energy_drift < 1e-8
    assert "points" not in model.system.scene.outputs
    assert model.points(sol.y).shape == (len(sol.t), 2, 3)  # compiled when asked for


def test_a_batch_and_a_sweep_begin_where_a_run_does(run, capsys):
    command = ("sweep", "slider_crank", "--vary", "T=10:20:2", "--reduce", "final(x)")
    told = run_json(capsys, *command, "--t-end", "1")
    assert told["outcomes"]["finished"] == 2
    ends = [told["reductions"]["final(x)"][at] for at in ("min", "max")]
    assert min(abs(end - run("slider_crank")["x"][-1]) for end in ends) < 1e-8


# -- from the shell -------------------------------------------------------------------------------


@pytest.mark.slow
def test_a_run_ends_when_it_suits_the_mechanism(capsys):
    told = run_json(capsys, "run", "andrews")
    assert told["mechanism"] == "andrews"
    assert told["t_end"] == LIBRARY["andrews"].seconds
    assert told["q_end"][0] == pytest.approx(15.81077, abs=1e-4)  # the published end


def test_show_and_emit_know_the_sizes(capsys):
    assert main(["show", "pendulum", "--with", "links=2"]) == 0
    said = capsys.readouterr().out
    assert said.startswith("Double pendulum")
    assert "theta_1" in said
    assert "point masses, each hinged to the one before, 1 to 100 [1]" in said
    assert main(["emit", "pendulum", "--with", "links=2"]) == 0
    assert "p_2 along y" in capsys.readouterr().out


def test_show_of_one_without_options_offers_none(capsys):
    assert main(["show", "heavy_top"]) == 0
    assert "on request" not in capsys.readouterr().out


def test_a_size_typed_wrong_is_one_line(capsys):
    assert main(["run", "pendulum", "--with", "links=many"]) == 2
    said = capsys.readouterr().err
    assert said == "mechc: links must be a whole number from 1 to 100, not 'many'\n"
    assert main(["run", "pendulum", "--with", "links"]) == 2
    assert "not True" in capsys.readouterr().err
