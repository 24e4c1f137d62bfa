"""Functional mock-up units in importers of others, against the model and its integrators."""

import ctypes
import re
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
import sympy as sm
import sympy.physics.mechanics as me
from mechc_codegen.errors import CodegenError
from mechc_codegen.extension.flags import STRICT

import mechc
from benchmarks.problems.particle import particle
from mechc.cli.commands import main
from mechc.compilation import toolchain

fmpy = pytest.importorskip("fmpy")
validate_fmu = pytest.importorskip("fmpy.validation").validate_fmu
pytestmark = pytest.mark.slow
STATES = ["theta_0", "theta_1", "theta_2", "omega_0", "omega_1", "omega_2"]
REGULAR = {"l_3": 3.5}
HOSTILE = '<a b="c">&amp;\n\x07]]> %n */ "'


@pytest.fixture(scope="module", params=["3.0", "2.0"])
def four_bar(request, tmp_path_factory):
    """A four-bar's file, its version of FMI."""
    target = tmp_path_factory.mktemp("fmu") / "four_bar.fmu"
    y0 = mechc.load("four_bar").assemble({"theta_0": 1.1}, {"omega_0": 2.0})
    return mechc.export_fmu("four_bar", target, version=request.param, y0=y0), request.param


@pytest.fixture(scope="module")
def cart(tmp_path_factory):
    """A cart that an input pushes, with a drag and an output of hostile names: model, file."""
    x, v, F = me.dynamicsymbols("x v F")
    c = sm.Symbol(HOSTILE)
    kane = particle([x], [v], [F - c * v**3])
    outputs = ("energy", {HOSTILE: sm.sin(x) * sm.Symbol("m")})
    values = {"m": 2.0, HOSTILE: 0.3}
    file = tmp_path_factory.mktemp("fmu") / "cart.fmu"
    mechc.export_fmu(kane, file, name="cart", y0=[0.5, 1.0], params=values, outputs=outputs)
    return mechc.compile(kane, outputs=outputs), file, values


@pytest.fixture
def start():
    """Of the regular four-bar: the state by names, the array, and the model."""
    model = mechc.load("four_bar")
    y0 = model.assemble({"theta_0": 1.1}, {"omega_0": 2.0}, params=REGULAR)
    return dict(zip(STATES, map(float, y0), strict=True)), y0, model


def simulated(file, kind, end=2.0, outputs=(), **options):
    """Times, states, and the record, sampled each 10 ms."""
    record = fmpy.simulate_fmu(
        str(file), fmi_type=kind, stop_time=end, output_interval=0.01,
        output=[*STATES, *outputs], record_events=False, **options,
    )  # fmt: skip
    return record["time"], np.array([record[name] for name in STATES]).T, record


class Instance:
    """A unit as an importer holds it, by names of variables."""

    def __init__(self, file, kind="CoSimulation"):
        self.description = fmpy.read_model_description(str(file))
        self.third = self.description.fmiVersion == "3.0"
        self.references = {v.name: v.valueReference for v in self.description.modelVariables}
        self.folder = Path(fmpy.extract(str(file)))
        self.fmu = fmpy.instantiate_fmu(str(self.folder), self.description, fmi_type=kind)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.fmu.freeInstance()
        shutil.rmtree(self.folder)

    def initialise(self, values=None):
        if not self.third:
            self.fmu.setupExperiment()
        self.set(values or {})
        self.fmu.enterInitializationMode()
        self.fmu.exitInitializationMode()

    def set(self, values):
        names = [self.references[name] for name in values]
        (self.fmu.setFloat64 if self.third else self.fmu.setReal)(names, list(values.values()))

    def get(self, *names):
        references = [self.references[name] for name in names]
        return np.array((self.fmu.getFloat64 if self.third else self.fmu.getReal)(references))

    def step(self, t, h):
        self.fmu.doStep(currentCommunicationPoint=t, communicationStepSize=h)

    def along(self, unknowns, knowns, seed):
        lists = [[self.references[name] for name in names] for names in (unknowns, knowns)]
        return np.array(self.fmu.getDirectionalDerivative(*lists, list(seed)))


