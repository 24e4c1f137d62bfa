"""Which C compiler builds mechc: the machine's own, or else one from the package index."""

import os
import runpy
import shlex
import sysconfig
import tomllib
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from setuptools import build_meta

from mechc.native import _tableaus
from tests.support import ROOT
from tests.support.compilers.compilation import built_by_setup

BACKEND = str(ROOT / "packaging" / "mechc_build.py")
COMPILER = SimpleNamespace(**runpy.run_path(str(ROOT / "packaging" / "mechc_compiler.py")))
LINUX, WINDOWS = "linux-x86_64", "win-amd64"


@pytest.fixture
def alone(tmp_path, monkeypatch):
    """A folder that is all of PATH, without any compiler; the one that built Python is absent."""
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setitem(sysconfig.get_config_vars(), "CC", "compiler-of-python -pthread")
    return tmp_path


def program(folder, name):
    (folder / name).touch(mode=0o700)


def required():
    return runpy.run_path(BACKEND)["compiler_required"]()


def test_a_machine_without_a_compiler_asks_for_the_package_of_the_extra(alone):
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
    assert required() == project["project"]["optional-dependencies"]["compiler"]


@pytest.mark.parametrize("name", ["gcc", "clang", "cc", "compiler-of-python"])
def test_a_machine_with_a_compiler_asks_for_none(alone, name):
    program(alone, name)
    assert required() == []


def test_a_user_who_sets_cc_is_given_no_other(alone, monkeypatch):
    monkeypatch.setenv("CC", "/opt/cc")
    assert required() == []
    assert COMPILER.replacing({"CC": "/opt/cc"}, LINUX) == {}


def test_wheels_and_editable_installs_ask_for_it_besides_what_setuptools_needs(alone, monkeypatch):
    """An archive of the sources is made without."""
    for kind in ("wheel", "editable", "sdist"):
        monkeypatch.setattr(build_meta, f"get_requires_for_build_{kind}", lambda _=None: ["x"])
    backend = runpy.run_path(BACKEND)
    asked = {k: backend[f"get_requires_for_build_{k}"]() for k in ("wheel", "editable", "sdist")}
    assert asked == {"wheel": ["x", *required()], "editable": ["x", *required()], "sdist": ["x"]}


def test_the_compiler_of_python_needs_no_other(alone):
    program(alone, "compiler-of-python")
    program(alone, "gcc")
    assert COMPILER.replacing({}, LINUX) == {}


def test_another_one_is_used_without_the_flags_of_pythons(alone):
    program(alone, "clang")
    told = COMPILER.replacing({"CFLAGS": "-Os"}, LINUX)
    assert told == {"CC": "clang", "CFLAGS": "-Os", "LDSHARED": "clang -shared"}


def test_the_packaged_one_compiles_for_any_processor(alone):
    pytest.importorskip("ziglang")
    told = COMPILER.replacing({}, LINUX)
    assert "zig cc " in told["CC"]
    assert "-mcpu=baseline" in told["CC"]
    assert told["LDSHARED"] == f"{told['CC']} -shared"


def test_for_windows_the_packaged_one_is_taken_whatever_else_is_there(alone, monkeypatch):
    """setuptools would take Microsoft's; gcc, there, may be of any kind."""
    monkeypatch.setattr(sysconfig, "get_platform", lambda: WINDOWS)
    for name in ("gcc", "compiler-of-python"):
        program(alone, name)
    assert required() == [runpy.run_path(BACKEND)["PACKAGED"]]
    monkeypatch.setenv("CC", "gcc")
    assert required() == []
    assert COMPILER.replacing({"CC": "gcc"}, WINDOWS) == {}
    pytest.importorskip("ziglang")
    told = shlex.split(COMPILER.replacing({}, WINDOWS)["CC"])
    assert told[told.index("-target") + 1] == "x86_64-windows-gnu"
    assert "-mcpu=baseline" in told


def test_setuptools_class_for_windows_runs_the_command_with_these_flags():
    """A path of Windows is one word, backslashes and all."""
    zig = r"C:\Program Files\zig.exe"
    told = {"CC": shlex.join([zig, "cc"]), "CFLAGS": "-O2 -g0"}
    runs = COMPILER.executables(told, Path("aside.lib"))
    assert runs["compiler"] == runs["compiler_so"] == [zig, "cc", "-O2", "-g0", "-DMS_WIN64"]
    assert runs["linker_so"] == [zig, "cc", "-shared", "-Wl,--out-implib,aside.lib"]


@pytest.mark.slow
def test_an_extension_is_built_with_no_compiler_but_the_packaged_one(tmp_path):
    pytest.importorskip("ziglang")
    nothing = tmp_path / "bin"
    nothing.mkdir()
    kept = {k: v for k, v in os.environ.items() if k not in ("CC", "CFLAGS", "LDSHARED")}
    environment = {**kept, "PATH": str(nothing)}
    (built,) = built_by_setup(tmp_path, ["mechc.native._tableaus"], environment)
    assert b"clang version" in built.read_bytes()
    spec = spec_from_file_location("_tableaus", built)
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    for method, parts in _tableaus.PAIRS.items():
        for mine, usual in zip(module.PAIRS[method], parts, strict=True):
            np.testing.assert_array_equal(mine, usual)
