"""Exported C against the model, SymPy's numbers and the compiled integrators."""

import ctypes
import re
import shutil
import subprocess

import numpy as np
import pytest
import sympy as sm
import sympy.physics.mechanics as me
from mechc_codegen.errors import CodegenError
from mechc_codegen.export.standalone import csv_cell

import mechc
from mechc.compilation import toolchain

STRICT = ("-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic")
PACKAGED = toolchain.packaged_compiler()
COMPILERS = [(name,) for name in ("gcc", "clang") if shutil.which(name)]
COMPILERS += [tuple(PACKAGED)] if PACKAGED else []
NATIVE = COMPILERS[0] if COMPILERS else ("cc",)
EMULATED = {  # processor -> its emulator, the compiler's target
    "aarch64": ("qemu-aarch64", "aarch64-linux-musl"),
    "arm": ("qemu-arm", "arm-linux-musleabihf"),
}
WINE = shutil.which("wine64") or shutil.which("wine64", path="/usr/lib/wine")


class Exported:
    """Functions of an exported file, called with NumPy arrays."""

    def __init__(self, folder, name, states, p, y0, compiler=NATIVE):
        library = folder / f"{name}.so"
        command = [*compiler, *STRICT, "-O1", "-shared", "-fPIC", "-o", library, f"{name}.c", "-lm"]
        subprocess.run(command, cwd=folder, check=True)
        self._library, self._name = ctypes.CDLL(str(library)), name
        self.states, self.model = states, np.zeros(100_000)
        self.parameters = np.zeros(max(len(p), 1))
        self._call("defaults", self.parameters)
        self.parameters[: len(p)] = p
        assert self._call("set", self.model, self.parameters, 0.0, y0) == 0

    def output(self, name, size, y, t=0.0):
        out = np.full(size, np.nan)
        self._call(name, self.model, t, np.array(y), out)
        return out

    def step(self, h, y, t=0.0):
        end = np.array(y)
        return self._call("step", self.model, t, h, end), end

    def _call(self, name, *arguments):
        passed = [
            ctypes.c_void_p(a.ctypes.data) if isinstance(a, np.ndarray) else ctypes.c_double(a)
            for a in arguments
        ]
        return getattr(self._library, f"{self._name}_{name}")(*passed)


def cart():
    """A pendulum on a cart that a force moves."""
    x, theta, v, omega, F = me.dynamicsymbols("x theta v omega F")
    M, m, l, g = sm.symbols("M m l g")
    N = me.ReferenceFrame("N")
    A = N.orientnew("A", "Axis", (theta, N.z))
    A.set_ang_vel(N, omega * N.z)
    O = me.Point("O")
    O.set_vel(N, 0)
    C = O.locatenew("C", x * N.x)
    C.set_vel(N, v * N.x)
    P = C.locatenew("P", -l * A.y)
    P.v2pt_theory(C, N, A)
    kane = me.KanesMethod(N, [x, theta], [v, omega], [x.diff() - v, theta.diff() - omega])
    bodies = [me.Particle("cart", C, M), me.Particle("bob", P, m)]
    kane.kanes_equations(bodies, [(C, F * N.x - M * g * N.y), (P, -m * g * N.y)])
    return kane, (x, theta, v, omega), (M, g, l, m), F


@pytest.mark.parametrize(
    "compiler", [NATIVE, *(pytest.param(c, marks=pytest.mark.slow) for c in COMPILERS[1:])]
)
def test_rates_are_sympys_with_inputs_that_are_held(tmp_path, compiler):
    kane, states, parameters, F = cart()
    mechc.export_c(kane, tmp_path, name="cart")
    p, y, force = [1.2, 9.81, 0.7, 0.3], [0.1, 0.8, -0.4, 2.0], 3.0
    rhs = sm.lambdify([*states, *parameters, F], kane.mass_matrix_full.LUsolve(kane.forcing_full))
    c = Exported(tmp_path, "cart", 4, p, np.array(y), compiler)
    c.model[4 + _constants(tmp_path / "cart.h", "k")] = force
    assert c.output("rates", 4, y) == pytest.approx(np.ravel(rhs(*y, *p, force)), rel=1e-13)


