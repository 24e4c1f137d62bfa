"""``mechc bench``: the benchmark suite that is installed with mechc, in a separate process."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from mechc.errors import MechcError


def bench(options: Sequence[str], home: Path | None = None) -> int:
    """Start the suite with its options and wait for it; its exit code.

    Only the suite that is installed with this package is started, never a folder of the same name
    in the working directory.  An interrupt goes to the suite too, which ends its scripts and writes
    its results; this waits for that.

    Raises :class:`MechcError` when the benchmarks are not installed.
    """
    folder = _folder(Path(__file__).resolve().parents[1] if home is None else home)
    path = os.pathsep.join(filter(None, (str(folder.parent), os.environ.get("PYTHONPATH"))))
    command = [sys.executable, "-P", "-m", folder.name, *options]
    with subprocess.Popen(command, env={**os.environ, "PYTHONPATH": path}) as suite:
        while True:
            with suppress(KeyboardInterrupt):
                return suite.wait()


def _folder(home: Path) -> Path:
    """``mechc_bench`` next to the package; in a clone, ``benchmarks`` next to ``src``."""
    places = [home.parent / "mechc_bench"]
    if home.parent.name == "src":
        places.append(home.parents[1] / "benchmarks")
    for place in places:
        if (place / "__main__.py").is_file():
            return place
    raise MechcError(
        f"the benchmarks are not installed with mechc in {home.parent}; "
        "install mechc again, or run `python -m benchmarks` in a clone"
    )
