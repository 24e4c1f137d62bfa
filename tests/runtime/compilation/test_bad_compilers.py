"""A compiler may lie, hang, or leave children behind: the error says what it did."""

import concurrent.futures
import os
import resource
import shlex
import signal
import stat
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from functools import partial

import numpy as np
import pytest

import mechc
from mechc.compilation import toolchain
from mechc.errors import CompilerError
from tests.support.pendulums import pendulum

pytestmark = pytest.mark.compiles


def compiler_script(folder, body):
    script = folder / "cc"
    ask = 'if [ "$1" = --version ]; then echo cc 1; exit; fi'
    script.write_text(f"#!/bin/sh\n{ask}\n{body}\n")
    script.chmod(script.stat().st_mode | stat.S_IXUSR)
    return str(script)


@pytest.mark.parametrize("body", ["exit 0", 'echo odd >&2; : > "$(eval echo \\${$#})"; exit 0'])
def test_one_that_ends_well_and_writes_nothing_is_told(unit_needed, monkeypatch, body):
    monkeypatch.setenv("CC", compiler_script(unit_needed, body))
    with pytest.raises(
        CompilerError, match=r"succeeded but wrote no (general|derivatives|tapes|series_..)\.c\.o"
    ) as told:
        mechc.compile(pendulum(3))
    assert ("odd" in str(told.value)) == ("odd" in body)


def test_the_beginning_and_the_end_of_much_output_are_told(unit_needed, monkeypatch):
    """300 MB of it were kept in memory, and repeated in the error."""
    body = "echo first >&2; head -c 100000000 /dev/zero >&2; echo last >&2; exit 1"
    monkeypatch.setenv("CC", compiler_script(unit_needed, body))
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with pytest.raises(CompilerError, match=r"failed \(exit 1\)") as told:
        mechc.compile(pendulum(5))
    text = str(told.value)
    assert len(text) < 200_000
    assert "first" in text
    assert "99868939 bytes" in text
    assert text.endswith("last")
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 90 * 1024  # kB


@pytest.mark.slow
def test_one_whose_linker_dies_where_it_writes_is_run_elsewhere(unit_needed, monkeypatch):
    """As linkers do that map their output into memory, on a full disk; twice it is told."""
    usual, cache = shlex.join(toolchain.compiler()), unit_needed / "cache"
    body = f'case "$*" in *"-o {cache}"*) kill -BUS $$;; esac; exec {usual} "$@"'
    monkeypatch.setenv("CC", compiler_script(unit_needed, body))
    assert mechc.compile(pendulum(2)).rhs(0.0, [0.3, 0.1])[1] == pytest.approx(-2 * np.cos(0.3))
    compiler_script(unit_needed, "kill -BUS $$")
    (unit_needed / "other").mkdir(mode=0o700)  # without the unit that runs all pendulums
    monkeypatch.setenv("MECHC_CACHE_DIR", str(unit_needed / "other"))
    with pytest.raises(CompilerError, match="was ended by SIGBUS"):
        mechc.compile(pendulum(7))


def alive(pid):
    try:
        with open(f"/proc/{pid}/stat") as file:
            return file.read().split()[2] not in "ZX"
    except FileNotFoundError:
        return False


def gone(pid):
    for _ in range(100):
        if not alive(pid):
            return True
        time.sleep(0.05)
    return False


HANGS = 'echo thinking >&2; sleep 1000 & echo $! > "{child}"; wait'


def test_one_that_hangs_is_stopped_with_its_children_and_what_it_said(unit_needed, monkeypatch):
    """Compilers run side by side: of those that had begun, each is stopped."""
    monkeypatch.setenv(
        "CC", compiler_script(unit_needed, HANGS.format(child=unit_needed / "child$$"))
    )
    monkeypatch.setattr(toolchain, "LONGEST", 1.0)
    with pytest.raises(CompilerError, match=r"did not end within 1 s(?s:.*)thinking"):
        mechc.compile(pendulum(4))
    children = [text for file in unit_needed.glob("child*") if (text := file.read_text())]
    assert children
    assert all(gone(int(child)) for child in children)


def test_a_child_that_keeps_the_pipes_open_holds_nothing_up(unit_needed, monkeypatch):
    child = unit_needed / "child$$"
    body = f'setsid sleep 60 & echo $! > "{child}"; exit 0'
    monkeypatch.setenv("CC", compiler_script(unit_needed, body))
    monkeypatch.setattr(toolchain, "LONGEST", 1.0)
    started = time.perf_counter()
    with pytest.raises(CompilerError):
        mechc.compile(pendulum(5))
    assert time.perf_counter() - started < 30
    for file in unit_needed.glob("child*"):
        with suppress(ValueError, ProcessLookupError):  # ended with the first that failed
            os.kill(int(file.read_text()), signal.SIGKILL)


