"""Generated C is clean, readable and safe: it compiles without a warning for every instruction
set, says what each output is, and nothing that a user named can become code."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from mechc_codegen import Build, Mechanism, MechanismError, build_scene
from mechc_codegen.description.mechanism import (
    Constraint,
    Coordinate,
    Drawing,
    Parameter,
    Quantity,
    Speed,
)
from mechc_codegen.description.request import OPTIONAL, OutputRequest
from mechc_codegen.description.terms import multiplier
from mechc_codegen.emit import functions
from mechc_codegen.emit.printer import RealPrinter
from mechc_codegen.emit.units.instruction_sets import BASELINE, instruction_sets
from mechc_codegen.extension.build import signature
from mechc_codegen.extension.flags import FLAGS, OUTPUTS_ONLY_FLAGS, RUNTIME, STRICT
from sympy import (
    Abs,
    E,
    Expr,
    Function,
    I,
    Integer,
    Max,
    Rational,
    Symbol,
    acos,
    acosh,
    asin,
    atan,
    atan2,
    cos,
    cosh,
    erf,
    exp,
    gamma,
    log,
    nan,
    oo,
    pi,
    sin,
    sinh,
    sqrt,
    tan,
    tanh,
    zoo,
)
from sympy.physics.mechanics import Particle, Point, ReferenceFrame, RigidBody, dynamicsymbols
from sympy.physics.mechanics import inertia as dyadic

import mechc
from mechc.compilation import toolchain
from tests.support import scenes
from tests.support.compilers.compilation import checking

FOUND = tuple(toolchain.find_compiler() or ("cc",))
COMPILERS = [(c,) for c in ("gcc", "clang") if shutil.which(c)] or [FOUND]
BY_COMPILER = pytest.mark.parametrize("compiler", COMPILERS, ids=lambda words: Path(words[0]).name)
OF_C = {
    *("_GLOBAL_OFFSET_TABLE_", "__stack_chk_fail"),
    *("aligned_alloc", "calloc", "free", "realloc", "memcmp", "memcpy", "memmove", "memset"),
    *("sin", "cos", "tan", "asin", "acos", "atan", "atan2", "exp", "log", "sinh", "cosh", "tanh"),
    *("sqrt", "pow", "copysign", "nearbyint", "floor", "ceil", "fabs", "fmin", "fmax"),
    *("ilogb", "ldexp", "nextafter"),
    *("sinl", "cosl", "sincosl"),  # fine gaps; the last is gcc's for both where the library has it
}
q, u, f = dynamicsymbols("q"), dynamicsymbols("u"), Symbol("f")
t = dynamicsymbols._t


@cache
def built(scene: str) -> Build:
    return build_scene(scenes.SCENES[scene]())


def compiles(
    build: Build,
    folder: Path,
    compiler: tuple[str, ...],
    *extra: str,
    only: str | None = None,
    check: bool = False,
) -> None:
    """Every source, or one, with its own flags; any warning is an error.  ``check``: no more."""
    build.write(folder)
    units = {source: (*FLAGS, *flags) for source, flags in build.flags.items()}
    units["scene_outputs_only.c"] = (*OUTPUTS_ONLY_FLAGS, *build.widest_flags)
    for source, flags in units.items():
        if only not in (None, source):
            continue
        command = [*compiler, *STRICT, *flags, *extra, f"-I{RUNTIME}", f"-I{folder}"]
        target = folder / f"{source}.o"
        command += checking(compiler, target) if check else ["-c", "-o", str(target)]
        done = subprocess.run(
            [*command, str(folder / source)], capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, f"{source}: {done.stderr[:4000]}"
        assert done.stderr == ""


def symbols_of(compiled: Path) -> tuple[set[str], set[str]]:
    """What an object file offers to others, and what it needs of them."""
    if shutil.which("nm") is None:
        pytest.skip("no nm here")
    command = ["nm", "--extern-only", "--format=posix", str(compiled)]
    told = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    kinds = [line.split()[:2] for line in told.splitlines()]
    needed = {name for name, kind in kinds if kind == "U"}
    return {name for name, _ in kinds} - needed, needed


# -- it compiles ------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("scene", "source"),
    [
        pytest.param("guided swing", "scene_baseline.c", marks=pytest.mark.slow),
        pytest.param("swing", "scene_avx2.c", marks=pytest.mark.slow),
        pytest.param("everything", "scene_avx512.c", marks=pytest.mark.slow),
        ("bead", "scene_baseline.c"),
    ],
)
@BY_COMPILER
def test_optimised_scenes_compile_without_a_warning(
    compiler: tuple[str, ...], scene: str, source: str, tmp_path: Path
) -> None:
    """As they are shipped: some warnings come only with -O3.  One unit of each scene, for time.

    What comes out offers the unit and nothing else, and asks for memory and functions of C alone.
    """
    build = built(scene)
    if source not in build.sources:
        pytest.skip(f"this machine has no {source}")
    compiles(build, tmp_path, compiler, only=source)
    offered, needed = symbols_of(tmp_path / f"{source}.o")
    assert offered == {source.replace("scene", "mechc_unit").removesuffix(".c")}
    assert {"sin", "cos", "free"} <= needed <= OF_C


@pytest.mark.slow(cases=99)
@BY_COMPILER
def test_the_parts_of_a_long_stage_are_compiled_once(
    compiler: tuple[str, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each copy in line takes the compiler as long as all the rest."""
    assert built("four_bar").texts["scene_program.h"].count("MECHC_INLINE void FN(motion)") == 1
    monkeypatch.setattr(functions, "LONG", 10)
    long = build_scene(scenes.SCENES["four_bar"](), (BASELINE,))
    for name in ("configuration", "motion"):
        assert f"MECHC_SINGLE void FN({name})" in long.texts["scene_program.h"]
    compiles(long, tmp_path, compiler, "-O0", only="scene_baseline.c")
    done = subprocess.run(
        ["nm", tmp_path / "scene_baseline.c.o"], capture_output=True, text=True, check=True
    )
    assert done.stdout.count("mechc_scalar_locate_near") == 1