def test_descriptions_are_valid(four_bar, cart):
    assert validate_fmu(str(four_bar[0])) == []
    assert validate_fmu(str(cart[1])) == []
    units = {v.name: v.unit for v in fmpy.read_model_description(str(four_bar[0])).modelVariables}
    assert units["omega_0"] == "rad/s"
    assert units["der(omega_0)"] == "rad/s^2"
    assert units["kinetic_energy"] == "J"
    assert units["points[p_1,x]"] == "m"


def test_rows_that_an_input_scales_count(tmp_path):
    """Rows were counted while it was 0, and one of them was none."""
    x, y, z, u, v, w, s = me.dynamicsymbols("x y z u v w s")
    loops = [s * (y - 1), x**2 + z**2 - 1]
    kane = particle([x, y, z], [u, v, w], [0, -9.81, 0], 1.0, closed=loops)
    start = [0.6, 1.0, 0.8, 0.8, 0.0, -0.6]
    file = mechc.export_fmu(kane, tmp_path / "scaled.fmu", name="scaled", y0=start)
    with Instance(file, "ModelExchange") as unit:
        unit.initialise({"s": 2.0})
        rates = unit.get(*(f"der({name})" for name in "xyzuvw"))
    assert rates == pytest.approx([0.8, 0.0, -0.6, -0.6, 0.0, -0.8], abs=1e-12)


def test_a_unit_has_tables(tmp_path):
    """A function of the tables had the name of a type of the runtime."""
    x, v = me.dynamicsymbols("x v")
    load = mechc.Table([0.0, 0.5, 1.0], [0.0, 2.0, 1.0], kind="linear", outside="hold")
    kane = particle([x], [v], [load(x)], 1.0)
    file = mechc.export_fmu(kane, tmp_path / "load.fmu", name="load", y0=[0.25, 0.0])
    with Instance(file, "ModelExchange") as unit:
        unit.initialise()
        assert unit.get("der(v)") == pytest.approx([1.0], rel=1e-14)


def test_names_of_users_are_text_in_the_description_and_nothing_in_the_code(cart):
    with zipfile.ZipFile(cart[1]) as archive:
        root = ElementTree.fromstring(archive.read("modelDescription.xml"))
        names = [each.get("name") for each in root.find("ModelVariables")]
        assert sum('<a b="c">&amp;' in name for name in names) == 2  # a parameter and an output
        text = b"".join(archive.read(n) for n in archive.namelist() if n.endswith((".c", ".h")))
    assert b"&amp" not in re.sub(rb'"[^"\n]*"', b"", text)


def test_co_simulation_is_the_motion_of_simulate(four_bar, start):
    values, y0, model = start
    t, y, record = simulated(
        four_bar[0], "CoSimulation", start_values=values | REGULAR,
        outputs=["kinetic_energy", "points[p_2,y]", "multipliers[1]"],
    )  # fmt: skip
    sol = model.simulate(2.0, y0, REGULAR, rtol=1e-11, t_eval=t)
    assert y == pytest.approx(sol.y, abs=2e-9)
    assert np.abs(model.constraints(y, REGULAR)).max() < 1e-12
    assert np.abs(model.velocity_constraints(y, REGULAR)).max() < 1e-12
    assert record["kinetic_energy"] == pytest.approx(model.kinetic_energy(y, REGULAR), rel=1e-12)
    assert record["multipliers[1]"] == pytest.approx(model.multipliers(y, REGULAR)[:, 1], rel=1e-9)


def test_co_simulation_passes_change_points(four_bar):
    model = mechc.load("four_bar")
    y0 = model.assemble({"theta_0": 1.1}, {"omega_0": 2.0})
    t, y, _ = simulated(four_bar[0], "CoSimulation")
    sol = model.simulate(2.0, y0, rtol=1e-11, t_eval=t)
    assert sol.change_points
    assert y == pytest.approx(sol.y, abs=2e-8)


def test_parameters_that_follow_others_do_so_in_the_unit(four_bar, start):
    values, y0, model = start
    params = REGULAR | {"m_1": 5.0}
    _, y, record = simulated(
        four_bar[0], "CoSimulation", end=1.0, start_values=values | params, outputs=["I_1"]
    )
    assert record["I_1"][-1] == pytest.approx(5.0 * 2.0**2 / 12, rel=1e-14)
    assert y[-1] == pytest.approx(model.simulate(1.0, y0, params, rtol=1e-11).y[-1], abs=2e-9)


