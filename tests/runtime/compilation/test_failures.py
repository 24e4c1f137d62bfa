"""Around compiler and cache all sorts of things go wrong: a working model or a clear error ends it.

Whole processes where the thing happens to a process; a folder of the test's own for the cache.
"""

import errno
import os
import shlex
import shutil
import signal
import stat
import struct
import subprocess
import sys
import time
from contextlib import contextmanager, suppress

import numpy as np
import pytest

import mechc
from mechc.compilation import build, cache, entries, parts, toolchain
from mechc.compilation.cache import security as cache_folder
from mechc.compilation.parts import Pending
from mechc.compilation.toolchain import processor
from mechc.errors import CacheError, CacheWarning, CompilerError
from tests.support import ROOT
from tests.support.pendulums import pendulum

pytestmark = pytest.mark.compiles

COMPILER = shlex.join(toolchain.find_compiler() or ["cc"])
RATE = -np.cos(0.3)  # of a unit pendulum, times gravity


def rate(gravity):
    return float(mechc.compile(pendulum(gravity)).rhs(0.0, [0.3, 0.1])[1])


def right(value, gravity):
    return value == pytest.approx(gravity * RATE, rel=1e-14)


def compiler_script(folder, body):
    """A compiler that does something first, and its name for ``$CC``; questions it answers.

    zig asks ``$CC -E`` for the folders of headers.
    """
    script = folder / "cc"
    ask = f'case "$1" in --version | -E) exec {COMPILER} "$@";; esac'
    whole = script.with_suffix(".new")  # in place at once: the last may be being started
    whole.write_text(f"#!/bin/sh\n{ask}\n{body}\n")
    whole.chmod(whole.stat().st_mode | stat.S_IXUSR)
    whole.replace(script)
    return str(script)


# -- processes ------------------------------------------------------------------------------

COUNTS_DERIVATIONS = """
import os
import mechc
from mechc.compilation import build, entries, parts
from mechc.compilation.toolchain import processor
from tests.support.compilers.compilation import MadeOnRequest
parts.Pending = MadeOnRequest
if os.environ.get("TEST_WITHOUT_UNITS"):
    entries.installed_unit = lambda _: None
derived = []
inner = build._built
build._built = lambda *arguments: derived.append(1) or inner(*arguments)
"""
RUN = (
    COUNTS_DERIVATIONS
    + """
import warnings
from tests.support.pendulums import pendulum
told = []
warnings.showwarning = lambda message, kind, *_: told.append(kind.__name__)
try:
    value = float(mechc.compile(pendulum({gravity})).rhs(0.0, [0.3, 0.1])[1])
    print(value, len(derived), *told)
except mechc.MechcError as error:
    print(type(error).__name__, error)
"""
)


def begin(gravity, *, environment=(), without=(), before=()):
    """A process that asks for a pendulum and prints its rate, how often it derived, warnings."""
    asked = {key: value for key, value in os.environ.items() if key not in without}
    return subprocess.Popen(
        [*before, sys.executable, "-c", RUN.format(gravity=gravity)],
        env={**asked, **dict(environment)}, cwd=ROOT, stdout=subprocess.PIPE, text=True,
        start_new_session=True,
    )  # fmt: skip


def end(process):
    told, _ = process.communicate(timeout=300)
    assert process.returncode == 0
    return told.split()


@pytest.mark.slow
def test_processes_at_once_derive_and_compile_once(fresh):
    """With a mechanism the texts name the entry, with an object of SymPy's what was read."""
    running = [begin(2.0) for _ in range(3)]
    told = [end(process) for process in running]
    assert all(right(float(value), 2.0) for value, _ in told)
    assert len({value for value, _ in told}) == 1
    (first,) = cache.cache_folder().glob("*.first")
    assert cache.find(first.name) is not None
    assert not list(cache.cache_folder().glob(".new-*"))


KANE = (
    COUNTS_DERIVATIONS
    + """
from tests.support.sympy_objects import four_bar_kane
model = mechc.compile(four_bar_kane(), outputs=())
print(model.build["key"], len(derived), *model.rhs(0.0, [0.1] * 6, [1.0] * 6))
"""
)


