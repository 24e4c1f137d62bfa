"""What tells one compiler from another, without running it where its file says it."""

import os
import shutil
import stat
from pathlib import Path

import numpy as np
import pytest

import mechc
from mechc.compilation import build, toolchain
from mechc.compilation.cache import security
from mechc.compilation.toolchain import zig_cache
from mechc.errors import CompilerError
from tests.support.pendulums import pendulum

pytestmark = pytest.mark.compiles


@pytest.fixture(autouse=True)
def nothing_remembered():
    toolchain.version.cache_clear()
    yield
    toolchain.version.cache_clear()


@pytest.fixture
def never_run(monkeypatch):
    monkeypatch.setattr(toolchain, "_output", lambda command: pytest.fail(f"ran {command}"))


def program(path, content):
    path.parent.mkdir(exist_ok=True)
    path.write_bytes(content)
    path.chmod(path.stat().st_mode | stat.S_IXUSR)
    return str(path)


ELF = b"\x7fELF" + bytes(100) + b"build one"


def test_a_compiler_of_this_machine_is_told_without_running_it(never_run):
    gcc = shutil.which("gcc")
    if gcc is None:
        pytest.skip("no gcc here")
    assert str(Path(gcc).resolve()) in toolchain.identity(["gcc"])


def test_another_build_size_or_time_is_another_compiler(tmp_path, never_run):
    path = tmp_path / "x86_64-linux-gnu-gcc-12"
    program(path, ELF)
    os.utime(path, (1, 1))
    told = {toolchain.identity([str(path)])}
    for content, time in ((ELF[:-3] + b"two", 1), (ELF + b"more", 1), (ELF, 2)):
        path.write_bytes(content)
        os.utime(path, (time, time))
        told.add(toolchain.identity([str(path)]))
    assert len(told) == 4


def test_a_link_is_told_by_what_it_leads_to(tmp_path, never_run):
    one, other = (program(tmp_path / f"gcc-{n}", ELF + bytes([n])) for n in (12, 13))
    link = tmp_path / "cc"
    link.symlink_to(one)
    before = toolchain.identity([str(link)])
    link.unlink()
    link.symlink_to(other)
    assert before != toolchain.identity([str(link)])


def test_what_only_passes_on_to_a_compiler_is_asked(tmp_path, monkeypatch):
    """A script called gcc, or ccache behind a link called gcc, stays the same file all along."""
    (tmp_path / "bin").mkdir()
    script = program(tmp_path / "gcc", b"#!/bin/sh\necho one 1.0\n")
    ccache = tmp_path / "bin" / "gcc"
    ccache.symlink_to(program(tmp_path / "ccache", b"#!/bin/sh\necho one 1.0\n"))
    for command in (script, str(ccache)):
        assert "one 1.0" in toolchain.identity([command])


@pytest.mark.parametrize("name", toolchain._STEERING)
def test_what_steers_a_compiler_from_outside_is_part_of_it(name, tmp_path, monkeypatch):
    command = [program(tmp_path / "gcc", ELF)]
    monkeypatch.delenv(name, raising=False)
    plain = toolchain.identity(command)
    monkeypatch.setenv(name, "/elsewhere")
    assert toolchain.identity(command) != plain


def test_flags_in_the_command_are_part_of_it(tmp_path):
    command = [program(tmp_path / "gcc", ELF)]
    assert toolchain.identity(command) != toolchain.identity([*command, "-O0"])


def test_a_compiler_that_is_gone_meanwhile_is_told(tmp_path):
    with pytest.raises(CompilerError, match="cannot run"):
        toolchain.identity([str(tmp_path / "gcc")])


@pytest.fixture
def alone(tmp_path, monkeypatch):
    """No compiler but that of the package is found."""
    pytest.importorskip("ziglang")
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setenv("PATH", str(tmp_path))


def test_the_packaged_compiler_is_taken_where_there_is_no_other(alone, never_run):
    command = toolchain.compiler()
    assert Path(command[0]).stem == "zig"
    assert command[0] in toolchain.identity(command)


def test_without_any_the_error_says_what_brings_one(alone, monkeypatch):
    monkeypatch.setattr(toolchain, "packaged_compiler", lambda: None)
    with pytest.raises(CompilerError, match=r"pip install '\.\[compiler\]' in the clone"):
        toolchain.compiler()


def test_zig_keeps_the_c_library_where_it_can_write(tmp_path, monkeypatch):
    """In the user's cache folder, beside the scenes, with this process's scenes, or there."""
    home, chosen, here, private = (tmp_path / name for name in ("home", "chosen", "here", "own"))
    monkeypatch.setenv("XDG_CACHE_HOME", str(home))
    monkeypatch.setenv("MECHC_CACHE_DIR", str(chosen))
    monkeypatch.delenv("ZIG_GLOBAL_CACHE_DIR", raising=False)
    monkeypatch.setattr(security, "_temporary", {})
    places, refused = [], []
    monkeypatch.setattr(zig_cache, "_can_be_made", lambda folder: folder not in refused)
    for unusable in (None, home, chosen):
        refused.append(unusable)
        places.append(zig_cache.environment(here))
    security._temporary[os.getpid()] = private
    places.append(zig_cache.environment(here))
    wanted = [home, chosen, here, private]
    assert places == [{"ZIG_GLOBAL_CACHE_DIR": str(folder / "zig")} for folder in wanted]
    monkeypatch.setenv("ZIG_GLOBAL_CACHE_DIR", "/elsewhere")
    assert zig_cache.environment(here) == {}


@pytest.mark.slow
@pytest.mark.thorough
def test_what_it_compiles_moves_as_what_another_compiler_made(monkeypatch, request):
    """By all methods; from a cache where another compiler's has another key."""
    ends, keys = [], []
    for compiler in ("usual", "alone"):
        if compiler == "alone":
            request.getfixturevalue("alone")
            monkeypatch.setattr(build, "_compiled", {})
        model = mechc.compile(pendulum(3))
        y0 = model.assemble({"q": 1.0})
        methods = ("gauss8", "dop853", "dopri5", "radau5")
        ends.append([model.simulate(2.0, y0, method=m, rtol=1e-10).y[-1] for m in methods])
        keys.append(model.build["key"])
    assert keys[0] != keys[1]
    assert np.array(ends[0]) == pytest.approx(np.array(ends[1]), abs=1e-9)
