"""Scenes of every kind as exported C, used as its page shows: sound, and the model's numbers."""

import os
import re
import subprocess
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
import sympy as sm
from sympy.physics.mechanics import dynamicsymbols

import mechc
from benchmarks.problems.particle import particle
from mechc.compilation import toolchain
from tests.support import ROOT

t = dynamicsymbols._t
MAIN = ROOT / "tests" / "support" / "trust" / "exported_main.c"
STRICT = ("-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-O1", "-g1")
SANITIZED = ("-fsanitize=address,undefined", "-fno-sanitize-recover=all")
STEPS, LENGTH = 200, 1e-3
ROUNDING = {"double": 1e-12, "float": 2e-5}


class Case:
    """What is exported, how, and where its motion begins."""

    def __init__(self, described, y0, *, follows=(), inputs=None, warns=None, **options):
        self.described, self.y0, self.options = described, np.array(y0, float), options
        self.follows, self.inputs, self.warns = follows, inputs or {}, warns


q, x, y, z, u, v, w = dynamicsymbols("q x y z u v w")
m, g, l, k, c = sm.symbols("m g l k c")
F, G, H, s = dynamicsymbols("F G H s")
NUMBERS = {"m": 1.3, "g": 9.81, "l": 0.8, "k": 3.0}


def numbers(*names):
    return {name: NUMBERS[name] for name in names}


def plain():
    """A spring whose stiffness follows the mass."""
    kane = particle([x, y], [u, v], [-k * x, -m * g])
    given = numbers("m", "g") | {"k": 2 * m}
    return Case(kane, [0.3, 0.0, 0.1, 0.4], follows=["k"], defaults=given)


def without_parameters():
    return Case(particle([x], [u], [-sm.sin(x)], 1), [0.3, 0.5])


def loop():
    """A bob on a circle."""
    kane = particle([x, y], [u, v], [0, -m * g], closed=[x**2 + y**2 - l**2])
    return Case(kane, [0.48, -0.64, 0.8, 0.6], defaults=numbers("m", "g", "l"))


def loop_with_inputs():
    """The same, with three forces that are left open."""
    kane = particle([x, y], [u, v], [F + G, H - m * g], closed=[x**2 + y**2 - l**2])
    return Case(
        kane, [0.48, -0.64, 0.8, 0.6], defaults=numbers("m", "g", "l"),
        inputs={"F": 0.7, "G": -0.2, "H": 1.5},
    )  # fmt: skip


def loop_that_an_input_moves():
    """The radius is an input: the rows ask for its rates too."""
    kane = particle([x, y], [u, v], [0, -m * g], closed=[x**2 + y**2 - s**2])
    return Case(kane, [0.48, -0.64, 0.8, 0.6], defaults=numbers("m", "g"), inputs={"s": 0.8})


def loop_whose_row_an_input_scales():
    """Without the input a row is none, and was not counted: y stood free."""
    kane = particle([x, y, z], [u, v, w], [0, -m * g, 0], closed=[s * (y - 1), x**2 + z**2 - 1])
    start = [0.6, 1.0, 0.8, 0.8, 0.0, -0.6]
    return Case(kane, start, defaults=numbers("m", "g"), inputs={"s": 2.0})


def states():
    """A controller's integral, and a load that is left open."""
    kane = particle([x], [u], [F - k * z - m * u])
    return Case(
        kane, [0.3, 0.2, 0.5], defaults=numbers("m", "k") | {"c": 0.4}, inputs={"F": 0.9},
        states={z: x - c},
    )  # fmt: skip


def tables():
    """Loads from samples of one and two arguments, held, extended and repeated."""
    at = [0.0, 0.25, 0.5, 0.75, 1.0]
    curve = mechc.Table(at, [0.0, 0.3, 0.2, -0.4, 0.1], outside="hold")
    again = mechc.Table(at, [0.0, 0.3, 0.2, -0.4, 0.0], outside="repeat")
    lines = mechc.Table(at, [0.0, 0.3, 0.2, -0.4, 0.1], kind="linear")
    surface = mechc.Table(at, at, np.outer(np.cos(at), at))
    kane = particle([x, y], [u, v], [curve(x) - k * again(5 * x), surface(x, y) + lines(t)])
    given = {"curve": curve(3 * x), "again": again(-7 * x), "lines": lines(5 * y)}
    given["slope"] = given["lines"].diff(y)
    return Case(kane, [0.3, 0.4, 0.5, -0.2], defaults=numbers("m", "k"), outputs=(given,))


def pieces():
    """A spring that pulls and does not push, and a bump."""
    pull = sm.Piecewise((-20 * (x - 0.31), x > 0.31), (0, True))
    kane = particle([x], [u], [pull - k * sm.Abs(u)])
    return Case(kane, [0.4, -0.2], defaults=numbers("m", "k"))  # a step would lose its order there


def stops():
    """A slider between stops, which are left out with a word."""
    robot = """<robot name="slider"><link name="ground"/><link name="slide"><inertial>
        <mass value="1.3"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
        </link><joint name="rail" type="prismatic"><parent link="ground"/><child link="slide"/>
        <axis xyz="0 0 1"/><limit lower="-9" upper="5"/><dynamics damping="0.4"/>
        </joint></robot>"""
    with TemporaryDirectory() as folder:
        file = Path(folder) / "slider.urdf"
        file.write_text(robot, "utf-8")
        return Case(
            mechc.from_urdf(file, limits="stop"), [0.3, 0.5], warns=mechc.SkippedPartWarning
        )