@pytest.mark.slow
def test_many_processes_with_one_kane_object_derive_it_once_whatever_their_hash_seed(fresh):
    running = [
        subprocess.Popen(
            [sys.executable, "-c", KANE], stdout=subprocess.PIPE, text=True,
            env={**os.environ, "PYTHONHASHSEED": str(seed)}, cwd=ROOT,
        )
        for seed in range(1, 5)
    ]  # fmt: skip
    told = [end(process) for process in running]
    assert len({key for key, *_ in told}) == 1
    assert sorted(int(derived) for _, derived, *_ in told) == [0, 0, 0, 1]
    assert len({tuple(rates) for _, _, *rates in told}) == 1


@pytest.mark.slow
def test_a_process_killed_while_it_compiles_leaves_nothing_in_the_way(unit_needed):
    """Nor does its compiler, which goes on for a while."""
    waits = f'echo $$ > {unit_needed}/compiling; sleep 5; exec {COMPILER} "$@"'
    script = compiler_script(unit_needed, waits)
    process = begin(2.5, environment={"CC": script})
    told = unit_needed / "compiling"
    deadline = time.monotonic() + 120
    while not (told.exists() and told.read_text()) and time.monotonic() < deadline:
        time.sleep(0.05)
    process.send_signal(signal.SIGKILL)
    process.communicate()
    assert list(cache.cache_folder().glob(".new-*")), "it was in the middle of it"
    value, derived = end(begin(2.5, environment={"CC": script}))
    assert right(float(value), 2.5)
    assert derived == "1"
    assert not list(cache.cache_folder().glob(".new-*"))


@pytest.mark.slow
def test_a_killed_compiler_is_told_and_the_next_attempt_works(unit_needed, monkeypatch):
    monkeypatch.setenv("CC", compiler_script(unit_needed, "kill -9 $$"))
    with pytest.raises(CompilerError, match="was ended by SIGKILL, perhaps for lack of memory"):
        rate(3.0)
    assert not list(cache.cache_folder().glob(".new-*"))
    compiler_script(unit_needed, f'exec {COMPILER} "$@"')
    assert right(rate(3.0), 3.0)


def test_a_compiler_killed_in_the_background_is_tried_again_when_asked_for(fresh, monkeypatch):
    """The model stays usable, and one that failed is not failed for ever."""
    monkeypatch.undo()
    monkeypatch.setattr("mechc_codegen.compiler.kind_of", lambda _: ())  # parts of its own
    monkeypatch.setenv("MECHC_CACHE_DIR", str(fresh / "cache"))
    monkeypatch.setattr(build, "_compiled", {})
    monkeypatch.setattr(parts, "Pending", Pending)
    only_first = f'case "$*" in *first_unit.c*) exec {COMPILER} "$@";; esac; kill -9 $$'
    monkeypatch.setenv("CC", compiler_script(fresh, only_first))
    model = mechc.compile(pendulum(3.5))
    with pytest.raises(CompilerError, match="SIGKILL"):
        model.simulate(0.1, [0.3, 0.1])
    assert right(float(model.rhs(0.0, [0.3, 0.1])[1]), 3.5)
    compiler_script(fresh, f'exec {COMPILER} "$@"')
    with suppress(CompilerError):  # of another part, which was begun before
        model.simulate(0.1, [0.3, 0.1])
    assert model.simulate(0.1, [0.3, 0.1]).status.ok


# -- full, read-only, forbidding ------------------------------------------------------------


@contextmanager
def mounted(folder, options):
    """A small file system of its own; skipped where that is not permitted."""
    folder.mkdir()
    command = ["mount", "-t", "tmpfs", "-o", f"mode=0700,{options}", "none", str(folder)]
    if (
        shutil.which("mount") is None
        or subprocess.run(command, stderr=subprocess.DEVNULL).returncode
    ):
        pytest.skip("no file system can be mounted here")
    try:
        yield folder
    finally:
        subprocess.run(["umount", "--lazy", str(folder)], check=True)


@pytest.mark.slow
def test_a_full_disk_is_told(unit_needed, monkeypatch):
    with mounted(unit_needed / "small", "size=64k") as folder:
        monkeypatch.setenv("MECHC_CACHE_DIR", str(folder / "cache"))
        with pytest.raises(CacheError, match=r"No space left .* set MECHC_CACHE_DIR"):
            rate(4.0)
        assert cache.scenes() == {}
        assert not list((folder / "cache").glob(".new-*"))
    monkeypatch.setenv("MECHC_CACHE_DIR", str(unit_needed / "cache"))
    assert right(rate(4.0), 4.0)


