"""Exported WebAssembly, run by Node, against the model and its functional mock-up unit."""

import json
import shutil
import subprocess

import numpy as np
import pytest

import mechc
from mechc.cli.commands import main
from mechc.compilation import toolchain
from tests.compiler.export.test_standalone import cart

NODE = shutil.which("node")
PACKAGED = toolchain.packaged_compiler()
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(NODE is None, reason="node is not installed"),
    pytest.mark.skipif(PACKAGED is None, reason="the package ziglang is not installed"),
]
TELLING = """
import {{ about, create }} from "./{name}.mjs";
const told = {{}}, m = await create();
{script}
console.log(JSON.stringify(told, (key, x) => (x instanceof Float64Array ? Array.from(x) : x)));
"""


def told_by(folder, name, script):
    """What a script writes into ``told``, with a mechanism ``m``."""
    shutil.copy(folder / f"{name}.js", folder / f"{name}.mjs")
    (folder / "run.mjs").write_text(TELLING.format(name=name, script=script), "utf-8")
    done = subprocess.run([NODE, folder / "run.mjs"], capture_output=True, text=True, check=True)
    return json.loads(done.stdout)


@pytest.fixture(scope="module")
def four_bar(tmp_path_factory):
    """The folder of the regular four-bar, its model, its parameters and its start."""
    model, folder = mechc.load("four_bar"), tmp_path_factory.mktemp("web")
    params = {"l_3": 3.5}
    y0 = model.assemble({"theta_0": 1.1}, {"omega_0": 2.0}, params=params)
    mechc.export_wasm("four_bar", folder, y0=y0, params=params)
    return folder, model, params, y0


def test_the_module_imports_nothing(four_bar):
    folder, *_ = four_bar
    script = """
        const { readFileSync } = await import("node:fs");
        const file = new URL("./four_bar.wasm", import.meta.url);
        const module = new WebAssembly.Module(readFileSync(file));
        told.imports = WebAssembly.Module.imports(module);"""
    assert told_by(folder, "four_bar", script) == {"imports": []}


def test_states_are_those_of_the_unit_and_of_the_stepper(four_bar, tmp_path):
    """After 120 frames: the unit is compiled by another compiler, with products and sums fused."""
    folder, model, params, y0 = four_bar
    fmpy = pytest.importorskip("fmpy")
    script = "for (let n = 1; n <= 120; n += 1) { m.advance(n / 60); } told.y = m.y; told.t = m.t;"
    told = told_by(folder, "four_bar", script)
    unit = mechc.export_fmu("four_bar", tmp_path / "bar.fmu", y0=y0, params=params)
    names = [*model.coordinates, *model.speeds]
    record = fmpy.simulate_fmu(
        str(unit), fmi_type="CoSimulation", stop_time=2.0, output_interval=1 / 60, output=names
    )
    stepper = model.stepper(y0, params)
    for n in range(1, 121):
        stepper.step(n / 60 - stepper.t)
    assert told["t"] == 2.0
    assert told["y"] == pytest.approx([record[name][-1] for name in names], abs=1e-12)
    assert told["y"] == pytest.approx(stepper.y, abs=1e-12)
    assert told["y"] == pytest.approx(model.simulate(2.0, y0, params, rtol=1e-12).y[-1], abs=1e-10)


def test_outputs_points_and_parameters_are_the_models(four_bar):
    folder, model, params, y0 = four_bar
    outputs = ("rates", "mass_matrix", "multipliers", "kinetic_energy")
    script = f"""
        m.set({{ l_1: 2.2 }});
        m.start();
        told.y = m.y, told.parameters = m.parameters, told.points = m.points();
        told.names = about.drawing.points;
        for (const name of {list(outputs)}) {{ told[name] = m.output(name); }}"""
    told = told_by(folder, "four_bar", script)
    params = params | {"l_1": 2.2}
    y = np.array(told["y"])
    assert y[[0, 3]] == pytest.approx(y0[[0, 3]], abs=1e-15)  # the crank keeps angle and speed
    assert np.abs(model.constraints(y, params)).max() < 1e-14
    assert np.abs(model.velocity_constraints(y, params)).max() < 1e-14
    values = model.system.parameter_set.resolve(params)
    assert told["parameters"] == pytest.approx(
        dict(zip(model.parameters, values.tolist(), strict=True))  # the inertia follows the length
    )
    for name in outputs:
        function = model.rhs if name == "rates" else getattr(model, name)
        expected = function(0.0, y, params) if name == "rates" else function(y, params)
        assert told[name] == pytest.approx(np.ravel(expected), rel=1e-11, abs=1e-11), name
    picture = model.picture
    places = [list(picture.point_names).index(point) for point in told["names"]]
    expected = picture.points(y, values, 0.0)[places]
    assert told["points"] == pytest.approx(expected.ravel(), abs=1e-13)


