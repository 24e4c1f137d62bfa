"""Compiling on demand: once, found again by the next process, honest about the compiler."""

import os
import shlex
import stat
import subprocess
import sys
import threading
import time

import numpy as np
import pytest
from mechc_codegen.library.catalogue import SHIPPED
from sympy import Symbol
from sympy.physics.mechanics import dynamicsymbols

import mechc
from benchmarks.problems.window_row import window_row
from mechc.compilation import build, cache, entries, parts, toolchain
from mechc.compilation.library.catalogue import LIBRARY
from mechc.compilation.parts import Pending
from mechc.compilation.toolchain import processor
from mechc.errors import CompilerError, MechcError, UnknownNameError
from tests.support import ROOT, scenes
from tests.support.pendulums import pendulum
from tests.support.sympy_objects import four_bar_kane

pytestmark = pytest.mark.compiles


def compiled_parts():
    """Names of what is in the cache of the one scene that is compiled."""
    (folders,) = cache.scenes().values()
    return {folder.name.partition(".")[2] for folder in folders}


@pytest.fixture
def fresh(fresh, monkeypatch):
    """And integrators are compiled behind the tests, as for users."""
    monkeypatch.setattr(parts, "Pending", Pending)
    return fresh


def compiler_script(folder, monkeypatch, body, name="cc"):
    """A compiler of our own making, which ``$CC`` names."""
    script = folder / name
    script.write_text(f"#!/bin/sh\n{body}\n")
    script.chmod(script.stat().st_mode | stat.S_IXUSR)
    monkeypatch.setenv("CC", str(script))
    toolchain.version.cache_clear()
    return script


ANSWER_VERSION = 'if [ "$1" = --version ]; then gcc --version; exit; fi'


@pytest.mark.usefixtures("own_parts")
def test_one_that_was_compiled_moves_as_it_should(fresh):
    del fresh
    model = mechc.compile(pendulum())
    assert model.coordinates == ("q",)
    assert model.constraints(np.zeros(2)).shape == (0,)
    assert model.constraint_jacobian(np.zeros((3, 2))).shape == (3, 0, 1)
    sol = model.simulate(2.367841947576237449303, model.assemble({"q": 0.0}), rtol=1e-10)
    assert sol.status.ok
    assert sol.closure.max() == 0.0
    np.testing.assert_allclose(sol.y[-1], [0.0, 0.0], atol=1e-8)  # one exact period
    assert sol.energy_drift < 1e-10
    stages = {
        *("read", "describe", "derive", "differentiate", "optimize", "sensitivity", "series"),
        "emit",
    }
    assert set(model.build["seconds"]) == stages | {"first unit", "driver", "taylor"}
    assert min(model.build["seconds"].values()) >= 0.0
    assert "taylor: " in model.report()


@pytest.mark.usefixtures("own_parts")
def test_it_can_be_used_before_all_of_it_is_compiled(fresh, monkeypatch):
    """Rates and outputs do not wait for the integrators; what integrates does."""
    begin = threading.Event()
    make = entries.make_part
    monkeypatch.setattr(entries, "make_part", lambda *args: (begin.wait(60), make(*args)))
    model = mechc.compile(pendulum(4.0))
    first = model.rhs(0.0, [0.3, 0.1]), model.energy([0.3, 0.1])
    assert first[0][1] == pytest.approx(-4.0 * np.cos(0.3), rel=1e-14)
    assert compiled_parts() == {"first"}
    with pytest.raises(UnknownNameError):
        model._evaluate("nothing", [0.3, 0.1], None, 0.0)
    begin.set()
    assert model.simulate(1.0, [0.3, 0.1]).status.ok
    assert compiled_parts() == {"first", "driver", "taylor"}
    np.testing.assert_allclose(model.rhs(0.0, [0.3, 0.1]), first[0], rtol=1e-15)


