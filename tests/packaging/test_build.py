"""Building: sdist to wheel to a working install; nothing stale is served, nothing is littered."""

import json
import os
import re
import shutil
import subprocess
import sys
import tarfile
import tomllib

import pytest

import mechc
from tests.support import ROOT
from tests.support.compilers.compilation import compiler_at

FREEZE_IN = ("src", "codegen", "benchmarks", "packaging", "pyproject.toml", "setup.py",
             "README.md", "LICENSE", "MANIFEST.in", "CHANGELOG.md")  # fmt: skip


@pytest.fixture
def source(tmp_path):
    """A copy of what a build needs."""
    ignore = shutil.ignore_patterns("*.so", "__pycache__", "*.egg-info", "out")
    copy = tmp_path / "source"
    copy.mkdir()
    for name in FREEZE_IN:
        path = ROOT / name
        if path.is_dir():
            shutil.copytree(path, copy / name, ignore=ignore)
        else:
            shutil.copy(path, copy / name)
    return copy


def python(*arguments, cwd, **environment):
    done = subprocess.run(
        [sys.executable, *arguments],
        cwd=cwd,
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.mark.thorough
def test_sdist_to_wheel_to_a_model_that_runs(source, tmp_path):
    """Without optimisation: whether all is there to be built shows as well."""
    build = "import setuptools.build_meta as b; b.build_sdist('../dist')"
    python("-c", build, cwd=source)
    (archive,) = (tmp_path / "dist").glob("*.tar.gz")
    with tarfile.open(archive) as tar:
        tar.extractall(tmp_path / "unpacked", filter="data")
    (unpacked,) = (tmp_path / "unpacked").iterdir()
    assert (unpacked / "LICENSE").exists()
    python(
        *("-m", "pip", "install", "--quiet", "--no-build-isolation", "--no-deps"),
        *("--no-index", "--disable-pip-version-check", "--target", str(tmp_path / "site")),
        str(unpacked),
        cwd=tmp_path,
        CC=compiler_at("-O0", tmp_path),
    )
    installed = {p.name for p in (tmp_path / "site" / "mechc").iterdir()}
    assert "py.typed" in installed
    every_template_is_there(tmp_path / "site")
    run = python(
        *("-m", "mechc", "run", "four_bar", "--json", "--set", "l_3=3.5"),
        cwd=tmp_path,
        PYTHONPATH=str(tmp_path / "site"),
    )
    assert json.loads(run)["status"] == "finished"
    where = python(
        *("-c", "import mechc, mechc_codegen; print(mechc.__file__, mechc_codegen.__file__)"),
        cwd=tmp_path,
        PYTHONPATH=str(tmp_path / "site"),
    )
    assert all(str(tmp_path) in path for path in where.split())
    the_suite_runs(tmp_path)


def every_template_is_there(site):
    for root in ("src", "codegen"):
        files = [path for path in (ROOT / root).rglob("templates/**/*") if path.is_file()]
        missing = [path for path in files if not (site / path.relative_to(ROOT / root)).exists()]
        assert files
        assert not missing


def the_suite_runs(tmp_path):
    """``mechc bench`` of the wheel, where a folder of its name would do something else."""
    here = tmp_path / "mechc_bench"
    here.mkdir()
    for name in ("__main__.py", "__init__.py"):
        (here / name).write_text("raise SystemExit('not mine')")
    shutil.copytree(here, tmp_path / "benchmarks")
    python(
        *("-m", "mechc", "bench", "--smoke", "--only", "stress"),
        cwd=tmp_path,
        PYTHONPATH=str(tmp_path / "site"),
    )
    results = json.loads((here / "results.json").read_text())
    assert results["codes"] == {"stress": 0}
    assert results["about"]["commit"] == "", "an installed release has none"
    assert "<svg" not in (here / "results.html").read_text(), "nothing with a plot was run"
    installed = {path.name for path in (tmp_path / "site" / "mechc_bench").rglob("*")}
    assert {"report.html", "closure_curve.c", "four_bar_regular.json", "__init__.py"} <= installed


@pytest.mark.slow
def test_a_changed_header_or_equation_is_compiled_again(source):
    """Every generated text and every runtime header decides whether a scene is up to date."""
    script = """
import os, sys, time
from pathlib import Path
from setuptools import Distribution
sys.argv = ["setup.py", "--name"]
import setuptools
captured = {}
setuptools.setup = lambda **given: captured.update(given)
exec(compile(Path("setup.py").read_text(), str(Path("setup.py").resolve()), "exec"),
     {"__file__": str(Path("setup.py").resolve()), "__name__": "__main__"})
command = captured["cmdclass"]["build_ext"](Distribution({**captured, "script_name": "setup.py"}))
command.build_temp, command.build_lib, command.builds = "build/temp", "build/lib", {}
command.finalize_options()
sys.path.insert(0, "codegen")
scene = next(e for e in command.extensions if e.name == "mechc._scenes.four_bar")
command.generate(scene)
target = Path(command.get_ext_fullpath(scene.name))
target.parent.mkdir(parents=True)
assert command.is_stale(scene), "there is nothing yet"
target.touch()
os.utime(target, (time.time() + 10,) * 2)
assert not command.is_stale(scene)
kinds = {Path(path).suffix for path in scene.depends}
assert kinds == {".c", ".h"}, kinds
for path in scene.depends:
    before = os.stat(path)
    os.utime(path, (time.time() + 20,) * 2)
    assert command.is_stale(scene), path
    os.utime(path, (before.st_atime, before.st_mtime))
names = {Path(path).name for path in scene.depends}
assert {"model.h", "stage.h", "scene_program.h", "scene_sizes.h"} <= names, names
"""
    python("-c", script, cwd=source)


def test_reading_setup_py_writes_nothing(source):
    before = sorted(p for p in source.rglob("*"))
    python("-B", "setup.py", "--name", cwd=source)
    assert sorted(p for p in source.rglob("*")) == before


def test_the_repository_holds_no_generated_file():
    tracked = subprocess.run(
        ["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=False
    )
    if tracked.returncode != 0:
        pytest.skip("not a git checkout")
    generated = (".so", ".o", ".nc", ".pyc", "scene_program.h", "_driver.c")
    found = [name for name in tracked.stdout.split() if name.endswith(generated)]
    assert [name for name in found if "/in_place_of_scene/" not in name] == []


def test_the_conda_recipe_asks_for_what_the_package_does():
    """Under conda's names, and for a C compiler besides."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
    recipe = (ROOT / "packaging" / "conda" / "recipe.yaml").read_text("utf-8")
    run = recipe.split("\n  run:\n")[1].split("\n\n")[0]
    wanted = {text.replace(" ", "").replace("-base", "") for text in re.findall(r"- (.+)", run)}
    python = "python" + project["project"]["requires-python"]
    assert wanted == {*project["project"]["dependencies"], python, "c-compiler"}
    host = recipe.split("\n  host:\n")[1].split("\n  run:\n")[0]
    built_by = {text.replace(" ", "") for text in re.findall(r"- (.+)", host)}
    assert built_by == {*project["build-system"]["requires"], "python", "pip"}
    assert f"version: {mechc.__version__}\n" in recipe
