"""Outputs that a model was not compiled with are compiled when they are first asked for."""

import ctypes
import pickle

import numpy as np
import pytest
from sympy import Symbol, symbols
from sympy.physics.mechanics import KanesMethod, Particle, Point, ReferenceFrame, dynamicsymbols

import mechc
from benchmarks.problems.particle import particle
from mechc import progress
from mechc.compilation import build
from mechc.compilation.library.library import origin_of
from mechc.errors import (
    CompilerError,
    MechcError,
    MissingParameterError,
    UnavailableOutputError,
    UnknownNameError,
    ValueOutOfBoundsError,
)
from mechc.results.sampling import curve, sample
from mechc.system.reference import ModelReference
from tests.support.linkages.jointed import chain_joints
from tests.support.pendulums import pendulum, pushed_mass

pytestmark = pytest.mark.compiles

STATE = np.array([0.3, 0.7])
START, TIMES = {"q": 0.3}, np.linspace(0.0, 1.0, 5)
ALL = ("energy", "points", "accelerations", "sensitivities")


@pytest.fixture(scope="module")
def lean():
    """It was compiled without any output."""
    return mechc.compile(pendulum(7.0), outputs=(), defaults={"l": 1.2})


@pytest.fixture(scope="module")
def whole():
    return mechc.compile(pendulum(7.0), outputs=ALL, defaults={"l": 1.2})


def test_what_a_state_has_is_the_same_as_when_it_was_requested(lean, whole):
    before = lean.rhs(0.0, STATE), lean.mass_matrix(STATE)
    for output in ("energy", "points", "point_accelerations", "state_jacobian"):
        found, expected = (getattr(model, output)(STATE) for model in (lean, whole))
        np.testing.assert_allclose(found, expected, rtol=1e-14, atol=1e-15)
    found, expected = (model.linearize(STATE, inputs=["l"]) for model in (lean, whole))
    np.testing.assert_allclose(found.B, expected.B, rtol=1e-14, atol=1e-15)
    after = lean.rhs(0.0, STATE), lean.mass_matrix(STATE)
    assert all(np.array_equal(*both) for both in zip(before, after, strict=True))
    assert lean.knows_energy is False, "the model itself is the one it was"


def test_it_is_compiled_once_and_told_in_one_line(lean, monkeypatch, capsys):
    monkeypatch.setattr(progress, "PATIENCE", 0.0)
    monkeypatch.setattr(progress, "SILENCE", 600.0)
    before = {*build._compiled}
    other = mechc.compile(pendulum(7.5), outputs=())
    other.points(STATE)
    told = capsys.readouterr().err
    assert told.startswith("compiled points of pendulum in ")
    assert told.count("\n") == 1
    other.points(STATE)
    other.with_inputs({}).points(STATE)
    assert not capsys.readouterr().err
    assert {*build._compiled} - before <= {*build.cache.scenes()}, "all of it is in the cache"


@pytest.mark.slow
def test_a_motion_has_its_derivatives_and_the_same_steps(lean, whole):
    plain = lean.simulate(1.0, START, t_eval=TIMES, method="gauss8")
    found, expected = (
        model.simulate(1.0, START, t_eval=TIMES, sensitivities=["l"]) for model in (lean, whole)
    )
    assert np.array_equal(found.y, plain.y)
    np.testing.assert_allclose(found.sensitivity["l"], expected.sensitivity["l"], rtol=1e-11)
    for output in ("energy", "points", "point_accelerations"):
        both = (sol.sensitivity_of(output, "l") for sol in (found, expected))
        np.testing.assert_allclose(*both, rtol=1e-11, atol=1e-12)
    _, moved = lean.jvp(1.0, START, along={"l": 1.0})
    np.testing.assert_allclose(moved, expected.sensitivity["l"][-1], rtol=1e-11)