@pytest.mark.usefixtures("own_parts")
def test_a_program_that_never_integrates_is_found_again_too(fresh, monkeypatch):
    """The first unit is kept; other parts are made when something needs them."""
    make = entries.make_part
    monkeypatch.setattr(entries, "make_part", lambda *_: time.sleep(60))
    first = mechc.compile(pendulum(4.25))
    monkeypatch.setattr(build, "_compiled", {})
    monkeypatch.setattr(entries, "make_first", lambda *_: pytest.fail("compiled again"))
    again = mechc.compile(pendulum(4.25))
    np.testing.assert_array_equal(again.rhs(0.0, [0.3, 0.1]), first.rhs(0.0, [0.3, 0.1]))
    assert set(again.build["seconds"]) == {"read", "load"}
    monkeypatch.setattr(entries, "make_part", make)
    monkeypatch.setenv("MECHC_CACHE_DIR", str(fresh / "elsewhere"))
    assert again.simulate(1.0, [0.3, 0.1]).status.ok


@pytest.mark.usefixtures("own_parts")
def test_what_goes_wrong_in_the_background_is_raised_where_it_is_needed(fresh, monkeypatch):
    def fail(*_):
        raise CompilerError("out of cheese")

    monkeypatch.setattr(entries, "make_part", fail)
    model = mechc.compile(pendulum(4.5))
    assert model.rhs(0.0, [0.0, 0.0])[1] == pytest.approx(-4.5)
    for _ in range(2):
        with pytest.raises(CompilerError, match="out of cheese"):
            model.simulate(1.0, [0.3, 0.1])


@pytest.mark.filterwarnings("ignore:.*fork:DeprecationWarning")
def test_a_forked_process_makes_its_own(fresh, monkeypatch):
    """The thread that compiles is not there in the child, which must not wait for it."""
    begin = threading.Event()
    pending = Pending(lambda: begin.wait(60))
    child = os.fork()
    if child == 0:
        begin.set()
        os._exit(0 if pending.result() else 1)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0
    begin.set()
    assert pending.result()


def test_the_same_again_is_the_same_object_and_compiles_nothing(monkeypatch):
    model = mechc.compile(pendulum())
    assert model.capsule
    monkeypatch.setattr(entries, "make_whole", lambda *_: pytest.fail("compiled again"))
    assert mechc.compile(pendulum()) is model


def test_defaults_of_a_mechanism_do_not_decide_what_is_compiled(monkeypatch):
    model = mechc.compile(scenes.bead_with(Symbol("f") * dynamicsymbols("q"), default=2.0))
    monkeypatch.setattr(entries, "make_first", lambda *_: pytest.fail("compiled again"))
    other = mechc.compile(scenes.bead_with(Symbol("f") * dynamicsymbols("q"), default=3.0))
    assert other.system.reference.key == model.system.reference.key
    assert (model.defaults, other.defaults) == ({"f": 2.0}, {"f": 3.0})
    assert other.rhs(0.0, [0.5, 0.0])[1] == 1.5 * model.rhs(0.0, [0.5, 0.0])[1] == 1.5


RUN = """
import mechc
from mechc.compilation import build, entries
from mechc.compilation.toolchain import processor
from tests.support.pendulums import pendulum
made = []
inner = entries.make_part
entries.make_part = lambda *arguments: (made.append(arguments[1]), inner(*arguments))
model = mechc.compile(pendulum({gravity}))
model.wait_compiled()
print(float(model.rhs(0.0, [0.3, 0.1])[1]), *made)
"""


def process(gravity):
    script = RUN.format(gravity=gravity)
    return subprocess.Popen(
        [sys.executable, "-W", "error", "-c", script],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        text=True,
    )


def outcome(running):
    out, _ = running.communicate(timeout=120)
    assert running.returncode == 0
    rate, *made = out.split()
    return made, float(rate)