def test_inputs_that_a_function_gives_drive_the_compiled_motion(tmp_path):
    """A force of time and state: Kutta's steps converge to the motion with the same function."""
    kane, _, names, _ = cart()
    p, y0 = [1.2, 9.81, 0.7, 0.3], np.array([0.1, 0.8, -0.4, 2.0])
    mechc.export_c(kane, tmp_path, name="cart")
    c, calls = Exported(tmp_path, "cart", 4, p, y0), []

    def force(t, q, u):
        return 3.0 * np.sin(2.0 * t) - 4.0 * q[0] - u[0]

    def drive(_, t, q, u, inputs):
        inputs[0] = force(t, q, u)
        calls.append(t)

    row = ctypes.POINTER(ctypes.c_double)
    kept = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_double, row, row, row)(drive)
    place = 4 + _constants(tmp_path / "cart.h", "k") + 1
    c.model.view(np.uint64)[place] = ctypes.cast(kept, ctypes.c_void_p).value
    model = mechc.compile(kane)
    params = dict(zip(map(str, names), p, strict=True))
    exact = model.simulate(1.0, y0, params, inputs={"F": force}, rtol=1e-11).y[-1]
    errors = []
    for count in (100, 200):
        y = y0
        for k in range(count):
            status, y = c.step(1.0 / count, y, k / count)
            assert status == 0
        errors.append(np.abs(y - exact).max())
    assert errors[1] < 1e-7
    assert 12 < errors[0] / errors[1] < 20
    assert {0.0, 0.005, 0.0025} <= set(calls)  # within steps too


def _constants(header, array):
    """The declared length of an array of the model."""
    text = header.read_text("utf-8")
    return int(text.split(f" {array}[")[1].split("]")[0])


def test_outputs_are_the_models(tmp_path):
    model = mechc.load("four_bar")
    y = model.assemble({"theta_0": 1.1}, {"omega_0": 2.0})
    mechc.export_c("four_bar", tmp_path)
    c = Exported(tmp_path, "four_bar", 6, model.system.parameter_set.resolve(None), y)
    for name in ("mass_matrix", "forcing", "points", "multipliers", "kinetic_energy"):
        expected = getattr(model, name)(y)
        found = c.output(name, expected.size, y).reshape(expected.shape)
        assert found == pytest.approx(expected, rel=1e-12, abs=1e-12), name
    assert c.output("rates", 6, y) == pytest.approx(model.rhs(0.0, y), rel=1e-12)


def test_steps_converge_with_order_four_and_stay_on_the_constraints(tmp_path):
    model = mechc.load("four_bar")
    y0 = model.assemble({"theta_0": 1.1}, {"omega_0": 2.0}, params={"l_3": 3.5})
    end = model.simulate(1.0, y0, {"l_3": 3.5}, rtol=1e-12).y[-1]
    mechc.export_c("four_bar", tmp_path)
    p = model.system.parameter_set.resolve({"l_3": 3.5})
    c, errors = Exported(tmp_path, "four_bar", 6, p, y0), []
    for count in (100, 200):
        y = y0
        for _ in range(count):
            status, y = c.step(1.0 / count, y)
            assert status == 0
        assert np.abs(model.constraints(y, {"l_3": 3.5})).max() < 1e-14
        assert np.abs(model.velocity_constraints(y, {"l_3": 3.5})).max() < 1e-13
        errors.append(np.abs(y - end).max())
    assert errors[1] < 1e-6
    assert 12 < errors[0] / errors[1] < 20


def compound_pendulum():
    """A uniform rod about one end: theta'' = -3 g sin(theta) / (2 l), of which a = l / 2."""
    theta, omega = me.dynamicsymbols("theta omega")
    a, g, inertia, l, m = sm.symbols("a g I l m")
    N = me.ReferenceFrame("N")
    A = N.orientnew("A", "Axis", (theta, N.z))
    A.set_ang_vel(N, omega * N.z)
    O = me.Point("O")
    O.set_vel(N, 0)
    C = O.locatenew("C", -l / 2 * A.y)
    C.v2pt_theory(O, N, A)
    rod = me.RigidBody("rod", C, A, m, (me.inertia(A, 0, 0, inertia), C))
    kane = me.KanesMethod(N, [theta], [omega], [theta.diff() - omega])
    kane.kanes_equations([rod], [(C, -m * g * N.y)])
    return kane, {l: 2 * a, inertia: m * l**2 / 12}


