"""Some of the extension modules built by ``setup.py``, in a process and a folder of their own."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

from tests.support import ROOT

_SOME = """
import runpy, setuptools, sys
names, setup, sys.argv = sys.argv[1].split(), setuptools.setup, ["setup.py", *sys.argv[2:]]

def setup_of_some(**given):
    setup(**{**given, "ext_modules": [e for e in given["ext_modules"] if e.name in names]})

setuptools.setup = setup_of_some
runpy.run_path("setup.py")
"""


def built_by_setup(
    folder: Path, names: Sequence[str], environment: Mapping[str, str], *options: str
) -> list[Path]:
    """The files that are in the folder after ``build_ext`` of these extension modules."""
    folders = ["--build-lib", str(folder / "lib"), "--build-temp", str(folder / "temp")]
    command = [sys.executable, "-c", _SOME, " ".join(names), "-q", "build_ext", *folders, *options]
    subprocess.run(command, cwd=ROOT, env=dict(environment), check=True)
    return sorted(path for path in (folder / "lib").rglob("*") if path.is_file())