COMPILES = """
import mechc
from mechc.compilation import entries
from tests.support.pendulums import pendulum
entries.installed_unit = lambda _: None
try:
    mechc.compile(pendulum(6))
except KeyboardInterrupt:
    print("interrupted")
"""


@pytest.mark.slow
def test_ctrl_c_ends_the_compiler_and_its_children(unit_needed):
    child = unit_needed / "child"
    environment = {**os.environ, "CC": compiler_script(unit_needed, HANGS.format(child=child))}
    process = subprocess.Popen(
        [sys.executable, "-c", COMPILES], env=environment, stdout=subprocess.PIPE, text=True
    )
    while not child.exists() or not child.read_text().strip():
        time.sleep(0.02)
        assert process.poll() is None
    process.send_signal(signal.SIGINT)
    assert process.communicate(timeout=30)[0].strip() == "interrupted"
    assert gone(int(child.read_text()))


def test_ctrl_c_while_the_compiler_starts_ends_it(monkeypatch):
    """Its process exists then, and the object that ends it does not yet."""
    begun = []

    class Interrupted(subprocess.Popen):
        def _execute_child(self, *arguments):
            super()._execute_child(*arguments)
            begun.append(self.pid)
            signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr(subprocess, "Popen", Interrupted)
    with pytest.raises(KeyboardInterrupt):
        toolchain.version(("sh", "-c", "sleep 1000"))
    assert len(begun) == 1
    assert gone(begun[0])
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_what_the_headers_of_cpath_say_is_part_of_the_compiler(tmp_path, monkeypatch):
    header = tmp_path / "include" / "sys" / "math.h"
    header.parent.mkdir(parents=True)
    header.write_text("one")
    stamp, compiler = header.stat().st_mtime_ns, toolchain.compiler()
    for name in ("CPATH", "C_INCLUDE_PATH"):
        monkeypatch.setenv(name, str(tmp_path / "include"))
        header.write_text("one")
        os.utime(header, ns=(stamp, stamp))
        before = toolchain.identity(compiler)
        assert toolchain.identity(compiler) == before
        header.write_text("two")
        os.utime(header, ns=(stamp, stamp))
        assert toolchain.identity(compiler) != before
        monkeypatch.delenv(name)


IMPORT = """
import signal, sys
import mechc
class Interrupt:
    def find_spec(self, name, *_):
        if name == {place!r}:
            sys.meta_path.remove(self)
            signal.raise_signal(signal.SIGINT)
sys.meta_path.insert(0, Interrupt())
try:
    mechc.load("pendulum", outputs=["nothing"])
except KeyboardInterrupt:
    print("interrupted")
import sympy
from sympy.core.expr import Expr
x = sympy.Symbol("x")
assert isinstance(x, Expr) and sympy.expand((x + 1)**2) == x**2 + 2*x + 1
try:
    mechc.load("pendulum", outputs=["nothing"])
except mechc.MechcError as error:
    print(type(error).__name__)
"""


@pytest.mark.slow(cases=99)
@pytest.mark.parametrize(
    "place",
    ["sympy.core.numbers", "mpmath.libmp.libmpf", "sympy.solvers", "sympy.physics.mechanics.body"],
)
def test_an_interrupt_of_the_first_import_of_sympy_leaves_the_session_whole(place):
    """It left SymPy half imported, and every later call failed."""
    code = IMPORT.format(place=place)
    told = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert told.stdout.split() == ["interrupted", "MechanismError"], told.stderr


def test_ctrl_c_between_two_compilers_ends_the_first(monkeypatch):
    """The second has not begun then; the first was waited for without end."""
    begun = []

    class Interrupted(ThreadPoolExecutor):
        def submit(self, *arguments):
            if not begun:
                begun.append(super().submit(*arguments))
                return begun[0]
            while not toolchain._running:
                time.sleep(0.02)
            raise KeyboardInterrupt

    monkeypatch.setattr(concurrent.futures, "ThreadPoolExecutor", Interrupted)
    run = partial(toolchain.version, ("sh", "-c", "sleep 1000"))
    with pytest.raises(KeyboardInterrupt):
        toolchain.all_at_once([run, run])
    assert begun[0].done()
    assert not toolchain._running
