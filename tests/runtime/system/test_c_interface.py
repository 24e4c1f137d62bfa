"""Models called without Python in between: SciPy's LowLevelCallable, numba, ctypes, C."""

import ctypes
import gc
import re
import shutil
import threading
from pathlib import Path

import numpy as np
import pytest
from scipy import LowLevelCallable
from scipy.integrate import IntegrationWarning, quad
from scipy.special import ellipk

import mechc
from mechc.errors import UnknownNameError, ValueOutOfBoundsError
from tests.support import ROOT
from tests.support.pendulums import pendulum

pytestmark = pytest.mark.compiles

PAGE = ROOT / "docs" / "c_interface.md"
BLOCKS = re.findall(r"^```(\w+)(?: (\w+))?\n(.*?)^```", PAGE.read_text("utf-8"), re.S | re.M)


@pytest.fixture(scope="module")
def page():
    """What the examples of the page leave behind, but for those that need numba or C."""
    names = {}
    for language, needs, text in BLOCKS:
        if language == "python" and not needs:
            exec(compile(text, str(PAGE), "exec"), names)
    return names


def example(page, needs):
    (text,) = (text for _, wanted, text in BLOCKS if wanted == needs)
    exec(compile(text, str(PAGE), "exec"), page)


@pytest.fixture(scope="module")
def bar():
    model = mechc.load("four_bar")
    params = {"l_3": 3.5}
    return model, params, model.assemble({"theta_0": 1.4}, {"omega_0": 1.0}, params=params)


def test_a_period_by_quadrature_is_the_elliptic_integral(page):
    """And the one that is simulated."""
    exact = 4 * np.sqrt(1 / 9.81) * ellipk(np.sin(0.5) ** 2)
    assert 4 * page["quarter"] == pytest.approx(exact, rel=1e-9)
    sol = page["model"].simulate(exact, [1.0, 0.0], rtol=1e-12)
    np.testing.assert_allclose(sol.y[-1], [1.0, 0.0], atol=1e-9)


def test_the_work_of_a_load_is_what_its_potential_loses(page):
    model = page["model"]
    lost = model.potential_energy([0.0, 0.0]) - model.potential_energy([1.0, 0.0])
    assert page["work"] == pytest.approx(lost, rel=1e-13)
    assert page["work"] == pytest.approx(9.81 * (np.cos(1.0) - 1.0), rel=1e-13)


def test_several_arguments_are_set_in_their_order(page):
    assert page["mean_energy"] == pytest.approx(0.5 * 16 / 3, rel=1e-12)
    model, y = page["model"], np.array([0.3, 0.7])
    inner = model.integrand("kinetic_energy", ["u", "q"], y)
    value, _ = quad(inner, 0.0, 3.0, args=(0.2,))
    assert value == pytest.approx(0.5 * 27 / 3, rel=1e-13)


def test_a_number_of_arguments_that_is_wrong_gives_nan(page):
    inner = page["model"].integrand("kinetic_energy", ["q", "u"], np.zeros(2))
    with pytest.warns(IntegrationWarning, match="divergent|slowly|error"):
        assert np.isnan(quad(inner, 0.0, 1.0)[0])


def test_a_jitted_loop_agrees_with_simulate(page):
    pytest.importorskip("numba")
    example(page, "numba")
    sol = page["model"].simulate(2.0, [1.0, 0.0], {"l": 0.5}, rtol=1e-12)
    np.testing.assert_allclose(page["end"], sol.y[-1], atol=1e-11)


def test_c_that_includes_the_header_reads_the_model(page, tmp_path, monkeypatch):
    if shutil.which("gcc") is None:
        pytest.skip("no gcc here")
    monkeypatch.chdir(tmp_path)
    (text,) = (text for language, _, text in BLOCKS if language == "c")
    Path("energy.c").write_text(text)
    example(page, "c")
    energies = page["sol"].energy
    np.testing.assert_allclose(page["span"], [energies.min(), energies.max()], rtol=1e-14)