def test_parameters_that_follow_others_follow_until_they_are_set_and_again_after_null(four_bar):
    """The inertia of the coupler, a uniform rod of 2 m."""
    folder, *_ = four_bar
    script = """
        const steps = [{ m_1: 5 }, { I_1: 0.3 }, { m_1: 4 }, { I_1: null }, { m_1: 6 }];
        told.found = steps.map((given) => {
            m.set(given);
            return m.parameters.I_1;
        });
        m.start();
        told.rates = m.output("rates"), told.y = m.y;"""
    told = told_by(folder, "four_bar", script)
    assert told["found"] == pytest.approx([5 / 3, 0.3, 0.3, 4 / 3, 2.0], rel=1e-15)
    given = {"l_3": 3.5, "m_1": 6.0, "I_1": 2.0}
    rates = mechc.load("four_bar").rhs(0.0, np.array(told["y"]), given)
    assert told["rates"] == pytest.approx(rates, rel=1e-12)


def test_a_start_that_cannot_be_is_refused_and_changes_nothing(four_bar):
    folder, *_ = four_bar
    script = """
        m.advance(0.1);
        told.before = [m.t, ...m.y];
        m.set({ l_3: 40 });
        try { m.start(); } catch (problem) { told.said = problem.message; }
        told.after = [m.t, ...m.y];"""
    told = told_by(folder, "four_bar", script)
    assert told["said"] == "the loops cannot be closed near this state"
    assert told["after"] == told["before"]


def test_it_goes_straight_on_through_change_points_and_turns_back_beside_them(four_bar):
    """And an instance that has run before begins anew."""
    folder, model, *_ = four_bar
    script = """
        for (const l_3 of [4, 4 - 1e-6]) {
            m.set({ l_3 });
            m.start({ theta_0: 1.4, omega_0: 0 });
            for (let n = 1; n <= 180; n += 1) { m.advance(n / 60); }
            told[l_3] = m.y;
        }"""
    for l_3, y in told_by(folder, "four_bar", script).items():
        params = {"l_3": float(l_3)}
        start = model.assemble({"theta_0": 1.4}, params=params)
        sol = model.simulate(3.0, start, params, rtol=1e-9)
        assert bool(sol.change_points) == (params["l_3"] == 4)
        assert y == pytest.approx(sol.y[-1], abs=1e-8), l_3


def test_where_it_is_open_how_the_motion_goes_on_it_says_so(four_bar):
    folder, *_ = four_bar
    script = """
        m.set({ l_3: 4 });
        m.start({ theta_0: Math.PI, omega_0: 0 }, { from: [Math.PI, 0, 0, 0, 0, 0] });
        try { m.advance(1); } catch (problem) { told.said = problem.message; }"""
    assert "two ways lead on" in told_by(folder, "four_bar", script)["said"]


def test_a_model_of_a_user_with_an_input(tmp_path):
    """Without loops, positions of points found from its description."""
    kane, _, names, _ = cart()
    p, y0 = dict(zip(map(str, names), (1.2, 9.81, 0.7, 0.3), strict=True)), [0.1, 0.8, -0.4, 2.0]
    mechc.export_wasm(kane, tmp_path, name="cart", y0=y0, params=p, sliders={"F": (-5, 5)})
    script = """
        m.give({ F: 3 });
        m.start({}, { tolerance: 1e-11 });
        m.advance(1);
        told.y = m.y, told.points = m.points(), told.inputs = about.inputs;"""
    told = told_by(tmp_path, "cart", script)
    model = mechc.compile(kane)
    end = model.simulate(1.0, y0, p, inputs={"F": 3.0}, rtol=1e-11).y[-1]
    assert told["y"] == pytest.approx(end, abs=1e-10)
    assert told["inputs"] == ["F"]
    picture, y = model.picture, np.array(told["y"])
    found = picture.points(y, model.system.parameter_set.resolve(p), 1.0)
    assert told["points"] == pytest.approx(found.ravel(), abs=1e-13)


def test_a_stiff_mechanism(tmp_path):
    """Its rods are held by a damper of 1.3e4 / s."""
    model = mechc.load("flyball_governor")
    y0 = np.array([model.start.get(name, 0.0) for name in (*model.coordinates, *model.speeds)])
    mechc.export_wasm("flyball_governor", tmp_path, y0=y0)
    told = told_by(tmp_path, "flyball_governor", "m.advance(0.1); told.y = m.y;")
    end = model.simulate(0.1, y0, rtol=1e-10).y[-1]
    assert told["y"] == pytest.approx(end, rel=1e-8, abs=1e-8)


def test_the_command_writes_a_module_and_a_page(tmp_path, capsys):
    folder = tmp_path / "top"
    assert main(["export", "heavy_top", "--wasm", "--out", str(folder)]) == 0
    assert "heavy_top.html" in capsys.readouterr().out
    model = mechc.load("heavy_top")
    told = told_by(folder, "heavy_top", "told.from = m.y; m.advance(0.2); told.y = m.y;")
    end = model.simulate(0.2, np.array(told["from"]), rtol=1e-10).y[-1]
    assert told["y"] == pytest.approx(end, rel=1e-7, abs=1e-7)