@pytest.mark.slow
def test_processes_at_once_compile_once_and_later_ones_load(fresh):
    with process(3.0) as first, process(3.0) as second:
        cold = outcome(first), outcome(second)
    made = [part for parts, _ in cold for part in parts]
    assert "driver" in made
    assert len(made) == len({*made})
    with process(3.0) as third:
        made, rate = outcome(third)
    assert not made
    assert rate == cold[0][1] == cold[1][1] == pytest.approx(-3.0 * np.cos(0.3))
    assert len(cache.scenes()) == 1


@pytest.mark.slow
def test_a_damaged_shared_object_is_compiled_again_not_loaded(fresh, monkeypatch):
    model = mechc.compile(pendulum(5.0))
    assert model.capsule, "waits for the whole of it"
    key = model.build["key"]
    shared = cache.cache_folder() / key / cache.SHARED_OBJECT
    assert {path.name for path in shared.parent.iterdir()} == {"scene.so", "scene.seal"}
    whole = shared.read_bytes()
    replaced = shared.with_name("new")  # the one in place is mapped into this process
    replaced.write_bytes(whole[: len(whole) // 2])
    replaced.rename(shared)
    monkeypatch.setattr(build, "_compiled", {})
    model = mechc.compile(pendulum(5.0))
    assert model.capsule
    assert model.build["key"] == key
    assert len(shared.read_bytes()) > len(whole) // 2
    assert model.rhs(0.0, [0.0, 0.0])[1] == pytest.approx(-5.0)


def keys_under(monkeypatch, *commands):
    """The cache key of one pendulum under each compiler command; nothing is compiled."""
    keys = []
    monkeypatch.setattr(cache, "find", lambda key: keys.append(key) or (_ for _ in ()).throw(
        MechcError("stop")
    ))  # fmt: skip
    for command in commands:
        monkeypatch.setenv("CC", command)
        with pytest.raises(MechcError, match="stop"):
            mechc.compile(pendulum(6.0))
    return keys


def test_the_compiler_and_its_flags_decide_the_key(fresh, monkeypatch):
    """Flags in $CC change the binary although the version stays."""
    command = shlex.join(toolchain.compiler())
    plain, again, flagged = keys_under(monkeypatch, command, command, f"{command} -O0")
    assert plain == again != flagged


def test_another_compiler_version_is_another_key(fresh, monkeypatch):
    script = compiler_script(fresh, monkeypatch, "echo one 1.0")
    (first,) = keys_under(monkeypatch, str(script))
    compiler_script(fresh, monkeypatch, "echo one 1.1")
    (second,) = keys_under(monkeypatch, str(script))
    assert first != second


def test_the_processor_decides_the_key(fresh, monkeypatch):
    command = shlex.join(toolchain.compiler())
    (here,) = keys_under(monkeypatch, command)
    monkeypatch.setattr(processor, "processor", lambda: "another")
    (there,) = keys_under(monkeypatch, command)
    assert here != there


def without_compiler(monkeypatch):
    monkeypatch.setenv("PATH", "")
    monkeypatch.setattr(toolchain, "packaged_compiler", lambda: None)
    monkeypatch.delenv("CC", raising=False)


def test_without_a_compiler_the_error_says_what_to_install(fresh, monkeypatch):
    """Also with a warm cache: the compiler's version is part of what an entry is found by."""
    without_compiler(monkeypatch)
    with pytest.raises(CompilerError, match=r"no C compiler .* install gcc or clang") as error:
        mechc.compile(pendulum()).wait_compiled()
    assert "apt install gcc" in str(error.value)
    assert "set CC" in str(error.value)
    assert "most mechanisms need none" in str(error.value)


SLOWEST = ("andrews", "bicycle", "windows")  # to derive


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=pytest.mark.slow(cases=3)) if name in SLOWEST else name
        for name in LIBRARY
    ],
)
def test_without_a_compiler_the_library_runs(fresh, monkeypatch, name):
    without_compiler(monkeypatch)
    model = mechc.load(name)
    start = model.assemble()
    sol = model.simulate(0.01, start)
    assert sol.status.ok
    batch = model.simulate_batch(0.01, start[None], progress=False)
    np.testing.assert_allclose(batch.y[0], sol.y[-1], rtol=1e-5, atol=1e-7)