@pytest.mark.slow
def test_with_a_full_home_a_process_keeps_its_own(unit_needed, monkeypatch):
    """Nobody said that it had to be there: the model works, and a warning says what is lost."""
    monkeypatch.delenv("MECHC_CACHE_DIR")
    monkeypatch.setattr(cache_folder, "_temporary", {})
    with mounted(unit_needed / "small", "size=64k") as folder:
        monkeypatch.setenv("XDG_CACHE_HOME", str(folder))
        with pytest.warns(CacheWarning, match=r"No space left .* as long as this process runs"):
            model = mechc.compile(pendulum(4.5))
        assert right(float(model.rhs(0.0, [0.3, 0.1])[1]), 4.5)
        assert model.simulate(0.1, [0.3, 0.1]).status.ok
    (private,) = cache_folder._temporary.values()
    assert private.stat().st_mode & 0o777 == 0o700
    cache_folder._remove(private, os.getpid())
    assert not private.exists()


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EDQUOT, errno.EIO])
def test_what_cannot_be_written_is_told_whatever_the_reason(fresh, monkeypatch, number):
    def fail(*_):
        raise OSError(number, os.strerror(number))

    inner = entries.make_first
    monkeypatch.setattr(entries, "make_first", fail)
    with pytest.raises(CacheError, match=f"{os.strerror(number)}.*set MECHC_CACHE_DIR"):
        rate(4.75)
    monkeypatch.setattr(entries, "make_first", inner)
    assert right(rate(4.75), 4.75)


def test_a_compiler_without_room_is_a_full_disk(unit_needed, monkeypatch):
    said = "echo 'fatal error: error writing to x.s: No space left on device' >&2; exit 1"
    monkeypatch.setenv("CC", compiler_script(unit_needed, said))
    with pytest.raises(CacheError, match="No space left on device"):
        rate(4.8)


@pytest.fixture
def as_others_do():
    """What a command begins with, so that permissions hold for it: root may write everywhere."""
    if os.getuid() != 0:
        return ()
    drop = ("setpriv", "--bounding-set=-dac_override,-dac_read_search")
    if shutil.which("setpriv") is None or subprocess.run([*drop, "true"]).returncode:
        pytest.skip("root cannot give up its rights here")
    return drop


@pytest.mark.slow
def test_with_a_read_only_home_a_process_keeps_its_own(fresh, as_others_do):
    home = fresh / "home"
    home.mkdir(mode=0o500)
    unset = ("MECHC_CACHE_DIR", "XDG_CACHE_HOME")
    for _ in range(2):
        value, derived, *told = end(
            begin(5.0, environment={"HOME": str(home)}, without=unset, before=as_others_do)
        )
        assert right(float(value), 5.0)
        assert (derived, told) == ("1", ["CacheWarning"])
    assert list(home.iterdir()) == []


@pytest.mark.slow
def test_a_read_only_folder_that_was_named_is_refused_unless_all_is_there(fresh, as_others_do):
    folder = fresh / "cache"
    folder.mkdir(mode=0o500)
    kind, *words = end(begin(5.5, before=as_others_do))
    assert kind == "CacheError"
    assert "is read-only; set MECHC_CACHE_DIR" in " ".join(words)
    folder.chmod(0o700)
    assert right(rate(5.5), 5.5)
    folder.chmod(0o500)
    value, _, *told = end(begin(5.5, before=as_others_do))
    assert right(float(value), 5.5)
    assert told == []


def test_a_folder_that_forbids_programs_is_told(fresh, monkeypatch):
    with mounted(fresh / "noexec", "noexec") as folder:
        monkeypatch.setenv("MECHC_CACHE_DIR", str(folder))
        with pytest.raises(CacheError, match=r"cannot be loaded.*noexec.*set MECHC_CACHE_DIR"):
            rate(5.75)


# -- foreign and damaged code ----------------------------------------------------------------


def first_entry(gravity):
    """The folder of a pendulum's first unit, compiled and forgotten again."""
    key = cache.part_key(mechc.compile(pendulum(gravity)).build["key"], "first")
    build._compiled.clear()
    return cache.cache_folder() / key


def put(folder, content):
    """Another shared object in place of an entry's, sealed as if it were the entry's own."""
    shared = folder / cache.SHARED_OBJECT
    shared.unlink()  # the one in place is mapped into this process
    shared.write_bytes(content)
    (folder / cache.SEAL).write_text(cache._seal(folder.name, content))
    for file in folder.iterdir():
        file.chmod(0o600)
    assert cache.find(folder.name) is not None