def nonholonomic():
    """A skate."""
    theta, omega = dynamicsymbols("theta omega")
    rows = [v * sm.cos(theta) - u * sm.sin(theta)]
    equations = mechc.from_equations(
        [x, y, theta], [u, v, omega], sm.diag(m, m, k), [-m * g / 2, 0, 0],
        velocity_constraints=rows, name="skate",
    )  # fmt: skip
    return Case(equations, [0, 0, 0.3, 0.9, 0.9 * np.tan(0.3), 1.1],
                defaults=numbers("m", "g", "k"))  # fmt: skip


CASES = {
    each.__name__: each
    for each in (
        loop_with_inputs, plain, without_parameters, loop, loop_that_an_input_moves,
        loop_whose_row_an_input_scales, states, tables, pieces, stops, nonholonomic,
    )
}  # fmt: skip


def written(case, folder, real):
    """The files; the words of a case that leaves something out are expected."""
    arguments = (case.described, folder)
    options = {"name": "scene", "real": real, **case.options}
    if case.warns is None:
        return mechc.export_c(*arguments, **options)
    with pytest.warns(case.warns):
        return mechc.export_c(*arguments, **options)


def listed(header):
    """Name, label and width of each output, from the words above its declaration."""
    found = re.findall(r"/\* (.*), ([\dx ]+|one number) \*/\nvoid scene_(\w+)\(", header)
    return [(name, label, int(np.prod([int(n) for n in re.findall(r"\d+", size)] or [1])))
            for name, size, label in found]  # fmt: skip


def built(folder, real):
    """The exported file with the program that uses it, in the folder."""
    header = (folder / "scene.h").read_text("utf-8")
    sizes = {
        word: int(re.search(rf"SCENE_{word} = (\d+)", header)[1])
        for word in ("STATES", "PARAMETERS", "INPUTS")
    }
    outputs = "".join(f" X({label}, {width})" for _, label, width in listed(header))
    defined = {"NAME": "scene", "HEADER": '"scene.h"', "REAL": real, **sizes, "OUTPUTS(X)": outputs}
    command = [*toolchain.compiler(), *STRICT, *SANITIZED, "-I."]
    command += ["-Wdouble-promotion"] if real == "float" else []
    command += [f"-D{word}={value}" for word, value in defined.items()]
    subprocess.run([*command, MAIN, "scene.c", "-lm", "-o", "run"], cwd=folder, check=True)


def said(folder, numbers):
    """Lines of the program: word -> rows of numbers."""
    done = subprocess.run(
        ["./run"], cwd=folder, input=" ".join(map(repr, map(float, numbers))), text=True,
        capture_output=True, check=False, timeout=120,
        env={**os.environ, "UBSAN_OPTIONS": "print_stacktrace=1"},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[:4000]
    assert done.stderr == ""
    found = {}
    for row in done.stdout.splitlines():
        word, *values = row.split()
        found.setdefault(word, []).append([float(value) for value in values])
    return found


@pytest.mark.slow(cases=3)
@pytest.mark.parametrize("name", CASES)
def test_exported_c_is_sound_and_is_the_model(name, tmp_path):
    """What is set is what was given, nothing beside it is touched, and values are the model's."""
    case = CASES[name]()
    model = mechc.compile(case.described, **case.options)
    slots, given = model.system.input_values, {"inputs": case.inputs} if case.inputs else {}
    end = model.simulate(STEPS * LENGTH, case.y0, rtol=1e-12, **given).y[-1]
    params = np.array([model.defaults[n] for n in model.parameters])
    preset = [np.nan if n in case.follows else x for n, x in model.defaults.items()]
    moved = model.with_inputs(case.inputs) if case.inputs else model
    for real, rounding in ROUNDING.items():
        written(case, tmp_path / real, real)
        built(tmp_path / real, real)
        for driven in range(1 + bool(case.inputs)):
            values = [case.inputs.get(slot, 0.0) for slot in slots]  # rates are zero
            found = said(tmp_path / real, [STEPS, LENGTH, *case.y0, 0, *values, driven])
            near = {"rel": rounding, "abs": rounding}
            words = ("set", "again", "project", "assemble")
            assert [found[word] for word in words] == [[[0]]] * 4
            assert found["defaults"][0] == pytest.approx(preset, rel=rounding, nan_ok=True)
            assert found["parameters"][0] == pytest.approx(params, rel=rounding)
            assert found["inputs"] == [[0.0] * len(slots)]
            assert found["drive"] == [[0]]
            assert set(map(tuple, found["beyond"])) == {(1.0,)}
            for word in ("start", "assembled"):
                assert found[word][0] == pytest.approx(case.y0, **near)
            for output, label, _ in listed((tmp_path / real / "scene.h").read_text("utf-8")):
                values = np.ravel(moved.output(output, case.y0))
                assert found[label][0] == pytest.approx(values, **near), output
            assert found["end"][0] == pytest.approx(end, abs=STEPS * rounding + 1e-10)