def test_parameters_that_follow_others_do_so_after_initialization_too(four_bar, start):
    """A tunable mass is changed between two steps of co-simulation."""
    values, _, model = start
    with Instance(four_bar[0]) as unit:
        unit.initialise(values | REGULAR)
        unit.step(0.0, 0.5)
        y = unit.get(*STATES)
        unit.set({"m_1": 5.0})
        assert unit.get("I_1")[0] == pytest.approx(5.0 * 2.0**2 / 12, rel=1e-14)
        unit.step(0.5, 0.5)
        end = unit.get(*STATES)
    params = REGULAR | {"m_1": 5.0, "I_1": 5.0 * 2.0**2 / 12}
    sol = model.simulate((0.5, 1.0), y, params, rtol=1e-11)
    assert end == pytest.approx(sol.y[-1], abs=2e-9)


def test_model_exchange_is_the_motion_of_simulate_and_drifts(four_bar, start):
    """The importer's integrator opens the loops; asked for, event mode closes them."""
    values, y0, model = start
    gaps = {}
    for drift in (0.0, 1e-6):
        given = values | REGULAR | {"mechc.drift": drift}
        t, y, _ = simulated(
            four_bar[0], "ModelExchange", end=5.0, start_values=given, relative_tolerance=1e-9
        )
        sol = model.simulate(5.0, y0, REGULAR, rtol=1e-11, t_eval=t)
        assert y == pytest.approx(sol.y, abs=1e-4)
        gaps[drift] = np.abs(model.constraints(y, REGULAR)).max()
    assert gaps[1e-6] < 1e-6 < 0.5 * gaps[0.0]


def test_inputs_keep_their_values_during_a_step(cart):
    model, file, values = cart
    stepper = model.stepper({"x": 0.5, "v": 1.0}, values, inputs={"F": 0.0})
    with Instance(file) as unit:
        unit.initialise()
        for n, force in enumerate((0.0, 3.0, 3.0, -8.0)):
            unit.set({"F": force})
            unit.step(0.1 * n, 0.1)
            y = stepper.step(0.1, {"F": force})
            assert unit.get("x", "v") == pytest.approx(y, rel=1e-9)
        acceleration = (force - 0.3 * y[1] ** 3) / 2.0
        assert unit.get("der(v)")[0] == pytest.approx(acceleration, rel=1e-9)


def test_directional_derivatives_are_slopes_of_the_values(four_bar, start):
    values, _, _ = start
    unknowns = ["der(omega_0)", "der(omega_2)", "points[p_2,y]", "kinetic_energy", "I_0"]
    knowns = ["theta_0", "omega_1", "l_0", "m_1"]
    with Instance(four_bar[0], "ModelExchange") as unit:
        unit.initialise(values | REGULAR)
        at = dict(zip(knowns, unit.get(*knowns), strict=True))
        seeds = [*np.eye(4).tolist(), [0.3, -0.2, 0.5, 0.7]]
        found = [unit.along(unknowns, knowns, seed) for seed in seeds]
        for seed, row in zip(seeds, found, strict=True):
            ends = []
            for h in (1e-5, -1e-5):
                moved = {k: at[k] + h * s for k, s in zip(knowns, seed, strict=True)}
                unit.set(moved)
                ends.append(unit.get(*unknowns))
            unit.set(at)
            assert row == pytest.approx((ends[0] - ends[1]) / 2e-5, rel=1e-6, abs=1e-7)
        if unit.third:
            lists = [[unit.references[n] for n in names] for names in (unknowns, knowns)]
            weights = [1.0, -2.0, 0.5, 3.0, 0.25]
            adjoint = unit.fmu.getAdjointDerivative(*lists, weights, len(knowns))
            assert adjoint == pytest.approx(np.array(found[:4]) @ weights, rel=1e-12)


def test_derivatives_by_inputs_and_of_own_outputs(cart):
    _, file, values = cart
    own = next(
        v.name for v in fmpy.read_model_description(str(file)).modelVariables
        if "amp" in v.name and v.causality == "output"
    )  # fmt: skip
    with Instance(file, "ModelExchange") as unit:
        unit.initialise()
        assert unit.along(["der(v)"], ["F"], [3.0])[0] == pytest.approx(3.0 / values["m"])
        assert unit.along([own], ["x"], [1.0])[0] == pytest.approx(np.cos(0.5) * values["m"])
        assert unit.along([own], ["m"], [1.0])[0] == pytest.approx(np.sin(0.5))