def test_a_motion_has_its_energy_work_and_curves(lean, whole, tmp_path):
    sol, expected = (model.simulate(1.0, START, t_eval=TIMES) for model in (lean, whole))
    assert "the energy is not known" in sol._repr_html_()
    assert np.isnan(np.genfromtxt(sol.save(tmp_path / "run.csv"), delimiter=",")[1:, 3]).all()
    for name in ("energy", "work"):
        found = getattr(sol, name)
        np.testing.assert_allclose(found, getattr(expected, name), rtol=1e-13, atol=1e-13)
    assert 0 <= sol.energy_drift < 1e-9
    run, names = sample(sol, 20), ("energy", "potential_energy", "q")
    np.testing.assert_array_equal(curve(run, "energy", False)[1], sol.output("energy", run.t))
    assert [curve(run, name, False)[0].label for name in names] == ["J", "J", "rad"]
    with pytest.raises(ValueOutOfBoundsError, match="point_velocities has the shape"):
        curve(run, "point_velocities", False)
    with pytest.raises(UnknownNameError, match="no quantity is called 'enrgy'"):
        curve(run, "enrgy", False)


@pytest.mark.parametrize("policy", [{}, {"checkpoints": 40_000}, {"method": "dop853"}])
def test_a_motion_of_before_has_its_gradient(lean, whole, policy):
    for ask in ({"end": "q"}, {"end": "energy", "integral": "q"}):
        found, expected = (
            model.simulate(3.0, START, **policy).gradient(**ask, by=["l", "q"])
            for model in (lean, whole)
        )
        assert found.value == pytest.approx(expected.value, rel=1e-12)
        for name in ("l", "q"):
            assert found[name] == pytest.approx(expected[name], rel=1e-9, abs=1e-11)


def test_a_batch_has_outputs_and_derivatives(lean, whole):
    ask = {
        "t_eval": TIMES, "outputs": ["points"], "reduce": ["max(energy)"], "sensitivities": ["l"],
        "progress": False,
    }  # fmt: skip
    found, expected = (
        model.simulate_batch(1.0, mechc.Assembly({"q": [0.3, 0.4]}), **ask)
        for model in (lean, whole)
    )
    for name in ("points", "max(energy)", "sensitivity"):
        np.testing.assert_allclose(found[name], expected[name], rtol=1e-11, atol=1e-12)
    assert found.model is lean


def test_a_fit_finds_the_length(lean):
    true = lean.simulate(2.0, START, {"l": 1.35}, t_eval=np.linspace(0.0, 2.0, 30))
    data = {"t": true.t, "points[1,0]": lean.points(true.y, {"l": 1.35})[:, 1, 0]}
    result = lean.fit(data, {"l": (0.5, 3.0)}, ["points[1,0]"], y0=START)
    assert result["l"] == pytest.approx(1.35, rel=1e-9)


def test_a_c_function_of_one_is_there(lean, whole):
    f, out = lean.c_function("kinetic_energy"), np.empty(1)
    address = np.ctypeslib.as_ctypes
    f.ctypes(0.0, ctypes.addressof(address(STATE)), ctypes.addressof(address(out)), f.data)
    assert out[0] == pytest.approx(whole.kinetic_energy(STATE), rel=1e-15)


def test_inputs_defaults_and_start_are_those_of_the_model():
    model = mechc.compile(pushed_mass(), outputs=(), defaults={"m": 2.0, "k": 3.0})
    driven = model.with_inputs({"F": lambda t: 5.0})
    jacobian = driven.state_jacobian([0.1, 0.2])
    np.testing.assert_allclose(jacobian, [[0.0, 1.0], [-1.5, 0.0]], atol=1e-15)
    sol = model.simulate(0.5, {"q": 0.1}, inputs={"F": 5.0}, sensitivities=["F", "q"])
    w = np.sqrt(1.5)
    assert sol.sensitivity["F"][-1, 0] == pytest.approx((1 - np.cos(0.5 * w)) / 3.0, rel=1e-9)
    assert sol.gradient(end="q", by=["q"])["q"] == pytest.approx(np.cos(0.5 * w), rel=1e-9)


def test_a_parameter_of_the_reactions_alone_has_its_default():
    """A force along the axis of the pin moves nothing."""
    ground, joints = chain_joints(1)
    push = (joints[0].child.masscenter, Symbol("F_z") * ground.z)
    values = {"F_z": 4.0, "m": 1.0, "l": 1.0}
    made = mechc.from_joints("pushed", joints, loads=[push], ground=ground, parameters=values)
    model = mechc.compile(made, outputs=())
    force = model.reactions([0.3, 0.2]).force
    assert force[0, 2] == pytest.approx(-4.0, rel=1e-14)