def test_ctypes_calls_every_output_with_its_parameters_bound(bar):
    """The very numbers that the model gives from Python, for outputs of any width."""
    model, params, y = bar
    for output in ("rates", "kinetic_energy", "mass_matrix", "points", "multipliers"):
        f = model.c_function(output, params)
        out = np.full(f.width + 1, 7.0)
        f.ctypes(0.0, y.ctypes.data, out.ctypes.data, f.data)
        expected = np.ravel(model.output(output, y, params))
        np.testing.assert_allclose(out[:-1], expected, rtol=1e-14, atol=1e-14)
        assert out[-1] == 7.0, "nothing is written beyond the width"
        assert (f.states, f.width) == (6, len(expected))


def test_scipy_takes_the_capsule_by_its_signature(bar):
    model, params, _ = bar
    f = model.c_function(params=params)
    taken = LowLevelCallable(f.capsule)
    assert taken.signature == f.signature == "void (double, double *, double *, void *)"
    assert model.integrand("kinetic_energy", "t", np.zeros(6)).signature == (
        "double (int, double *, void *)"
    )


def test_it_holds_its_parameters_whatever_becomes_of_the_model():
    """The data live as long as the callable, not as the arrays and objects it was made from."""
    model = mechc.compile(pendulum(2.5))
    values, y = np.array([1.0, 2.0]), np.array([0.3, 0.0])
    inner = model.integrand("forcing", "q", y, values)
    values[:], y[:] = 9.0, 9.0
    del model, values, y
    gc.collect()
    pressure = [np.random.default_rng(1).random(64) for _ in range(2000)]
    assert quad(inner, 0.0, 1.0)[0] == pytest.approx(-2.5 * 2.0 * np.sin(1.0), rel=1e-13)
    del pressure


def test_time_is_an_argument_too():
    torque = "log(2.5 - t)"  # compiled for the tests of the options too
    model = mechc.load("four_bar", friction=True, crank_torque=torque, coupler_point=True)
    y = model.assemble({"theta_0": 1.4})
    impulse, _ = quad(model.integrand("forcing", "t", y), 0.0, 1.0)
    of_the_torque = 2.5 * np.log(2.5) - 1.5 * np.log(1.5) - 1.0
    without = model.forcing(y, t=0.0)[0] - np.log(2.5)
    assert impulse == pytest.approx(without + of_the_torque, rel=1e-12)


def test_threads_share_one_function(bar):
    """Nothing is kept between calls; ctypes lets go of the interpreter meanwhile."""
    model, params, y = bar
    f = model.c_function(params=params)
    states = y + 1e-3 * np.arange(400)[:, None]
    found = np.empty((400, 6))

    def some(first):
        for _ in range(20):
            for i in range(first, 400, 4):
                f.ctypes(0.0, states[i].ctypes.data, found[i].ctypes.data, f.data)

    threads = [threading.Thread(target=some, args=(k,)) for k in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    np.testing.assert_allclose(found, model.rhs(0.0, states, params), rtol=1e-10)


def test_what_there_is_not_is_told(bar):
    model, _, y = bar
    with pytest.raises(UnknownNameError, match="output"):
        model.c_function("enregy")
    with pytest.raises(UnknownNameError, match="coordinate or speed"):
        model.integrand("forcing", "theta_9", y)
    with pytest.raises(ValueOutOfBoundsError, match="components 0 to 2 at one state, not 3"):
        model.integrand("forcing", "theta_0", y, component=3)
    with pytest.raises(ValueError, match="6 components"):
        model.integrand("forcing", "theta_0", y[:4])
    with pytest.raises(ValueOutOfBoundsError, match="one set of parameters"):
        model.c_function("forcing", {"l_3": [3.5, 3.6]})


def test_the_capsule_of_another_version_is_refused(bar):
    """Its name is the version's, and Python compares it."""
    pointer_of = ctypes.pythonapi.PyCapsule_GetPointer
    pointer_of.restype, pointer_of.argtypes = ctypes.c_void_p, [ctypes.py_object, ctypes.c_char_p]
    header = (Path(mechc.get_include()) / "model.h").read_text()
    (name,) = re.findall(r'#define MECHC_CAPSULE "(.*)"', header)
    assert pointer_of(bar[0].capsule, name.encode())
    with pytest.raises(ValueError, match="incorrect name"):
        pointer_of(bar[0].capsule, b"mechc.model.1")