def compiled(folder, text):
    (folder / "other.c").write_text(text)
    command = [
        *toolchain.compiler(),
        "-shared",
        "-fPIC",
        "-I",
        mechc.get_include(),
        "other.c",
        "-o",
        "other.so",
    ]
    subprocess.run(command, cwd=folder, check=True)
    return (folder / "other.so").read_bytes()


def test_another_scene_under_this_key_is_not_taken(fresh):
    mine, other = first_entry(6.0), first_entry(6.25)
    shutil.rmtree(mine)
    shutil.copytree(other, mine)
    assert right(rate(6.0), 6.0)
    build._compiled.clear()
    (mine / cache.SHARED_OBJECT).unlink()
    shutil.copy(other / cache.SHARED_OBJECT, mine)
    assert right(rate(6.0), 6.0)


@pytest.mark.parametrize("content", [b"", b"not a program\n", b"\x7fELF" + bytes(60)])
def test_what_is_no_shared_object_is_compiled_again(fresh, content):
    """Even if it is sealed."""
    put(first_entry(6.5), content)
    assert right(rate(6.5), 6.5)


def test_a_truncated_shared_object_is_compiled_again(fresh):
    """A seal over half of it would not save the process that loads it; there is none."""
    folder = first_entry(6.75)
    shared = folder / cache.SHARED_OBJECT
    content = shared.read_bytes()
    shared.unlink()
    shared.write_bytes(content[: len(content) // 2])
    shared.chmod(0o600)
    assert right(rate(6.75), 6.75)


def test_another_abi_is_compiled_again(fresh):
    put(
        first_entry(7.0),
        compiled(fresh, '#include "model.h"\nconst mechc_model mechc_scene = {MECHC_ABI + 1};\n'),
    )
    assert right(rate(7.0), 7.0)


def test_a_library_without_a_model_is_compiled_again(fresh):
    put(first_entry(7.25), compiled(fresh, "int mechc_nothing;\n"))
    assert right(rate(7.25), 7.25)


def test_what_vanishes_between_the_look_and_the_loading_is_made_again(fresh, monkeypatch):
    """Another process may clear the cache just then."""
    load, lost = entries.model_of, []

    def clear_and_load(path):
        if len(lost) < 2:
            lost.append(path)
            cache.clear()
        return load(path)

    end(begin(7.5))  # not in this process, where it would stay loaded
    monkeypatch.setattr(entries, "model_of", clear_and_load)
    assert right(rate(7.5), 7.5)
    assert len(lost) == 2


# -- another compiler, another Python, another processor --------------------------------------


def test_another_compiler_makes_the_same_model_under_another_key(fresh, monkeypatch):
    if shutil.which("clang") is None:
        pytest.skip("no clang here")
    runs = {}
    for name in ("gcc", "clang"):
        monkeypatch.setenv("CC", name)
        model = mechc.compile(pendulum(8.0))
        sol = model.simulate(1.0, [0.3, 0.1], rtol=1e-11)
        runs[model.build["key"]] = sol.y[-1]
        assert sol.status.ok
    one, other = runs.values()
    np.testing.assert_allclose(one, other, rtol=1e-12)


@pytest.mark.slow
def test_what_is_compiled_is_no_matter_of_pythons_version(unit_needed):
    """Every Python may load it: it asks for nothing of Python's."""
    if shutil.which("nm") is None:
        pytest.skip("no nm here")
    unit = struct.unpack_from("16xQ72s", (first_entry(8.25) / cache.SHARED_OBJECT).read_bytes())[1]
    for path in (cache.cache_folder() / unit.rstrip(b"\0").decode(), _whole(8.25)):
        command = ["nm", "-D", "--undefined-only", str(path / cache.SHARED_OBJECT)]
        wanted = subprocess.run(command, capture_output=True, text=True, check=True).stdout
        assert "Py" not in wanted
        assert "memcpy" in wanted or "cos" in wanted


def _whole(gravity):
    model = mechc.compile(pendulum(gravity))
    assert model.capsule
    return cache.cache_folder() / model.build["key"]


@pytest.mark.slow
def test_what_another_processor_has_compiled_is_not_loaded(unit_needed, monkeypatch):
    here = first_entry(8.5)
    monkeypatch.setattr(processor, "processor", lambda: "another")
    there = first_entry(8.5)
    assert here != there
    monkeypatch.setattr(processor, "processor", lambda: "a third")
    assert first_entry(8.5) not in (here, there)