def test_a_stepper_has_outputs_with_its_present_inputs():
    q, u, push, m = *dynamicsymbols("q u F"), Symbol("m")
    model = mechc.compile(particle([q], [u], [push * q]), outputs=(), defaults={m: 2.0})
    stepper = model.stepper({"q": 0.1}, inputs={"F": 1})
    for force in (1.0, 50.0, -3.0):
        stepper.step(0.1, {"F": force})
        slope = stepper.outputs("rates", "state_jacobian")["state_jacobian"][1, 0]
        assert slope == pytest.approx(force / 2, rel=1e-14)
    assert stepper.outputs("energy")["energy"] == pytest.approx(stepper.y[1] ** 2, rel=1e-14)


# -- parameters of further outputs alone ----------------------------------------------------------


def slider():
    """A mass m on a spring k, at a height h that nothing but its potential energy depends on."""
    q, u, (m, k, g, h) = *dynamicsymbols("q u"), symbols("m k g h")
    return particle([q], [u], [-k * q], potential=k * q**2 / 2 + m * g * h)


def lean_slider(**defaults):
    return mechc.compile(slider(), outputs=(), defaults={"m": 2.0, "k": 3.0, **defaults})


SLID = np.array([0.5, 0.0])
SPRING = 0.375  # J, at that state


def test_each_model_has_its_own_defaults():
    for gravity in (9.81, 1.62):
        model = lean_slider(g=gravity, h=1)
        assert model.potential_energy(SLID) == pytest.approx(SPRING + 2 * gravity, rel=1e-14)
        again = pickle.loads(pickle.dumps(model))
        assert again.potential_energy(SLID) == model.potential_energy(SLID)
    with pytest.raises(MissingParameterError, match="g"):
        lean_slider(h=1).potential_energy(SLID)


def test_a_default_of_a_further_output_has_a_unit():
    model = mechc.compile(
        slider(), outputs=(), units={"h": "m"}, defaults={"m": 2, "k": 3, "g": 9.81, "h": "500 mm"}
    )
    assert model.potential_energy(SLID) == pytest.approx(SPRING + 9.81, rel=1e-14)
    wrong = mechc.compile(
        slider(), outputs=(), units={"h": "m"}, defaults={"m": 2, "k": 3, "g": 9.81, "h": "5 kg"}
    )
    with pytest.raises(ValueOutOfBoundsError, match="'kg' in '5 kg' is not one of its units"):
        wrong.potential_energy(SLID)


def test_a_parameter_of_a_further_output_is_given_with_it():
    model = lean_slider(h=1)
    for params in ({"g": 5}, {Symbol("g"): 5.0}, {"g": [5.0, 5.0]}):
        found = model.potential_energy(SLID, params)
        np.testing.assert_allclose(found, SPRING + 10, rtol=1e-14)
    assert model.energy(SLID, {"g": 5}) == pytest.approx(SPRING + 10, rel=1e-14)
    assert model.output("potential_energy", SLID, {"g": 5}) == model.energy(SLID, {"g": 5})
    f, out, address = model.c_function("potential_energy", {"g": 5}), np.empty(1), np.ctypeslib
    places = (ctypes.addressof(address.as_ctypes(each)) for each in (SLID, out))
    f.ctypes(0.0, *places, f.data)
    assert out[0] == model.energy(SLID, {"g": 5})
    with pytest.raises(UnknownNameError, match="gg"):
        model.potential_energy(SLID, {"gg": 5})


def test_derivatives_of_a_further_output_have_its_parameters():
    """The energy is k q(0)^2/2 + m g h, whatever the motion: dE/dm = g h."""
    sol = lean_slider(g=5, h=3).simulate(0.7, {"q": 0.5}, sensitivities=["m", "k", "q"])
    for name, slope in {"m": 15.0, "k": 0.125, "q": 1.5}.items():
        found = sol.sensitivity_of("energy", name)
        np.testing.assert_allclose(found, slope, rtol=1e-9)
    ends = {"energy": 1.0, "q": 2.0}
    gradient = sol.gradient(end=ends, integral="potential_energy", by=["g", "h", "m"])
    assert gradient["g"] == pytest.approx(6.0 * 1.7, rel=1e-12)
    assert gradient["h"] == pytest.approx(10.0 * 1.7, rel=1e-12)
    assert {*sol.gradient(end="energy")} == {"m", "k", "g", "h"}