@pytest.mark.slow(cases=99)
@pytest.mark.parametrize("scene", scenes.SCENES)
@BY_COMPILER
def test_scenes_are_clean_under_stricter_warnings(
    compiler: tuple[str, ...], scene: str, tmp_path: Path
) -> None:
    compiles(
        built(scene),
        tmp_path,
        compiler,
        *("-Wshadow", "-Wstrict-prototypes", "-Wvla", "-Wtrigraphs"),
        check=True,
    )


@pytest.mark.slow
@pytest.mark.parametrize("scene", ["swing", "four_bar"])
@BY_COMPILER
def test_scenes_with_jacobians_compile_without_a_warning(
    scene: str, compiler: tuple[str, ...], tmp_path: Path
) -> None:
    own = {"own": multiplier(0) * Symbol("l_0")} if scene == "four_bar" else {}
    mechanism = scenes.SCENES[scene]()
    known = set(OPTIONAL) - (set() if mechanism.joints else {"reactions"})
    build = build_scene(mechanism, request=OutputRequest(frozenset(known), expressions=own))
    compiles(build, tmp_path, compiler, only="scene_avx2.c")
    compiles(build, tmp_path, compiler, only="scene_outputs_only.c")


def test_every_instruction_set_is_compiled_in_a_unit_of_its_own() -> None:
    build = built("four_bar")
    names = [each.name for each in instruction_sets()]
    assert names[0] == "baseline"
    assert build.sources == (*(f"scene_{name}.c" for name in names), "scene_model.c")
    assert build.flags["scene_baseline.c"] == build.flags["scene_model.c"] == ()
    for each in instruction_sets():
        assert f"#define MECHC_LANES {each.lanes}\n" in build.texts[f"scene_{each.name}.c"]


