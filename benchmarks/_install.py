"""The distribution: how long it takes to build and install, how large it is and of what parts."""

from __future__ import annotations

import io
import resource
import subprocess
import sys
import tarfile
import tempfile
import time
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import mechc_codegen

import mechc

FOLDER = Path(__file__).resolve().parent
ROOT = FOLDER.parent
PACKAGES = (Path(mechc.__file__).parent, Path(mechc_codegen.__file__).parent, FOLDER)
NOT_INSTALLED = ("*.pyx", "*.pyc", "out/*")  # but in a source tree


class NoSourceTreeError(Exception):
    """The distribution can be built in a clone only; the message says so."""


def installed() -> dict[str, Any]:
    """Bytes of the installed files by part, their number, and the size of a wheel of them."""
    files = {path: _part(path) for path in _files()}
    parts = dict.fromkeys(sorted(set(files.values())), 0)
    for path, part in files.items():
        parts[part] += path.stat().st_size
    return {
        "bytes": sum(parts.values()), "files": len(files), "parts": parts,
        "packed": _packed(files),
    }  # fmt: skip


def _files() -> Iterator[Path]:
    for package in PACKAGES:
        for path in sorted(package.rglob("*")):
            if path.is_file() and not any(path.match(left) for left in NOT_INSTALLED):
                yield path


def _part(path: Path) -> str:
    if path.suffix == ".so":
        return "mechanisms, compiled" if path.parent.name == "_scenes" else "driver, compiled"
    if FOLDER in path.parents:
        return "benchmarks"
    if PACKAGES[1] in path.parents:
        return "headers for generated code" if path.suffix == ".h" else "compiler"
    return "runtime, Python"


def _packed(files: Any) -> int:
    """Bytes of the files deflated as in a wheel."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for path in files:
            archive.write(path, f"{path.parent.name}/{path.name}")
    return len(buffer.getvalue())


def source_distribution() -> dict[str, Any]:
    """Seconds and bytes of ``sdist``, from a copy of what a build needs.

    Raises
    ------
    NoSourceTreeError
        Where this is no clone; so do the two below.
    """
    build = "import setuptools.build_meta as b; b.build_sdist('dist')"
    with tempfile.TemporaryDirectory() as name:
        folder = _copied(Path(name))
        _, spent = timed([sys.executable, "-c", build], folder)
        (archive,) = (folder / "dist").glob("*.tar.gz")
        with tarfile.open(archive) as tar:
            files = sum(member.isfile() for member in tar)
        return {**spent, "bytes": archive.stat().st_size, "files": files}


def wheel() -> dict[str, Any]:
    """Seconds and bytes of a wheel built with what this environment has."""
    pip = ["-m", "pip", "wheel", "--quiet", "--no-deps", "--no-build-isolation", "--no-index"]
    with tempfile.TemporaryDirectory() as name:
        folder = _copied(Path(name))
        _, spent = timed([sys.executable, *pip, "--wheel-dir", "dist", "."], folder)
        (archive,) = (folder / "dist").glob("*.whl")
        with zipfile.ZipFile(archive) as opened:
            sizes = [info.file_size for info in opened.infolist()]
        return {
            **spent, "bytes": archive.stat().st_size, "installed": sum(sizes), "files": len(sizes)
        }  # fmt: skip


def fresh_environment() -> dict[str, dict[str, float]]:
    """Seconds of a new environment and of ``pip install .`` in it; needs a package index."""
    with tempfile.TemporaryDirectory() as name:
        folder = _copied(Path(name))
        _, made = timed([sys.executable, "-m", "venv", "fresh"], folder)
        python = str(folder / "fresh" / "bin" / "python")
        _, spent = timed([python, "-m", "pip", "install", "--quiet", "."], folder)
        return {"venv": made, "pip install .": spent}


def timed(command: list[str], folder: Path) -> tuple[str, dict[str, float]]:
    """What it printed; its seconds by the clock and of the processor.

    Raises
    ------
    RuntimeError
        If it fails; with the end of what it said.
    """
    began, before = time.perf_counter(), _processor_seconds()
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(f"{command[1:4]} failed: {(done.stdout + done.stderr)[-400:]}")
    spent = {"wall": time.perf_counter() - began, "processor": _processor_seconds() - before}
    return done.stdout, spent


def _processor_seconds() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def _copied(folder: Path) -> Path:
    """The files under version control, as they are now: builds write beside what they read."""
    command = ["git", "-C", str(ROOT), "ls-files", "-z"]
    try:
        listed = subprocess.run(command, capture_output=True, text=True, check=True)
    except (OSError, subprocess.CalledProcessError):
        raise NoSourceTreeError(f"{ROOT} is not a clone") from None
    for name in filter(None, listed.stdout.split("\0")):
        source, target = ROOT / name, folder / name
        if source.is_file():
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(source.read_bytes())
    return folder