def test_a_fit_compiles_its_quantities_at_once_and_finds_their_parameters(monkeypatch, capsys):
    monkeypatch.setattr(progress, "PATIENCE", 0.0)
    monkeypatch.setattr(progress, "SILENCE", 600.0)
    q, u, (m, k, g) = *dynamicsymbols("q u"), symbols("m k g")
    kane = particle([q], [u], [-k * q], potential=k * q**2 / 2 + m * g)
    model = mechc.compile(kane, outputs=(), defaults={"m": 2.0, "k": 3.0})
    capsys.readouterr()
    t = np.linspace(0.0, 2.0, 20)
    data = {"t": t, "energy": np.full(20, 0.375 + 10), "points[0,0]": np.zeros(20), "other": t}
    result = model.fit(data, {"g": (1.0, 20.0)}, y0={"q": 0.5})
    assert result["g"] == pytest.approx(5.0, rel=1e-9)
    told = [line for line in capsys.readouterr().err.splitlines() if line.startswith("compiled")]
    assert [line.rpartition(" in ")[0] for line in told] == [
        "compiled energy and points and sensitivities of KanesMethod"
    ]


def test_points_of_a_sweep_have_their_own_parameters():
    """A mass on the parabola y = x^2 at the height b, which its equations do not contain."""
    (x, y, u, v), b = dynamicsymbols("x y u v"), Symbol("b")
    frame, origin = ReferenceFrame("N"), Point("O")
    origin.set_vel(frame, 0)
    place = origin.locatenew("P", x * frame.x + y * frame.y + b * frame.z)
    place.set_vel(frame, u * frame.x + v * frame.y)
    kane = KanesMethod(
        frame, [x], [u], kd_eqs=[x.diff() - u, y.diff() - v], q_dependent=[y], u_dependent=[v],
        configuration_constraints=[y - x**2], velocity_constraints=[v - 2 * x * u],
    )  # fmt: skip
    kane.kanes_equations([Particle("mass", place, Symbol("m"))], [(place, -x * frame.x)])
    model = mechc.compile(kane, outputs=(), defaults={"m": 2.0, "b": 0.25})
    assert model.parameters == ("m",)
    sweep = model.sweep_positions("x", [0.0, 0.5, 1.0])
    np.testing.assert_allclose(sweep.points[1, -1], [0.5, 0.25, 0.25], rtol=1e-14)
    np.testing.assert_array_equal(sweep.point_sensitivity("b")[:, -1], [[0.0, 0.0, 1.0]] * 3)
    with pytest.raises(UnknownNameError, match="no parameter is called 'c'"):
        sweep.point_sensitivity("c")


# -- exports --------------------------------------------------------------------------------------


def test_a_model_is_exported_with_its_loops_closed(tmp_path, model):
    params = {"l_3": 3.5}
    y0 = model.assemble({"theta_0": 1.2}, params=params)
    mechc.export_c(model, tmp_path / "model", y0={"theta_0": 1.2}, params=params)
    mechc.export_c("four_bar", tmp_path / "name", y0=y0, params=params)
    for file in (tmp_path / "name").iterdir():
        assert (tmp_path / "model" / file.name).read_text("utf-8") == file.read_text("utf-8")


def test_a_start_of_an_export_closes_the_loops_of_what_is_fixed(tmp_path, model):
    state = model.assemble({"theta_0": 1.2}, params={"l_3": 3.5})
    mechc.export_c(model, tmp_path / "names", fix={"l_3": 3.5}, y0={"theta_0": 1.2})
    mechc.export_c(model, tmp_path / "state", fix={"l_3": 3.5}, y0=state)
    both = ((tmp_path / each / "main.c").read_text("utf-8") for each in ("names", "state"))
    assert next(both) == next(both)