def test_a_parameter_that_follows_by_a_sum_has_its_derivative(tmp_path):
    """Of J = m (a^2 + b^2), whose derivative by m is a sum."""
    x, v = me.dynamicsymbols("x v")
    m, a, b, J = sm.symbols("m a b J")
    defaults = {m: 2.0, a: 0.5, b: 1.5, J: m * (a**2 + b**2)}
    target = tmp_path / "drag.fmu"
    kane = particle([x], [v], [-J * v])
    file = mechc.export_fmu(kane, target, name="drag", y0=[0.5, 1.0], defaults=defaults)
    with Instance(file, "ModelExchange") as unit:
        unit.initialise()
        assert unit.along(["J"], ["m", "a"], [3.0, -0.5]) == pytest.approx([3 * 2.5 - 1.0])
        assert unit.along(["J"], ["b"], [1.0]) == pytest.approx([6.0])
        assert unit.along(["der(v)"], ["m"], [2.0]) == pytest.approx([0.0], abs=1e-12)


def test_a_saved_state_goes_on_to_the_last_bit_and_as_bytes_elsewhere(four_bar, start):
    values, _, _ = start
    with Instance(four_bar[0]) as unit, Instance(four_bar[0]) as other:
        state = "FMUState" if unit.third else "FMUstate"
        unit.initialise(values | REGULAR)
        other.initialise()
        unit.step(0.0, 0.25)
        saved = getattr(unit.fmu, f"get{state}")()
        unit.step(0.25, 0.5)
        end = unit.get(*STATES)
        data = getattr(unit.fmu, f"serialize{state}")(saved)
        getattr(unit.fmu, f"set{state}")(saved)
        unit.step(0.25, 0.5)
        assert (unit.get(*STATES) == end).all()
        deserialised = (
            other.fmu.deserializeFMUState if unit.third else other.fmu.deSerializeFMUstate
        )
        copy = deserialised(data)
        getattr(other.fmu, f"set{state}")(copy)
        assert other.get("time", "l_3") == pytest.approx([0.25, 3.5])
        other.step(0.25, 0.5)
        assert other.get(*STATES) == pytest.approx(end, abs=1e-8)
        getattr(unit.fmu, f"free{state}")(saved)
        getattr(other.fmu, f"free{state}")(copy)


def test_what_cannot_be_set_or_closed_is_an_error(four_bar):
    with Instance(four_bar[0]) as unit:
        unit.initialise(REGULAR)
        for name, value in (("der(omega_0)", 1.0), ("I_0", 1.0), ("l_0", np.nan)):
            with pytest.raises(fmpy.fmi1.FMICallException):
                unit.set({name: value})
        unit.set({"l_0": 100.0})
        with pytest.raises(fmpy.fmi1.FMICallException):
            unit.step(0.0, 0.1)
        unit.references["nothing"] = 10_000
        with pytest.raises(fmpy.fmi1.FMICallException):
            unit.get("nothing")


def test_why_a_call_fails_is_told_without_debug_logging(four_bar, capfd):
    """By fmpy's own logger: another one would stay in a variable of its library after its end."""
    with pytest.raises(fmpy.fmi1.FMICallException):
        simulated(four_bar[0], "CoSimulation", start_values={"l_3": 35.0})
    assert "the loops cannot be closed near the start values" in "".join(capfd.readouterr())


def test_the_sources_are_whole_and_make_no_warning(four_bar, tmp_path):
    with zipfile.ZipFile(four_bar[0]) as archive:
        archive.extractall(tmp_path)
    command = [*toolchain.compiler(), "-std=gnu11", *STRICT, "-fsyntax-only", "-I.", "fmu.c"]
    done = subprocess.run(
        command, cwd=tmp_path / "sources", capture_output=True, text=True, check=False
    )
    assert done.stderr == ""
    assert done.returncode == 0


