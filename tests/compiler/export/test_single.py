"""Exported C in single precision: its text, and motions whose distance from doubles is rounding."""

import ctypes
import subprocess

import numpy as np
import pytest
from mechc_codegen.errors import CodegenError
from mechc_codegen.export.single import single
from sympy import Symbol
from sympy.physics.mechanics import dynamicsymbols

import mechc
from tests.compiler.export.test_standalone import (
    COMPILERS,
    EMULATED,
    NATIVE,
    STRICT,
    Exported,
    compiler_of,
    last_state,
)

EPSILON = float(np.finfo(np.float32).eps)
FLAGS = (*STRICT, "-Wdouble-promotion")


class Single:
    """Functions of a file in single precision, called with NumPy arrays."""

    def __init__(self, folder, name, states, p, y0):
        library = folder / f"{name}_single.so"
        command = [*NATIVE, *FLAGS, "-O1", "-shared", "-fPIC", "-o", library, f"{name}.c", "-lm"]
        subprocess.run(command, cwd=folder, check=True)
        self.library, self.name = ctypes.CDLL(str(library)), name
        self.model = np.zeros(100_000, np.float32)
        self.parameters = np.array([*p, 0.0], np.float32)
        assert self.call("set", self.model, self.parameters, 0.0, y0.astype(np.float32)) == 0

    def call(self, name, *arguments):
        passed = [
            ctypes.c_void_p(a.ctypes.data) if isinstance(a, np.ndarray) else ctypes.c_float(a)
            for a in arguments
        ]
        return getattr(self.library, f"{self.name}_{name}")(*passed)

    def moved(self, y, end, count):
        """The states after each of so many steps."""
        y, states = y.astype(np.float32), []
        for n in range(count):
            assert self.call("step", self.model, n * end / count, end / count, y) == 0
            states.append(y.astype(float))
        return np.array(states)


def test_only_numbers_are_translated():
    text = (
        '/* 1.0 double */ double x = 1.0e-3*.5 + 2.*fabs(y) + 1e5; // sin(1.0)\n"1.0" 0x1F 3 a1.b'
    )
    found = '/* 1.0 double */ float x = 1.0e-3f*.5f + 2.f*fabsf(y) + 1e5f; // sin(1.0)\n"1.0" 0x1F'
    assert single(text) == f"{found} 3 a1.b"
    assert single("x > 1e-300 && y < 1e300") == "x > FLT_MIN && y < FLT_MAX"


def test_another_type_is_refused(tmp_path):
    with pytest.raises(CodegenError, match="double or float"):
        mechc.export_c("pendulum", tmp_path / "none", real="half")


@pytest.mark.slow
@pytest.mark.parametrize("compiler", COMPILERS, ids=lambda command: command[0].split("/")[-1])
def test_it_compiles_without_a_warning_and_has_no_double(tmp_path, compiler):
    mechc.export_c("four_bar", tmp_path, real="float")
    command = [*compiler, *FLAGS, "-O2", "-c", "four_bar.c", "main.c"]
    subprocess.run(command, cwd=tmp_path, check=True)
    nothing = subprocess.run(
        [*compiler, "-std=c99", "-E", "-P", "four_bar.c"], cwd=tmp_path, check=True,
        capture_output=True, text=True,
    ).stdout  # fmt: skip
    own = nothing[nothing.index("FOUR_BAR_COORDINATES") :]
    own = own[own.index("mechc_") :]
    assert "float" in own
    assert "four_bar_step(const four_bar_model *model, float t, float h, float *y)" in own


@pytest.mark.parametrize("factor", [1e40, 1e-40])
def test_numbers_that_no_float_is_near_to_are_refused(tmp_path, factor):
    """They became the largest and the least float."""
    q, u = dynamicsymbols("q u")
    given = mechc.from_equations([q], [u], None, [factor * q])
    mechc.export_c(given, tmp_path)
    with pytest.raises(CodegenError, match="has no float near it"):
        mechc.export_c(given, tmp_path, real="float")


def test_values_that_no_float_is_near_to_are_refused_and_tiny_starts_are_zero(tmp_path):
    q, u = dynamicsymbols("q u")
    given = mechc.from_equations([q], [u], None, [Symbol("k") * q])
    for value in (1e-40, 1e40):
        with pytest.raises(CodegenError, match="has no float near it"):
            mechc.export_c(given, tmp_path, params={"k": value}, real="float")
    mechc.export_c(given, tmp_path, params={"k": 1.0}, y0=[1e-50, 1.0], real="float")
    assert "{0.0f, 1.0f}" in (tmp_path / "main.c").read_text("utf-8")


