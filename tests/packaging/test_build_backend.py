"""Which C compiler builds mechc: the machine's own, or else one from the package index."""

import os
import runpy
import subprocess
import sys
import sysconfig
import tomllib
from importlib.util import module_from_spec, spec_from_file_location

import numpy as np
import pytest
import setuptools
from setuptools import build_meta

from mechc.native import _tableaus
from tests.support import ROOT

BACKEND = str(ROOT / "packaging" / "mechc_build.py")


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
    assert replacing(monkeypatch, {"CC": "/opt/cc"}) == {}


def test_wheels_and_editable_installs_ask_for_it_besides_what_setuptools_needs(alone, monkeypatch):
    """An archive of the sources is made without."""
    for kind in ("wheel", "editable", "sdist"):
        monkeypatch.setattr(build_meta, f"get_requires_for_build_{kind}", lambda _=None: ["x"])
    backend = runpy.run_path(BACKEND)
    asked = {k: backend[f"get_requires_for_build_{k}"]() for k in ("wheel", "editable", "sdist")}
    assert asked == {"wheel": ["x", *required()], "editable": ["x", *required()], "sdist": ["x"]}


def replacing(monkeypatch, environment):
    """What setup.py sets besides an environment."""
    monkeypatch.chdir(ROOT)
    monkeypatch.setattr(setuptools, "setup", lambda **_: None)
    return runpy.run_path("setup.py")["replacing"](environment)


def test_the_compiler_of_python_needs_no_other(alone, monkeypatch):
    program(alone, "compiler-of-python")
    program(alone, "gcc")
    assert replacing(monkeypatch, {}) == {}


def test_another_one_is_used_without_the_flags_of_pythons(alone, monkeypatch):
    program(alone, "clang")
    told = replacing(monkeypatch, {"CFLAGS": "-Os"})
    assert told == {"CC": "clang", "CFLAGS": "-Os", "LDSHARED": "clang -shared"}


def test_the_packaged_one_compiles_for_any_processor(alone, monkeypatch):
    pytest.importorskip("ziglang")
    told = replacing(monkeypatch, {})
    assert "zig cc " in told["CC"]
    assert "-mcpu=baseline" in told["CC"]
    assert told["LDSHARED"] == f"{told['CC']} -shared"


ONE = """
import sys, setuptools
setup, sys.argv = setuptools.setup, ["setup.py", "-q", "build_ext"]
sys.argv += ["--build-lib", "{folder}", "--build-temp", "{folder}/temp"]

def setup_of_one(**given):
    name = "mechc.native._tableaus"
    setup(**{{**given, "ext_modules": [e for e in given["ext_modules"] if e.name == name]}})

setuptools.setup = setup_of_one
exec(compile(open("setup.py").read(), "{root}/setup.py", "exec"), {{"__file__": "{root}/setup.py"}})
"""


@pytest.mark.slow
def test_an_extension_is_built_with_no_compiler_but_the_packaged_one(tmp_path):
    pytest.importorskip("ziglang")
    nothing = tmp_path / "bin"
    nothing.mkdir()
    kept = {k: v for k, v in os.environ.items() if k not in ("CC", "CFLAGS", "LDSHARED")}
    script = ONE.format(folder=tmp_path, root=ROOT)
    subprocess.run(
        [sys.executable, "-c", script], cwd=ROOT, env={**kept, "PATH": str(nothing)}, check=True
    )
    (built,) = tmp_path.glob("mechc/native/_tableaus*")
    assert b"clang version" in built.read_bytes()
    spec = spec_from_file_location("_tableaus", built)
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    for method, parts in _tableaus.PAIRS.items():
        for mine, usual in zip(module.PAIRS[method], parts, strict=True):
            np.testing.assert_array_equal(mine, usual)
