"""Conditions of a measurement: machine, versions, commit, and the load of the machine."""

from __future__ import annotations

import os
import platform
import subprocess
import sys
import time
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from mechc.compilation.toolchain import find_compiler

PEERS = (
    "scipy", "heyoka", "casadi", "scikit-sundae", "pydy", "mujoco", "exudyn", "pin",
)  # fmt: skip
PACKAGES = ("mechc", "numpy", "sympy", "cython", "numba", *PEERS)
VECTOR_FLAGS = ("sse4_2", "avx", "avx2", "fma", "avx512f", "avx512dq", "avx512vl", "asimd", "sve")


def about() -> dict[str, Any]:
    """All that is written with the figures."""
    return {
        "date": time.strftime("%Y-%m-%d %H:%M:%S"), "commit": _commit(), "processor": _processor(),
        "flags": _flags(), "instruction_set": _instruction_set(),
        "cores": len(os.sched_getaffinity(0)), "memory_GiB": _memory(), "load": os.getloadavg()[0],
        "system": platform.platform(), "python": platform.python_version(),
        "compiler": _said(*(find_compiler() or ["cc"]), "--version").partition("\n")[0],
        "versions": {name: _version(name) for name in PACKAGES},
    }  # fmt: skip


def _version(package: str) -> str | None:
    try:
        return version(package)
    except PackageNotFoundError:
        return None


def _commit() -> str:
    """The commit, with a plus where the tree differs from it; empty outside a clone."""
    root = Path(__file__).resolve().parent.parent
    if not (root / "pyproject.toml").exists():  # installed, perhaps within another's repository
        return ""
    commit = _said("git", "-C", str(root), "rev-parse", "--short", "HEAD")
    changed = _said("git", "-C", str(root), "status", "--porcelain", "--untracked-files=no")
    return f"{commit}+" if commit and changed else commit


def _processor() -> str:
    return _of_the_processor("model name") or platform.processor() or platform.machine()


def _flags() -> list[str]:
    """The processor's SIMD features."""
    found = (_of_the_processor("flags") or _of_the_processor("Features")).split()
    return [flag for flag in VECTOR_FLAGS if flag in found]


def _of_the_processor(field: str) -> str:
    info = Path("/proc/cpuinfo")
    lines = info.read_text().splitlines() if info.exists() else []
    found = (line.partition(":")[2].strip() for line in lines if line.startswith(field))
    return next(found, "")


def _instruction_set() -> str:
    """The instruction set that mechc uses here."""
    code = "import mechc; print(mechc.load('four_bar').instruction_set)"
    return _said(sys.executable, "-c", code)


def _memory() -> float:
    return round(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 2**30, 1)


def _said(*command: str) -> str:
    try:
        done = subprocess.run(command, capture_output=True, text=True, check=False)
    except OSError:
        return ""
    return done.stdout.strip()