@pytest.mark.parametrize("real", ["double", "float"])
@pytest.mark.parametrize("given", [{}, {"m": 0.7}, {"a": 0.8}, {"a": 0.8, "l": 1.1}, {"I": 0.4}])
def test_parameters_that_follow_others_follow_them_until_they_are_set(tmp_path, real, given):
    """In a program that changes p after its defaults: l follows a, and I follows m and l."""
    kane, defaults = compound_pendulum()
    names, given = ["I", "a", "g", "l", "m"], {"a": 0.5, "g": 9.81, "m": 3.0} | given
    mechc.export_c(kane, tmp_path, name="rod", defaults=defaults, params=given, real=real)
    command = [*NATIVE, *STRICT, "-shared", "-fPIC", "-o", "rod.so", "rod.c", "-lm"]
    subprocess.run(command, cwd=tmp_path, check=True)
    library = ctypes.CDLL(str(tmp_path / "rod.so"))
    number = np.float64 if real == "double" else np.float32
    p, model, rates = np.zeros(5, number), np.zeros(1000, number), np.zeros(2, number)
    y = np.array([0.6, 0.0], number)
    t = (ctypes.c_double if real == "double" else ctypes.c_float)(0.0)

    def at(array):
        return ctypes.c_void_p(array.ctypes.data)

    library.rod_defaults(at(p))
    for name, value in given.items():
        p[names.index(name)] = value
    assert library.rod_set(at(model), at(p), t, at(y)) == 0
    library.rod_rates(at(model), t, at(y), at(rates))
    m, a = given["m"], given["a"]
    l = given.get("l", 2.0 * a)
    inertia = given.get("I", m * l**2 / 12.0)
    exact = -m * 9.81 * l / 2.0 * np.sin(0.6) / (inertia + m * l**2 / 4.0)
    rounding = 1e-14 if real == "double" else 1e-6
    assert rates == pytest.approx([0.0, exact], rel=rounding)
    library.rod_complete(at(p))
    assert p == pytest.approx([inertia, a, 9.81, l, m], rel=rounding)
    written = (tmp_path / "main.c").read_text("utf-8")
    assert all(f"/* {name} */" in written for name in given)
    assert "p[0] I, follows l, m" in (tmp_path / "rod.h").read_text("utf-8")


def test_a_default_of_a_parameter_without_effect_makes_no_place_among_the_parameters(tmp_path):
    """They stand as in the model; I_x of a planar rod made a place between others."""
    kane, _ = compound_pendulum()
    rod = kane.bodies[0]
    x = sm.Symbol("I_x")
    rod.central_inertia = rod.central_inertia + me.inertia(rod.frame, x, 0, 0)
    kane.kanes_equations(kane.bodies, kane.forcelist)
    model = mechc.compile(kane, defaults={x: 1.0, "g": 9.81})
    for described, options in ((model, {}), (kane, {"defaults": {x: 1.0, "g": 9.81}})):
        mechc.export_c(described, tmp_path, name="rod", **options)
        header = (tmp_path / "rod.h").read_text("utf-8")
        assert tuple(re.findall(r"p\[\d\] (\w+)", header)) == model.parameters


@pytest.mark.slow(cases=99)
@pytest.mark.parametrize("real", ["double", "float"])
def test_the_example_moves_with_what_follows_the_values_that_were_given(tmp_path, real):
    """A uniform coupler of another mass, whose inertia is given to the model by number."""
    model, params = mechc.load("four_bar"), {"m_1": 0.5, "l_3": 3.5}
    y0 = model.assemble({"theta_0": 1.1}, {"omega_0": 2.0}, params=params)
    mechc.export_c("four_bar", tmp_path, y0=y0, params=params, t_end=2.0, real=real)
    command = [*NATIVE, *STRICT, "-O1", "-o", "run", "four_bar.c", "main.c", "-lm"]
    subprocess.run(command, cwd=tmp_path, check=True)
    said = subprocess.run([tmp_path / "run"], capture_output=True, text=True, check=True).stdout
    end = model.simulate(2.0, y0, params | {"I_1": 0.5 * 2.0**2 / 12.0}, rtol=1e-11).y[-1]
    assert last_state(said) == pytest.approx(end, abs=1e-6 if real == "double" else 0.01)


