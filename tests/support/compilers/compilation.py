"""How tests compile scenes: what they need, and with less optimisation."""

from __future__ import annotations

import os
import shlex
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import pytest

from mechc.compilation import toolchain
from mechc.compilation.parts import Pending
from tests.support import ROOT

OF_USERS = os.environ.get("CC")  # the compiler before the tests choose theirs


class MadeOnRequest(Pending):
    """In place of the thread that compiles the integrators: many tests need none.

    Rates and outputs are compiled first; the integrators when they are asked for, not behind a
    test.
    """

    def __init__(self, make: Callable[[], Any], *, at_once: bool = True) -> None:
        super().__init__(make, at_once=False)


def compile_less_optimised(patch: pytest.MonkeyPatch, folder: Path) -> None:
    """Scenes of this process and of those that it starts; in half of the time.

    The compiler's name is part of the keys in the cache, and the same wherever the clone lies.
    """
    patch.setenv("CC", Path(compiler_at("-O0", folder)).name)
    patch.setenv("PATH", os.pathsep.join((str(folder), os.environ["PATH"])))


def compile_as_for_users(patch: pytest.MonkeyPatch) -> None:
    """Until the patch is undone."""
    patch.delenv("CC", raising=False)
    if OF_USERS is not None:
        patch.setenv("CC", OF_USERS)


def compiler_at(level: str, folder: Path) -> str:
    """A command for ``CC`` of other processes, whose last word is this level of optimisation;
    units that serve many scenes have their own, since most runs are by them."""
    path, command = folder / f"cc{level}", f'exec {shlex.join(toolchain.compiler())} "$@"'
    kinds = f'case "$*" in *-DMECHC_KIND_*) {command};; esac'
    path.write_text(f"#!/bin/sh\n{kinds}\n{command} {level}\n", "utf-8")
    path.chmod(0o755)
    return str(path)


def checking(compiler: Sequence[str], target: Path) -> list[str]:
    """What has a source checked alone; by zig's clang, which cannot, compiled to ``target``."""
    zig = Path(compiler[0]).name == "zig"
    return ["-c", "-O0", "-o", str(target)] if zig else ["-fsyntax-only"]


_SOME = """
import runpy, setuptools, sys
names, setup, sys.argv = sys.argv[1].split(), setuptools.setup, ["setup.py", *sys.argv[2:]]

def setup_of_some(**given):
    given["cmdclass"]["build_ext"].units_of_kinds = lambda _: ()
    setup(**{**given, "ext_modules": [e for e in given["ext_modules"] if e.name in names]})

setuptools.setup = setup_of_some
runpy.run_path("setup.py")
"""


def built_by_setup(
    folder: Path, names: Sequence[str], environment: Mapping[str, str], *options: str
) -> list[Path]:
    """What ``setup.py`` builds, in a process and a folder of its own, of these modules."""
    folders = ["--build-lib", str(folder / "lib"), "--build-temp", str(folder / "temp")]
    command = [sys.executable, "-c", _SOME, " ".join(names), "-q", "build_ext", *folders, *options]
    subprocess.run(command, cwd=ROOT, env=dict(environment), check=True)
    return sorted(path for path in (folder / "lib").rglob("*") if path.is_file())