def test_no_flag_gives_up_the_meaning_of_arithmetic() -> None:
    flags = [*FLAGS, *(f for each in instruction_sets() for f in each.flags)]
    for forbidden in ("fast-math", "-Ofast", "unsafe", "associative", "reciprocal", "finite-math"):
        assert not any(forbidden in flag for flag in flags)
    assert not any("march=native" in flag for flag in flags)


# -- it can be read ---------------------------------------------------------------------------


@pytest.mark.parametrize("scene", scenes.SCENES)
def test_every_output_says_which_equation_it_is(scene: str) -> None:
    """The equation above the function, what the element is behind each assignment."""
    text = built(scene).texts["scene_program.h"]
    for output in scenes.lowered(scene).outputs:
        if output.name in ("velocity_bias", "gamma"):
            continue
        place = text.index(f"FN(output_{output.name})(")
        comment, body = text[:place].rsplit("/*", 1)[1], text[place:].split("\n}\n")[0]
        assert _words(output.equation) in _words(comment)
        lines = re.findall(r"out\[(\d+)\] = .*; /\* (.*) \*/", body)
        assert [int(k) for k, _ in lines] == list(range(len(output.elements)))
        assert [_words(said) for _, said in lines] == [_words(label) for label in output.labels]


def _words(text: str) -> list[str] | str:
    return " ".join(re.findall(r"[a-z0-9_]+", text.lower()))


def test_no_line_of_the_program_is_endless() -> None:
    for scene in scenes.SCENES:
        assert max(map(len, built(scene).texts["scene_program.h"].splitlines())) < 600


def test_only_what_the_scene_needs_is_emitted() -> None:
    bead, four_bar = (built(s).texts["scene_program.h"] for s in ("bead", "four_bar"))
    for constrained in ("output_constraints", "output_constraint_jacobian", "output_preference"):
        assert constrained in four_bar
        assert constrained not in bead
    assert "output_kinematic_matrix" not in four_bar
    assert "output_kinematic_matrix" in built("swing").texts["scene_program.h"]
    assert "Omega" not in four_bar
    assert "bias[0] = R(0.0);" in four_bar


# -- functions --------------------------------------------------------------------------------

EVERY_FUNCTION = (
    sin(q) + cos(u) * tan(q / 3)
    + asin(q / 9) + acos(q / 8) + atan(q) + atan2(q, 1 + u**2) + atan2(2, q)
    + sinh(q) + cosh(q / 2) + tanh(u) + exp(-q) + E**2 * q + sqrt(2) + exp(2) * sin(2) + pi
    + log(3 + q) + Abs(u - 5) + sqrt(3 + q) + 1 / sqrt(4 + q) + (3 + q) ** Rational(1, 3)
    + 2**q + q**3 - q**-2 + q**9 + q**-9 + (3 + q) ** u - (-q) ** 2 / 7 + f * Rational(-5, 3)
    + sin(f) * cos(f + 1) * t + Rational(1, 3**40) * q + Integer(10) ** 30 * q / 10**31
)  # fmt: skip


def test_every_function_known_has_the_value_it_should() -> None:
    """In lanes and alone; constants among them, and a default that is one."""
    model = mechc.compile(scenes.bead_with(EVERY_FUNCTION, default=sqrt(2) * sin(1) / 3))
    assert model.defaults["f"] == pytest.approx(2**0.5 * np.sin(1) / 3, rel=1e-15)
    time = 0.7
    y = np.random.default_rng(0).uniform(0.2, 2, (7, 2))
    expected = []
    for row in y.tolist():
        known = dict(zip((q, u, f, t), (*row, model.defaults["f"], time), strict=True))
        exactly = {symbol: Rational(number) for symbol, number in known.items()}
        expected.append(float(EVERY_FUNCTION.xreplace(exactly).evalf(30)))
    np.testing.assert_allclose(model.rhs(time, y)[:, 1], expected, rtol=1e-13)
    assert model.simulate((time, time + 0.01), y[0]).status.ok


UNKNOWN = [
    gamma(q), erf(q), acosh(q),
    Function("h")(f), Function("tan")(f), I * q, sqrt(-2) * u,
    oo * f, nan * f, zoo * f, Integer(10) ** 400 * q, Abs(q).diff(q),
]  # fmt: skip