ARM = """
<robot name="arm">
  <link name="base"/>
  <link name="bar">
    <inertial><origin xyz="0 0 -0.5"/><mass value="2"/>
      <inertia ixx="0.2" ixy="0" ixz="0" iyy="0.2" iyz="0" izz="0.01"/></inertial>
  </link>
  <joint name="pin" type="continuous">
    <parent link="base"/><child link="bar"/><axis xyz="0 1 0"/>
  </joint>
</robot>
"""


def test_without_a_compiler_a_robot_and_a_kane_object_run(fresh, monkeypatch):
    without_compiler(monkeypatch)
    file = fresh / "arm.urdf"
    file.write_text(ARM)
    robot = mechc.compile(mechc.from_urdf(file))
    assert robot.simulate(0.1, robot.assemble()).status.ok
    params = {"l_0": 0.5, "l_1": 1.0, "l_2": 1.1, "l_3": 1.3}
    model = mechc.compile(four_bar_kane(), defaults=params)
    params |= {name: 1.0 for name in model.parameters if name not in params}
    start = model.assemble({"q_0": 1.2}, params=params)
    assert model.simulate(0.1, start, params).status.ok
    assert np.any(model.linearize(start, params).A)


@pytest.mark.parametrize(
    "described",
    [
        lambda: SHIPPED["planar_chain"].build(links=8),
        pytest.param(lambda: window_row(3), marks=pytest.mark.slow),
    ],
)
def test_without_a_compiler_trees_that_are_walked_run(fresh, monkeypatch, described):
    without_compiler(monkeypatch)
    model = mechc.compile(described())
    assert model.system.data["walked"]
    start = model.assemble({"q_0": 1.2} if model.multipliers else None)
    sol = model.simulate(0.3, start, rtol=1e-10)
    assert np.ptp(sol["energy"]) < 1e-9
    batch = model.simulate_batch(0.3, start[None], rtol=1e-10, progress=False)
    np.testing.assert_allclose(batch.y[0], sol.y[-1], rtol=1e-9, atol=1e-9)


def test_without_a_compiler_tables_and_stops_run_as_with_one(fresh, monkeypatch):
    without_compiler(monkeypatch)
    monkeypatch.setattr("mechc.compilation.event_tapes._known", {})
    model = mechc.compile(scenes.bead_over_tables())
    stop = mechc.Stop("q - 0.1", 0.7)
    sol = model.simulate(5.0, [1.0, 0.0], events=stop)
    assert not sol._run_events.bound.calls_python
    assert len(sol.segments) == 2
    batch = model.simulate_batch(5.0, [[1.0, 0.0]] * 3, events=stop, progress=False)
    np.testing.assert_allclose(batch.y[2], sol.y[-1], rtol=1e-9)


def test_without_a_compiler_motions_have_derivatives(fresh, monkeypatch):
    """A fit, a gradient, a cycle."""
    without_compiler(monkeypatch)
    model = mechc.compile(pendulum())
    sol = model.simulate(2.0, [0.4, 0.3], sensitivities=["y0"])
    of_start = sol.sensitivity["y0"][-1]
    np.testing.assert_allclose(sol.gradient("q", by=["y0"])["y0"], of_start[0], atol=1e-7)
    found = model.fit({"t": sol.t, "q": sol.y[:, 0]}, {"q": (-1, 1), "u": (-1, 1)})
    assert found.values["q"] == pytest.approx(0.4, abs=1e-6)