def test_a_second_importer_advances_it(four_bar, start):
    """ECOS: a co-simulation engine in C++ with its own reading of FMI."""
    library = Path(sys.prefix) / "lib" / "libtbb.so.12"  # of the package tbb, which it needs
    if library.exists():
        ctypes.CDLL(str(library), mode=ctypes.RTLD_GLOBAL)
    ecos = pytest.importorskip("ecospy", exc_type=(ImportError, OSError))
    values, y0, model = start
    with ecos.EcosSimulationStructure() as structure:
        structure.add_model("linkage", four_bar[0])
        given = ecos.EcosParameterSet.EcosParameterSet()
        for name, value in (values | REGULAR).items():
            given.add_real(f"linkage::{name}", value)
        structure.add_parameter_set("given", given)
        with ecos.EcosSimulation(structure=structure, step_size=0.01) as simulation:
            simulation.init(parameter_set="given")
            simulation.step_until(1.0)
            t = simulation.get_time()
            y = [simulation.get_real(f"linkage::{name}") for name in STATES]
    assert y == pytest.approx(model.simulate(t, y0, REGULAR, rtol=1e-11).y[-1], abs=1e-8)


def test_the_command_writes_one_for_a_mechanism_or_a_file(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["export", "pendulum", "--fmu", "--fmi", "2.0", "--start", "theta_0=1"]) == 0
    assert capsys.readouterr().out.strip() == "pendulum.fmu"
    with zipfile.ZipFile("pendulum.fmu") as archive:
        root = ElementTree.fromstring(archive.read("modelDescription.xml"))
        assert archive.namelist()[0] == "modelDescription.xml"
    assert root.get("fmiVersion") == "2.0"
    assert main(["export", "pendulum", "--fmu", "--fmi", "1.0"]) == 2
    assert "3.0, 2.0" in capsys.readouterr().err
    assert main(["export", "pendulum", "--fmu", "--c"]) == 2


def test_what_is_no_export_is_refused(tmp_path):
    for wrong in ({"rtol": 0.0}, {"drift": -1.0}):
        with pytest.raises(mechc.ValueOutOfBoundsError):
            mechc.export_fmu("pendulum", tmp_path / "x.fmu", **wrong)
    with pytest.raises(CodegenError, match="cannot begin"):
        mechc.export_fmu("pendulum", tmp_path / "x.fmu", name="a b")
    assert list(tmp_path.iterdir()) == []


# -- events -----------------------------------------------------------------------------------


BOUNCE = (mechc.Event("q < 0", reset={"u": "-e*u"}), mechc.Event("u"))
HEAVY = {"m": 1.0, "g": 9.81, "e": 0.8, "c": 0.0}


@pytest.fixture(scope="module")
def ball():
    """A ball over a floor, as SymPy describes it."""
    q, u = me.dynamicsymbols("q u")
    m, g, e, c = sm.symbols("m g e c")
    return particle([q], [u], [-(m * g + c * e * u)])


def states_of(record, names):
    return record["time"], np.array([record[name] for name in names]).T


@pytest.mark.parametrize("version", ["3.0", "2.0"])
def test_events_are_indicators_and_resets_are_made(ball, version, tmp_path):
    file = mechc.export_fmu(
        ball, tmp_path / "ball.fmu", name="ball", version=version, y0=[1.0, 0.0], params=HEAVY,
        events=BOUNCE, derivatives=False,
    )  # fmt: skip
    assert validate_fmu(str(file)) == []
    described = fmpy.read_model_description(str(file))
    assert (described.numberOfEventIndicators or len(described.eventIndicators)) == 2
    assert not described.modelExchange.providesDirectionalDerivative
    sol = mechc.compile(ball).simulate(2.0, [1.0, 0.0], HEAVY, events=BOUNCE)
    assert len(sol.events[0].t) == 3
    for kind, near in (("ModelExchange", 1e-6), ("CoSimulation", 1e-12)):
        record = fmpy.simulate_fmu(
            str(file), fmi_type=kind, stop_time=2.0, output_interval=0.01, record_events=False,
            relative_tolerance=1e-9, output=["q", "u", "mechc.event[0]"],
        )  # fmt: skip
        times, states = states_of(record, ["q", "u"])
        assert abs(times[:, None] - sol.events[0].t).min() > 1e-5  # none of them is at a jump
        np.testing.assert_allclose(states, sol(np.minimum(times, 2.0)), atol=near)
        np.testing.assert_array_equal(record["mechc.event[0]"], record["q"])
    rest = np.sqrt(2.0 / 9.81) * (1.0 + 0.8) / (1.0 - 0.8)  # when it bounces no more
    stepped = fmpy.simulate_fmu(
        str(file), fmi_type="ModelExchange", stop_time=9.0, output_interval=0.01,
        relative_tolerance=1e-9, record_events=False,
    )  # fmt: skip
    assert abs(stepped["time"][-1] - rest) < 0.02  # it is sampled each 10 ms
    with pytest.raises(fmpy.fmi1.FMICallException):
        fmpy.simulate_fmu(str(file), fmi_type="CoSimulation", stop_time=9.0)