@pytest.mark.parametrize("load", UNKNOWN, ids=str)
def test_a_function_without_a_form_in_lanes_is_refused_by_name(load: Expr) -> None:
    """By us, with what is known, never by the C compiler."""
    with pytest.raises(MechanismError, match=r"no C form|not a real number|neither a parameter"):
        build_scene(scenes.bead_with(load), (BASELINE,))


def test_a_refusal_names_the_function_and_what_is_known() -> None:
    with pytest.raises(MechanismError, match=r"Max has no C form .* known are .*sqrt.*atan2"):
        RealPrinter().real(Max(Symbol("x"), 0))


# -- hostile names ----------------------------------------------------------------------------

HOSTILE = [
    "*/ int x; /*",
    "quote\" and '",
    "new\nline\r\x00\x07",
    '"); system("echo',
    "θ₀ \u202e \U0001f600",
    "ends with \\",
    "??/",
    "??/\n int y;",
    "// comment",
    "%s %n",
    "$metadata ${units}",
    "#include </etc/passwd>",
    "\\012\\x41",
    "q0",
    "p0",
    "k0",
    "z0",
    "return",
    "MECHC_NQ",
    "R(0)",
    "__import__('os')",
]


def hostile() -> Mechanism:
    """A rod between two rails whose every name is an attack."""
    names = iter([f"{text}{k}" for k in range(4) for text in HOSTILE])
    functions = (name.replace("\0", "") for name in names)  # SymPy refuses them there
    x, y, phi = (Function(next(functions))(t) for _ in range(3))
    speeds = [Function(next(functions))(t) for _ in range(3)]
    m, I_, l, g, extra = (Symbol(next(names)) for _ in range(5))
    r, e = ReferenceFrame(next(names)), ReferenceFrame(next(names))
    e.orient_axis(r, r.z, phi)
    e.set_ang_vel(r, speeds[2] * r.z)
    origin, centre, tip = (Point(next(names)) for _ in range(3))
    origin.set_vel(r, 0)
    centre.set_pos(origin, x * r.x + y * r.y)
    centre.set_vel(r, speeds[0] * r.x + speeds[1] * r.y)
    tip.set_pos(centre, l * e.x)
    tip.v2pt_theory(centre, r, e)
    rod = RigidBody(next(names), centre, e, m, (dyadic(e, 0, 0, I_), centre))
    rod.potential_energy = m * g * y
    bob = Particle(next(names), tip, m)
    bob.potential_energy = m * g * (y + l * sin(phi))

    def quantity() -> Quantity:
        return Quantity(next(names), next(names))

    return Mechanism(
        name=next(names),
        title=next(names),
        frame=r,
        origin=origin,
        coordinates=tuple(Coordinate(c, quantity()) for c in (x, y, phi)),
        speeds=tuple(Speed(s, quantity()) for s in speeds),
        kinematics=tuple(speeds),
        parameters=tuple(Parameter(p, 1.0, quantity()) for p in (m, I_, l, g, extra)),
        bodies=(rod, bob),
        loads=((centre, -m * g * r.y), (tip, -m * g * r.y)),
        configuration_constraints=(
            Constraint(next(names), x, next(names)),
            Constraint(next(names), y + extra * 0, next(names)),
        ),
        points=(origin, centre, tip),
        drawing=Drawing(links=((next(names), (centre.name, tip.name)),), traced=(tip.name,)),
        skipped=(next(names),),
    )


def given_names(mechanism: Mechanism) -> dict[str, tuple[str, ...]]:
    constraints = mechanism.configuration_constraints
    return {
        "coordinates": tuple(c.func.__name__ for c in mechanism.q),
        "speeds": tuple(s.func.__name__ for s in mechanism.u),
        "parameters": tuple(p.symbol.name for p in mechanism.parameters),
        "point_names": tuple(p.name for p in mechanism.points),
        "body_names": tuple(b.name for b in mechanism.bodies),
        "constraint_names": tuple(c.name for c in constraints),
    }