def test_a_compiler_that_fails_is_quoted(unit_needed, monkeypatch):
    failing = f"{ANSWER_VERSION}\necho 'cc1: out of cheese' >&2; exit 3"
    script = compiler_script(unit_needed, monkeypatch, failing)
    with pytest.raises(CompilerError) as error:
        mechc.compile(pendulum(7.0))
    told = str(error.value)
    assert "exit 3" in told
    assert f"{script} -std=gnu11 -O" in told
    assert "cc1: out of cheese" in told
    assert cache.scenes() == {}


def test_a_compiler_that_cannot_be_run_is_told(fresh, monkeypatch):
    """No traceback from the operating system: the file is there but is no program."""
    script = fresh / "cc"
    script.write_bytes(b"\x00\x01")
    script.chmod(0o700)
    monkeypatch.setenv("CC", str(script))
    with pytest.raises(CompilerError, match=f"cannot run {script}"):
        mechc.compile(pendulum(8.0))


def test_other_things_are_not_compiled():
    with pytest.raises(TypeError, match=r"takes a mechc.Mechanism, or .*, not str"):
        mechc.compile("four_bar")


HOSTILE = {
    "name": "</script>",
    "angle": 'q"; system("true"); "',
    "speed": "a/b",
    "mass": "$\\frac",
    "length": "int main(){}",
}


@pytest.fixture(scope="module")
def hostile():
    return mechc.compile(pendulum(9.0, **HOSTILE))


def test_hostile_names_compile_to_a_model_that_knows_them(hostile):
    assert hostile.name == HOSTILE["name"]
    assert hostile.coordinates == (HOSTILE["angle"],)
    assert hostile.parameters == (HOSTILE["mass"], HOSTILE["length"])
    rate = hostile.rhs(0.0, [0.0, 0.0], {HOSTILE["length"]: 2.0})[1]
    assert rate == pytest.approx(-4.5)


def test_hostile_names_reach_tables_and_files_whole(hostile, tmp_path):
    sol = hostile.simulate(0.5, hostile.assemble({HOSTILE["angle"]: 0.0}))
    path = sol.save(tmp_path / "run.nc")
    assert sol.to_xarray()["a_b"].attrs["long_name"] == "a/b"
    assert sol.save(tmp_path / "run.csv").read_text("utf-8").startswith("t [s],")
    assert "</script>" not in sol._repr_html_() + hostile._repr_html_()
    assert "<!--" not in sol.animate().html
    np.testing.assert_allclose(mechc.open(path).y, sol.y, rtol=1e-12)


def test_a_file_whose_mechanism_is_not_at_hand_is_opened_with_it(hostile, fresh, tmp_path):
    sol = hostile.simulate(0.5, hostile.assemble({HOSTILE["angle"]: 0.0}))
    path = sol.save(tmp_path / "run.nc")
    with pytest.raises(MechcError, match=r"not a shipped one and not in the cache.*mechc.open"):
        mechc.open(path)
    np.testing.assert_allclose(mechc.open(path, hostile).y, sol.y, rtol=1e-12)
    with pytest.raises(MechcError, match="the model 'four_bar' has others"):
        mechc.open(path, mechc.load("four_bar"))


@pytest.mark.slow
def test_emission_is_the_same_text_whatever_the_hash_seed():
    script = (
        "from tests.support.pendulums import pendulum\n"
        "from mechc_codegen.compiler import build_scene\n"
        "print(sorted(build_scene(pendulum()).texts.items()))"
    )
    texts = {
        subprocess.run(
            [sys.executable, "-c", script], capture_output=True, check=True,
            env={**os.environ, "PYTHONHASHSEED": seed}, cwd=ROOT,
        ).stdout
        for seed in ("1", "2")
    }  # fmt: skip
    assert len(texts) == 1


def test_a_compiler_that_does_not_exist_is_told_by_name(fresh, monkeypatch):
    monkeypatch.setenv("CC", "no-such-cc -O3")
    with pytest.raises(CompilerError, match=r"CC = 'no-such-cc -O3'.*no command 'no-such-cc'"):
        mechc.compile(pendulum())