CASES = {
    "four_bar": ({}, {"l_3": 3.5}, {"theta_0": 1.1, "omega_0": 2.0}, 1.0),
    "pendulum": ({"links": 2}, {}, {"theta_0": 1.0, "theta_1": 0.4}, 1.0),
    "slider_crank": ({}, {}, None, 0.5),
    "windows": ({}, {}, None, 0.5),
    "heavy_top": ({}, {}, None, 0.02),
}


def prepared(tmp_path, name):
    """The model and both exports at the start of a case."""
    options, params, start, end = CASES[name]
    model = mechc.load(name, **options)
    start = dict(model.start) if start is None else start
    q = {n: v for n, v in start.items() if n in model.coordinates}
    u = {n: v for n, v in start.items() if n in model.speeds}
    y0 = model.assemble(q, u, params=params)
    p = model.system.parameter_set.resolve(params)
    for real in ("double", "float"):
        mechc.export_c(name, tmp_path / real, real=real, **options)
    return (
        model,
        Exported(tmp_path / "double", name, len(y0), p, y0),
        Single(tmp_path / "float", name, len(y0), p, y0),
        (y0, params, end),
    )


def run_double(c, y0, end, count):
    y = np.array(y0)
    for n in range(count):
        status, y = c.step(end / count, y, n * end / count)
        assert status == 0
    return y


def growth(c, y0, end, count):
    """The largest factor by which a change of the start grows, over all states on the way."""
    most, size = 1.0, 1e-6
    exact = run_double(c, y0, end, count)
    for k in range(len(y0)):
        moved = np.array(y0)
        moved[k] += size
        most = max(most, np.abs(run_double(c, moved, end, count) - exact).max() / size)
    return most


def rounding(c, y0, end, count):
    """What rounding the state in each step, to some units of its size, comes to at the end."""
    size = max(1.0, np.abs(run_double(c, y0, end, count)).max())
    return 4.0 * count * EPSILON * size * growth(c, y0, end, count)


@pytest.mark.slow
@pytest.mark.parametrize("name", CASES)
def test_motions_differ_from_those_of_doubles_by_rounding(tmp_path, name):
    """Each step rounds the state, by some units of its size; the motion carries that on."""
    model, doubles, floats, (y0, params, end) = prepared(tmp_path, name)
    near, count = y0.astype(np.float32).astype(float), 400
    if len(model.constraints(y0, params)):
        assert doubles._call("project", doubles.model, 0.0, near) == 0
    states = floats.moved(y0, end, count)
    exact = run_double(doubles, near, end, count)
    assert 0.0 < np.abs(states[-1] - exact).max() < rounding(doubles, near, end, count)
    gaps = [np.abs(model.constraints(y, params)).max(initial=0.0) for y in states[:: count // 10]]
    length = np.abs(model.system.parameter_set.resolve(params)).max(initial=1.0)
    assert max(gaps) < 32.0 * EPSILON * max(1.0, length) * max(1.0, np.abs(states).max())


@pytest.mark.slow
def test_the_error_is_the_methods_until_rounding(tmp_path):
    """Long steps have the error that they have with doubles, short ones that of rounding."""
    model, doubles, floats, (y0, params, end) = prepared(tmp_path, "four_bar")
    exact = model.simulate(end, y0, params, rtol=1e-12).y[-1]

    def errors(count):
        ends = floats.moved(y0, end, count)[-1], run_double(doubles, y0, end, count)
        return [np.abs(y - exact).max() for y in ends]

    for count in (10, 20):
        in_single, in_double = errors(count)
        assert in_double > 1e-3
        assert in_single == pytest.approx(in_double, abs=rounding(doubles, y0, end, count))
    in_single, in_double = errors(640)
    assert 100.0 * in_double < in_single < 640 * 16.0 * EPSILON


@pytest.mark.slow
@pytest.mark.parametrize("processor", EMULATED)
def test_it_runs_for_other_processors(tmp_path, processor, thorough):
    model = mechc.load("four_bar")
    y0 = model.assemble({"theta_0": 1.1}, {"omega_0": 2.0}, params={"l_3": 3.5})
    mechc.export_c("four_bar", tmp_path, y0=y0, params={"l_3": 3.5}, t_end=1.0, real="float")
    command = [*compiler_of(processor, thorough, tmp_path, "-Wdouble-promotion"), *FLAGS, "-O2"]
    command += ["-o", "run", "four_bar.c", "main.c", "-lm"]
    subprocess.run(command, cwd=tmp_path, check=True)
    done = subprocess.run(
        [EMULATED[processor][0], tmp_path / "run", "1", "0.0025"],
        capture_output=True,
        text=True,
        check=True,
    )
    end = model.simulate(1.0, y0, {"l_3": 3.5}, rtol=1e-11).y[-1]
    assert last_state(done.stdout) == pytest.approx(end, abs=400 * 16.0 * EPSILON)