def code_of(text: str) -> str:
    """C without its comments and string literals."""
    return re.sub(r'"(?:[^"\\\n]|\\.)*"|/\*.*?\*/', " ", text, flags=re.S)


def test_hostile_names_are_in_escaped_literals_and_comments_only() -> None:
    """Take those away and what is left is the text of the same mechanism with tame names."""
    build = build_scene(hostile(), (BASELINE,))
    for name, text in build.texts.items():
        assert text.isascii(), name
        assert all(c == "\n" or c.isprintable() for c in text), name
        assert "system" not in code_of(text), name
        assert "??/" not in text, name
        assert "??" not in re.sub(r"/\*.*?\*/", "", text, flags=re.S), name
    program = build.texts["scene_program.h"]
    tame = _renamed_program(hostile())
    assert code_of(program) == code_of(tame)


def _renamed_program(mechanism: Mechanism) -> str:
    """The program when the names that reach it are plain words."""
    constraints = tuple(
        replace(c, name=f"constraint {k}")
        for k, c in enumerate(mechanism.configuration_constraints)
    )
    plain = replace(mechanism, name="plain", title="plain", configuration_constraints=constraints)
    return build_scene(plain, (BASELINE,)).texts["scene_program.h"]


@pytest.mark.slow
def test_a_mechanism_of_hostile_names_compiles_and_runs(tmp_path: Path) -> None:
    mechanism = hostile()
    for compiler in COMPILERS:
        compiles(build_scene(mechanism, (BASELINE,)), tmp_path, compiler, "-std=c11", "-O0")
    model = mechc.compile(mechanism)
    assert (model.name, model.title) == (mechanism.name, mechanism.title)
    for kind, names in given_names(mechanism).items():
        assert getattr(model, kind) == names, kind
    for parameter in mechanism.parameters:
        assert model.units[parameter.symbol.name] == parameter.quantity.unit
        assert model.descriptions[parameter.symbol.name] == parameter.quantity.description
    assert model.skeleton == mechanism.drawing.links
    assert model.traced == mechanism.drawing.traced
    length = model.parameters[2]
    state = np.array([0.0, 0.0, 0.3, 0.0, 0.0, 0.0])
    sol = model.simulate((0.0, 1.0), state, {length: 2.0})
    assert sol.status.ok
    # the rod is a pendulum about its fixed centre: phi'' = -m g l cos(phi) / (I + m l^2)
    assert model.rhs(0.0, state, {length: 2.0})[5] == pytest.approx(-2 * np.cos(0.3) / 5, rel=1e-14)
    assert model.points(state, {length: 2.0})[2] == pytest.approx(
        [2 * np.cos(0.3), 2 * np.sin(0.3), 0.0], rel=1e-14
    )


def test_metadata_survives_the_way_through_c() -> None:
    """The escaped literal, read as C reads it, is the JSON that was given."""
    text = build_scene(hostile(), (BASELINE,)).texts["scene_model.c"]
    literal = text.split("metadata[] =")[1].split(";\n")[0]
    pieces = re.findall(r'"((?:[^"\\\n]|\\[0-7]{3})*)"', literal)
    assert "".join(literal.split()) == "".join("".join(f'"{p}"' for p in pieces).split())
    data = re.sub(r"\\([0-7]{3})", lambda m: chr(int(m[1], 8)), "".join(pieces))
    assert json.loads(data)["name"] == hostile().name


def test_whatever_decides_the_binary_changes_its_signature() -> None:
    build = built("four_bar")
    one = signature(build, "gcc 12", "3.12")
    assert one == signature(build, "gcc 12", "3.12")
    others = [
        signature(build, "gcc 13", "3.12"),
        signature(build, "gcc 12", "3.13"),
        signature(built("everything"), "gcc 12", "3.12"),
        signature(Build(build.name, build.texts, dict.fromkeys(build.flags, ())), "gcc 12", "3.12"),
    ]
    assert len({one, *others}) == 5
