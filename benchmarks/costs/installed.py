"""The sizes of what is installed, by part."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import mechc_codegen

import mechc

from ..timing.results import HOME

PACKAGES = (Path(mechc.__file__).parent, Path(mechc_codegen.__file__).parent, HOME)
NOT_INSTALLED = ("*.pyx", "*.pyc", "out/*")  # but in a source tree


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
    if HOME in path.parents:
        return "benchmarks"
    if PACKAGES[1] in path.parents:
        return "headers for generated code" if path.suffix == ".h" else "compiler"
    return "runtime, Python"


def _packed(files: Iterable[Path]) -> int:
    """Bytes of the files deflated as in a wheel."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for path in files:
            package = next(p for p in PACKAGES if p in path.parents)
            archive.write(path, path.relative_to(package.parent))
    return len(buffer.getvalue())