@pytest.mark.parametrize("array", ["k", "inputs"])
def test_a_header_with_other_sizes_does_not_compile(tmp_path, array):
    """The code wrote to k[NK + 3] of a k[NK + 1], over inputs, drive and data."""
    mechc.export_c(cart()[0], tmp_path, name="cart")
    header = tmp_path / "cart.h"
    text = header.read_text("utf-8")
    header.write_text(re.sub(rf" {array}\[\d+\];", f" {array}[9];", text), "utf-8")
    command = [*NATIVE, *STRICT, "-fsyntax-only", "cart.c"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode != 0
    assert "mechc_sizes_of_standalone" in done.stderr


def test_a_step_that_fails_says_so_and_leaves_the_state(tmp_path):
    mechc.export_c("four_bar", tmp_path)
    model = mechc.load("four_bar")
    y0 = model.assemble({"theta_0": 1.1})
    c = Exported(tmp_path, "four_bar", 6, model.system.parameter_set.resolve(None), y0)
    header = (tmp_path / "four_bar.h").read_text("utf-8")
    assert "FOUR_BAR_NOT_FINITE = 4" in header
    status, y = c.step(np.inf, y0)
    assert status == 4
    assert (y == y0).all()


def test_the_example_compiles_as_it_is_and_prints_the_motion(tmp_path):
    model = mechc.load("four_bar")
    y0 = model.assemble({"theta_0": 1.1}, params={"l_3": 3.5})
    files = mechc.export_c("four_bar", tmp_path, y0=y0, params={"l_3": 3.5}, t_end=0.5)
    assert sorted(file.name for file in files) == sorted(
        ("CMakeLists.txt", "four_bar.c", "four_bar.h", "main.c")
    )
    command = [*NATIVE, *STRICT, "-o", "run", "four_bar.c", "main.c", "-lm"]
    subprocess.run(command, cwd=tmp_path, check=True)
    said = subprocess.run([tmp_path / "run"], capture_output=True, text=True, check=True).stdout
    heads, *rows = said.splitlines()
    assert heads.split(",") == ["t", *model.coordinates, *model.speeds]
    assert len(rows) == 501
    assert rows[-1].startswith("0.5,")
    end = model.simulate(0.5, y0, {"l_3": 3.5}, rtol=1e-11).y[-1]
    assert last_state(said) == pytest.approx(end, abs=1e-7)


def last_state(said):
    return np.array([float(word) for word in said.splitlines()[-1].split(",")[1:]])


@pytest.fixture(scope="module")
def example(tmp_path_factory):
    """The files of a run of 2 s, and where it should end."""
    model, folder = mechc.load("four_bar"), tmp_path_factory.mktemp("example")
    y0 = model.assemble({"theta_0": 1.1}, {"omega_0": 2.0}, params={"l_3": 3.5})
    mechc.export_c("four_bar", folder, y0=y0, params={"l_3": 3.5}, t_end=2.0)
    return folder, model.simulate(2.0, y0, {"l_3": 3.5}, rtol=1e-12).y[-1]


def moved(folder, compiler, before=()):
    """The last state of 8000 steps of the example, compiled by a command, run after another."""
    program = folder / "run"
    command = [*compiler, *STRICT, "-O2", "-o", program, "four_bar.c", "main.c", "-lm"]
    subprocess.run(command, cwd=folder, check=True)
    done = subprocess.run(
        [*before, program, "2", "0.00025"], capture_output=True, text=True, check=True
    )
    return last_state(done.stdout)


@pytest.mark.slow
@pytest.mark.parametrize("compiler", COMPILERS, ids=lambda command: command[0].split("/")[-1])
def test_the_example_is_the_motion_of_simulate_by_every_compiler(example, compiler):
    folder, end = example
    assert moved(folder, compiler) == pytest.approx(end, abs=2e-11)


def compiler_of(processor, thorough, folder, *flags):
    """The command that compiles for an emulated processor.

    For arm, unless every case is asked for, the files are compiled and that is all: linking first
    compiles a C library, for a minute.  The same files run with pointers of 32 bits as WebAssembly
    (``test_web.py``).
    """
    emulator, target = EMULATED[processor]
    if PACKAGED is None or shutil.which(emulator) is None:
        pytest.skip(f"{emulator} and the package ziglang are needed: apt-get install qemu-user")
    compiler = (*PACKAGED, "-target", target)
    if processor == "arm" and not thorough:
        command = [*compiler, *STRICT, *flags, "-O2", "-c", "four_bar.c", "main.c"]
        subprocess.run(command, cwd=folder, check=True)
        pytest.skip("compiled; run with --thorough")
    return (*compiler, "-static")


@pytest.mark.slow
@pytest.mark.parametrize("processor", EMULATED)
def test_the_example_runs_for_other_processors(example, processor, thorough):
    folder, end = example
    compiler = compiler_of(processor, thorough, folder)
    found = moved(folder, compiler, (EMULATED[processor][0],))
    assert found == pytest.approx(end, abs=2e-11)


@pytest.mark.slow
def test_the_example_runs_on_windows(example, tmp_path):
    """By Wine, with a prefix of its own."""
    if PACKAGED is None or WINE is None:
        pytest.skip("wine64 and the package ziglang are needed: apt-get install wine64")
    folder, end = example
    before = ("env", f"WINEPREFIX={tmp_path}", "WINEDEBUG=-all", WINE)
    found = moved(folder, (*PACKAGED, "-target", "x86_64-windows-gnu"), before)
    assert found == pytest.approx(end, abs=2e-11)


@pytest.mark.parametrize("name", ["1st", "a b", "a;b", "math", "Mechc_x", "", "a" * 60, 'x"\n'])
def test_a_name_that_is_no_prefix_is_refused(tmp_path, name):
    with pytest.raises(CodegenError, match="cannot begin the names"):
        mechc.export_c("pendulum", tmp_path / "none", name=name or " ")
    assert not (tmp_path / "none").exists()


def test_a_start_by_names_is_of_a_model(tmp_path):
    with pytest.raises(mechc.ValueOutOfBoundsError, match="needs the compiled model"):
        mechc.export_c("pendulum", tmp_path / "none", y0={"theta_0": 1.0})


@pytest.mark.parametrize(
    "given",
    [
        {"y0": [np.nan, 0.0]}, {"y0": [np.inf, 0.0]}, {"params": {"l_0": np.nan}},
        {"params": {"m_0": -1.0}}, {"t_end": np.inf}, {"t_end": -1.0},
    ],
)  # fmt: skip
def test_numbers_that_are_none_are_refused(tmp_path, given):
    """The example had the words nan and inf, which are not of C."""
    with pytest.raises(mechc.ValueOutOfBoundsError):
        mechc.export_c("pendulum", tmp_path / "none", **given)
    assert not (tmp_path / "none").exists()


def test_values_of_inputs_are_refused(tmp_path):
    """They were left out without a word: the force was 0."""
    kane, _, names, _ = cart()
    model = mechc.compile(kane, outputs=(), defaults=dict.fromkeys(names, 1.0))
    with pytest.raises(mechc.MechcError, match="inputs, and the model has of F"):
        mechc.export_c(model.with_inputs({"F": 3.0}), tmp_path)


def test_what_users_name_is_no_code(tmp_path):
    """Names with signs of C are comments without them."""
    kane, (_, theta, *_), *_ = cart()
    hostile = '*/ int system(const char *); /* "%n\\'
    mechc.export_c(kane, tmp_path, name="cart", outputs=({hostile: theta},))
    subprocess.run([*NATIVE, *STRICT, "-c", "cart.c", "main.c"], cwd=tmp_path, check=True)
    text = "".join(file.read_text("utf-8") for file in tmp_path.glob("*.[ch]"))
    assert "*/ int system" not in re.sub(r'"[^"\n]*"', "", text)  # but in strings of C


@pytest.mark.parametrize(
    ("name", "cell"),
    [
        ("q_1", "q_1"),
        ("=1+1", "'=1+1"),
        (" -x", "' -x"),
        ("q(1,2)", r"\"q(1,2)\""),
        ('@"%n', "___n"),
    ],
)
def test_names_are_one_cell_of_a_table_and_no_formula(name, cell):
    """The example printed "=1+1", which spreadsheets compute."""
    assert csv_cell(name) == cell


@pytest.mark.slow
@pytest.mark.parametrize("name", ["spatial_chain", "windows", "heavy_top", "flyball_governor"])
def test_other_structures_of_equations(tmp_path, name):
    """Trees walked link by link, loops on the ground, kinematics with poles."""
    model = mechc.load(name)
    y = model.assemble(*_filled_start(model))
    mechc.export_c(name, tmp_path)
    c = Exported(tmp_path, name, len(y), model.system.parameter_set.resolve(None), y)
    assert c.output("rates", len(y), y) == pytest.approx(model.rhs(0.0, y), rel=1e-11, abs=1e-11)
    status, end = c.step(1e-5, y)
    assert status == 0
    assert end == pytest.approx(model.simulate(1e-5, y, rtol=1e-12).y[-1], abs=1e-9)


def _filled_start(model):
    from mechc.assembly.initial_values import filled_start

    return filled_start(model.system, {}, {}, {})


def test_an_option_that_there_is_not_is_refused_by_its_name(tmp_path):
    kane, *_ = cart()
    with pytest.raises(mechc.UnknownNameError, match="no option of a mechanism is called 'input'"):
        mechc.export_c(kane, tmp_path, name="cart", input={"F": 1.0})