def test_resets_of_a_linkage_keep_its_loop(start, tmp_path):
    """The crank loses half of its speed at each passage; all other speeds follow by impulse."""
    values, y0, model = start
    event = mechc.Event("cos(theta_0) < 0", reset={"omega_0": "omega_0/2"})
    file = mechc.export_fmu(
        "four_bar", tmp_path / "linkage.fmu", y0=y0, params=REGULAR, events=event,
        derivatives=False,
    )  # fmt: skip
    sol = model.simulate(2.0, y0, REGULAR, events=event)
    assert len(sol.events[0].t) >= 1
    for kind, near in (("ModelExchange", 1e-4), ("CoSimulation", 1e-9)):
        times, states, _ = simulated(file, kind, relative_tolerance=1e-9)
        assert abs(times[:, None] - sol.events[0].t).min() > 1e-5
        np.testing.assert_allclose(states, sol(np.minimum(times, 2.0)), atol=near)
    assert set(values) == set(STATES)


@pytest.mark.parametrize("version", ["3.0", "2.0"])
def test_contacts_are_those_of_simulate(ball, version, tmp_path):
    """The ball jumps on a floor and rests there; a rubbing guide stops it on its way."""
    stop = mechc.Stop("q", restitution="e")
    guide = mechc.DryFriction("u", 2.0)
    for events, end in ((stop, 6.0), ([stop, guide], 2.0)):
        file = mechc.export_fmu(
            ball, tmp_path / "ball.fmu", name="ball", version=version, y0=[1.0, 0.0], params=HEAVY,
            events=events, derivatives=False,
        )  # fmt: skip
        assert validate_fmu(str(file)) == []
        described = fmpy.read_model_description(str(file))
        assert described.modelExchange is None
        sol = mechc.compile(ball).simulate(end, [1.0, 0.0], HEAVY, events=events)
        assert sol.status.ok
        record = fmpy.simulate_fmu(
            str(file), stop_time=end, output_interval=0.05, record_events=False,
            output=["q", "u", "der(u)", "mechc.event[0]"], relative_tolerance=1e-9,
        )  # fmt: skip
        times, states = states_of(record, ["q", "u"])
        far = abs(times[:, None] - np.concatenate([e.t for e in sol.events])).min(axis=1) > 1e-6
        np.testing.assert_allclose(states[far], sol(np.minimum(times, end))[far], atol=1e-9)
        np.testing.assert_array_equal(record["mechc.event[0]"], record["q"])
    at_rest = fmpy.simulate_fmu(
        str(mechc.export_fmu(
            ball, tmp_path / "ball.fmu", name="ball", y0=[1.0, 0.0], params=HEAVY, events=stop,
            derivatives=False, outputs=({"push": -sm.Symbol("m") * me.dynamicsymbols("u").diff()},),
        )), stop_time=6.0, output=["q", "u", "der(u)", "push"],
    )[-1]  # fmt: skip
    assert abs(np.array(at_rest.tolist()[1:])).max() < 1e-12


@pytest.mark.parametrize(
    ("event", "error", "words"),
    [
        (lambda t, y: y[0], mechc.ValueOutOfBoundsError, "as expressions"),
        (mechc.Event("q", terminal=True), mechc.ValueOutOfBoundsError, "importer decides"),
        ("height < 0", CodegenError, "height"),
    ],
)
def test_events_that_no_importer_could_take_are_refused(ball, event, error, words, tmp_path):
    with pytest.raises(error, match=words):
        mechc.export_fmu(ball, tmp_path / "ball.fmu", name="ball", params=HEAVY, events=[event])