def test_values_of_an_export_have_units(tmp_path, model):
    mechc.export_c(model, tmp_path / "typed", params={Symbol("l_3"): "3500 mm"})
    mechc.export_c(model, tmp_path / "number", params={"l_3": 3.5})
    for folder, mass in {"own": "2500 g", "plain": 2.5}.items():
        mechc.export_c(slider(), tmp_path / folder, units={"m": "kg"}, defaults={"m": mass})
    for first, second in (("typed", "number"), ("own", "plain")):
        folders = (sorted((tmp_path / each).glob("*.c")) for each in (first, second))
        one, other = ("".join(path.read_text("utf-8") for path in paths) for paths in folders)
        assert one == other
    with pytest.raises(ValueOutOfBoundsError, match="'kg' in '3 kg' is not one of its units"):
        mechc.export_c(model, tmp_path / "wrong", params={"l_3": "3 kg"})


def test_an_exported_model_has_the_parameters_of_further_outputs(tmp_path):
    model = lean_slider(g=9.81, h=0.5)
    start = {"outputs": ["energy"], "y0": {"q": 0.5}}
    mechc.export_c(model, tmp_path / "default", **start)
    mechc.export_c(model, tmp_path / "moon", params={"g": 1.625}, **start)
    values = (tmp_path / "default" / "KanesMethod.c").read_text("utf-8")
    default, moon = ((tmp_path / n / "main.c").read_text("utf-8") for n in ("default", "moon"))
    assert "9.81" in values
    assert "1.625" not in default
    assert "1.625" in moon


def test_an_exported_model_has_its_defaults_and_further_outputs(tmp_path, lean):
    mechc.export_c(lean, tmp_path, fix={"m": 2.5}, outputs=["energy", {"twice": 2 * Symbol("l")}])
    code, header = ((tmp_path / f"pendulum.{end}").read_text("utf-8") for end in "ch")
    assert "1.2" in code
    assert "kinetic_energy" in header
    assert "twice" in header
    with pytest.raises(MechcError, match="exported as it was compiled: units cannot be changed"):
        mechc.export_c(lean, tmp_path, units={"l": "mm"})


# -- where it cannot be compiled ------------------------------------------------------------------


def test_without_a_description_the_error_says_so(lean, monkeypatch, tmp_path):
    monkeypatch.setattr(build, "_compiled", {})
    key = lean.build["key"]
    found = mechc.Model.of_reference(ModelReference("", custom=True, key=key))
    np.testing.assert_array_equal(found.rhs(0.0, STATE, {"l": 1.2, "m": 1.0}), lean.rhs(0.0, STATE))
    with pytest.raises(UnavailableOutputError, match="has the compiled model, but not its descr"):
        found.points(STATE, {"l": 1.2, "m": 1.0})
    data = {"t": [0.0, 0.5, 1.0], "points[1,0]": [1.0, 1.1, 1.2]}
    with pytest.raises(UnavailableOutputError, match="has the compiled model, but not its descr"):
        found.fit(data, {"l": (0.5, 3.0)}, params={"m": 1.0}, y0=START)
    with pytest.raises(UnavailableOutputError, match="no sensitivities"):
        found.simulate(1.0, START, {"l": 1.2, "m": 1.0}, sensitivities=["l"])
    with pytest.raises(MechcError, match="description of pendulum is not at hand"):
        mechc.export_c(found, tmp_path)
    mechc.compile(pendulum(7.0), outputs=(), defaults={"l": 1.2})  # it is at hand again
    assert found.points(STATE, {"l": 1.2, "m": 1.0}).shape == (2, 3)


def test_without_a_compiler_the_error_says_so(fresh, monkeypatch):
    model = mechc.load("four_bar")
    monkeypatch.setattr(model.system, "_wider", {})
    monkeypatch.setenv("CC", str(fresh / "nowhere"))
    with pytest.raises(CompilerError, match="nowhere"):
        model.point_accelerations(np.zeros(6))


def test_a_variant_of_the_library_is_found_again_by_its_name():
    origin = origin_of("pendulum", {}, {"fix": {"g": 9.81}})
    wider = origin.with_outputs(frozenset({"accelerations"}))
    assert "accelerations" in wider.reference.options["outputs"]
    assert wider.reference.options["fix"] == {"g": 9.81}
