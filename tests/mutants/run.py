"""Put each fault into a copy of this tree, and say which test finds it first.

    python -m tests.mutants.run [--only N ...] [--near] [--marked "not slow and not thorough"]

Tests of folders that are named as the file or one of its folders run first, the innermost before
others, then all of the tier.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

from tests.mutants.faults import FAULTS, Fault
from tests.support import ROOT

FAST = "not slow and not thorough"
LONGEST = 1800.0  # seconds of a run of tests
# Folders of headers whose tests have another name; those of "runtime" are of everything.
OTHERWISE = {"hybrid": "simulation", "variational": "sensitivities", "simd": "emit", "runtime": ""}
_FAILED = re.compile(r"(?m)^(?:FAILED|ERROR) (\S+)")


def copied(folder: Path) -> Path:
    """A copy of the files that git knows, and of what was built in place."""
    listed = subprocess.run(
        ["git", "ls-files", "-co", "--exclude-standard"], cwd=ROOT, check=True, capture_output=True,
        text=True,
    )  # fmt: skip
    for name in listed.stdout.splitlines():
        if (ROOT / name).is_file():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, folder / name)
    copy_built(folder)
    return folder


def copy_built(folder: Path) -> None:
    """What is built in place here, into a copy."""
    for path in (ROOT / "src").rglob("*.so"):
        shutil.copy2(path, folder / path.relative_to(ROOT))


def related(tree: Path, fault: Fault) -> list[str]:
    """Folders of tests that are named as the file that the fault is in or a folder of it, the
    innermost first."""
    path = Path(fault.path)
    names = [path.stem, *reversed(path.parts[2:-1])]
    folders = [each for each in (tree / "tests").rglob("*") if each.is_dir()]
    found = list[Path]()
    for name in names:
        named = OTHERWISE.get(name, name)
        found += sorted(each for each in folders if each.name == named and each not in found)
    return [each.relative_to(tree).as_posix() for each in found]


def first_failure(tree: Path, where: Sequence[str], marked: str) -> str | None:
    """The test that fails first, or None."""
    paths = os.pathsep.join(str(tree / name) for name in ("src", "codegen", "."))
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-qx", "-m", marked, "-p", "no:cacheprovider", *where],
        cwd=tree, env={**os.environ, "PYTHONPATH": paths}, capture_output=True, text=True,
        timeout=LONGEST, check=False,
    )  # fmt: skip
    found = _FAILED.search(done.stdout)
    if done.returncode and not found:
        return (done.stdout + done.stderr).strip().splitlines()[-1]
    return found[1] if found else None


def found_by(tree: Path, fault: Fault, marked: str, *, near_alone: bool = False) -> str | None:
    """The test that finds a fault, or None."""
    file = tree / fault.path
    sound = file.read_text("utf-8")
    file.write_text(sound.replace(fault.says, fault.instead), "utf-8")
    try:
        if file.suffix in (".h", ".pyx") and not built(tree):
            return "the build"
        for near in related(tree, fault):
            if found := first_failure(tree, [near], marked):
                return found
        return None if near_alone else first_failure(tree, (), marked)
    finally:
        file.write_text(sound, "utf-8")
        copy_built(tree)


def built(tree: Path) -> bool:
    """Build in place what the headers and modules are compiled to."""
    command = [sys.executable, "setup.py", "-q", "build_ext", "--inplace"]
    return subprocess.run(command, cwd=tree, capture_output=True, check=False).returncode == 0


def main(arguments: Sequence[str] | None = None) -> int:
    """Print a row for each fault; 1 if any is not found."""
    parser = argparse.ArgumentParser(prog="python -m tests.mutants.run", description=__doc__)
    parser.add_argument("--only", nargs="*", type=int, help="numbers of faults")
    parser.add_argument("--marked", default=FAST, help="the tier, as of pytest's -m")
    parser.add_argument("--near", action="store_true", help="not the whole tier after its folders")
    given = parser.parse_args(arguments)
    missed = 0
    with tempfile.TemporaryDirectory(prefix="mechc-mutants-") as folder:
        tree = copied(Path(folder))
        for number, fault in enumerate(FAULTS):
            if given.only and number not in given.only:
                continue
            started = time.monotonic()
            found = found_by(tree, fault, given.marked, near_alone=given.near)
            missed += found is None
            took = time.monotonic() - started
            print(f"{number} | {fault.path} | {found or 'NOT FOUND'} | {took:.0f} s", flush=True)
    return missed > 0


if __name__ == "__main__":
    sys.exit(main())
