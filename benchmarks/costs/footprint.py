"""Sizes of what is installed, by part; memory after the import, of a run and of a batch, each in
its own process."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import mechc_codegen

import mechc

from ..timing.processes import said
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


# -- memory ----------------------------------------------------------------------------------------

IMPORTED = "import numpy, {more}; print(json.dumps(peak_bytes()))"
RUN = """
import mechc
model = mechc.load("four_bar")
start = model.assemble({"theta_0": 1.4835}, params={"l_3": 3.5})
model.simulate(1.0, start, {"l_3": 3.5})
before = peak_bytes()
sol = model.simulate(5000.0, start, {"l_3": 3.5})
print(json.dumps([peak_bytes() - before, sol.stats["steps"]]))
"""

BATCH = """
import mechc, numpy
model = mechc.load("four_bar")
def run(members):
    start = mechc.Assembly({"theta_0": numpy.linspace(1.0, 1.6, members)})
    given = {"l_3": numpy.full(members, 3.5)}
    return model.simulate_batch(1.0, start, given, t_eval=[0.5, 1.0], threads=1)
run(10)
before = peak_bytes()
batch = run(20_000)
print(json.dumps((peak_bytes() - before) / 20_000))
"""


def after_import() -> tuple[int, int]:
    """Bytes that Python holds with numpy, and those that mechc adds."""
    bare = said(IMPORTED.format(more="json"))
    return bare, said(IMPORTED.format(more="mechc")) - bare


def of_a_run() -> float:
    """Bytes an accepted step, dense output kept."""
    added, steps = said(RUN)
    return float(added / steps)


def of_a_batch() -> float:
    """Bytes a member that reports two states."""
    return float(said(BATCH))
