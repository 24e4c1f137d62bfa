"""Headers of the runtime in which constants have factors that are read while a run goes on.

Input: constants.  Output: a folder of all headers, since some include those beside them, to be
searched before the runtime's; and the order of the factors in a file of doubles, which is mapped
into memory.  A scene is compiled once, whatever is varied.  The numbers of methods' traits are in
tables of constants: where they are used they are multiplied.
"""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
import sys
from collections import defaultdict
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from mechc_codegen.extension.flags import RUNTIME

from ..timing.results import HOME
from .constants import Constant

FILE_VARIABLE = "MECHC_FACTORS"  # in the environment: the file
CLOSING = "mechc.native._closing"  # compiled into the runtime, not into scenes
METHODS = ("DOPRI5", "DOP853", "RADAU5", "GAUSS8", "TAYLOR", "GAUSS8_LOCKSTEP")  # abi/codes.h
_FIELDS = ("share", "growth", "farthest", "ignored", "after_failure", "horizon")
_USE = re.compile(rf"\b((?:\w+->)*(?:method|current))->({'|'.join(_FIELDS)})\b")
_INITIALISED = re.compile(r"[ \t]*\.(\w+) = ([A-Z]\w*)")
_PRELUDE = """\
#include <fcntl.h>
#include <stdlib.h>
#include <sys/mman.h>
static const double *mechc_factor;
__attribute__((constructor)) static void mechc_map_factors(void)
{
    const int file = open(getenv("%s"), O_RDONLY);
    mechc_factor = mmap(0, %d * sizeof(double), PROT_READ, MAP_SHARED, file, 0);
    if (mechc_factor == MAP_FAILED) abort();
}
#define MECHC_TRAIT(field, method) \\
    ((method)->field * mechc_factor[mechc_factor_of_##field[(method)->number]])
"""


def write_headers(constants: Sequence[Constant], folder: Path) -> None:
    """The headers in ``folder``, and ``prelude.h``, which is to be included before everything."""
    places = {each.name: k + 1 for k, each in enumerate(constants)}  # the first factor stays 1
    values = {each.name: each.value for each in constants}
    traits = _traits(constants)
    defined: dict[str, dict[int, str]] = defaultdict(dict)
    for each in constants:
        if not each.is_trait and "," not in each.value:  # a list is no number
            defined[each.header][each.line] = each.name
    for path in sorted(RUNTIME.rglob("*.h")):
        name, lines = path.relative_to(RUNTIME).as_posix(), path.read_text("utf-8").splitlines()
        varied = [_varied(line, defined[name].get(i + 1), values, places) for i, line in
                  enumerate(lines)]  # fmt: skip
        if "tableau" in name:  # of constants alone, and read by Python
            varied = [_with_values(line, values) for line in varied]
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text("\n".join(varied) + "\n", "utf-8")
    tables = [
        f"static const short mechc_factor_of_{field}[] __attribute__((unused)) = "
        f"{{{', '.join(str(places.get(traits.get((each, field), ''), 0)) for each in METHODS)}}};"
        for field in _FIELDS
    ]
    text = _PRELUDE % (FILE_VARIABLE, len(constants) + 1) + "\n".join(tables) + "\n"
    (folder / "prelude.h").write_text(text, "utf-8")


def _varied(
    line: str, name: str | None, values: Mapping[str, str], places: Mapping[str, int]
) -> str:
    """A line of a header with factors."""
    if name is not None:
        head, value, rest = line.partition(values[name])
        return f"{head}(({value}) * mechc_factor[{places[name]}]){rest}"
    if (found := _INITIALISED.match(line)) and found[2] in values:
        return line.replace(found[2], values[found[2]])
    return _USE.sub(r"MECHC_TRAIT(\2, \1)", line)


def _with_values(line: str, values: Mapping[str, str]) -> str:
    """A line of a table with the constants' values, but for their definitions."""
    if line.lstrip().startswith("#"):
        return line
    return re.sub(r"\bMECHC_\w+", lambda found: values.get(found[0], found[0]), line)


def _traits(constants: Sequence[Constant]) -> dict[tuple[str, str], str]:
    """By method and field: the name of the constant that it is."""
    found, traits, known = {}, "", {each.name for each in constants}
    for line in (RUNTIME / "methods" / "traits.h").read_text("utf-8").splitlines():
        if opened := re.match(r"#define MECHC_(\w+)_TRAITS\b", line):
            traits = opened[1]
        field = re.match(r"    \.(\w+) = (\w+)", line)
        if field is None:
            continue
        name = field[2] if field[2] in known else f"{traits}.{field[1]}"
        of = ("GAUSS8", "GAUSS8_LOCKSTEP") if traits == "COLLOCATION" else (traits,)
        found |= {(method, field[1]): name for method in of}
    return found


def write_factors(path: Path, count: int, place: int = 0, factor: float = 1.0) -> None:
    """All factors are 1 but that of the constant at ``place``, counted from 1."""
    factors = np.ones(count + 1)
    factors[place] = factor
    if path.exists():
        with path.open("r+b") as file:  # the same file: it is mapped
            file.write(factors.tobytes())
    else:
        path.write_bytes(factors.tobytes())


def compiler(folder: Path, name: str) -> str:
    """A command for ``CC`` that compiles with the headers, and little optimisation."""
    command = [*shlex.split(name), f"-I{folder}", "-include", str(folder / "prelude.h")]
    path = folder / "cc"
    path.write_text(f'#!/bin/sh\nexec {shlex.join(command)} "$@" -O1\n', "utf-8")
    path.chmod(0o755)
    return str(path)


def build_closing(folder: Path, build: Path) -> Path:
    """The runtime's closer of loops with the headers in ``folder``; its file."""
    flags = f"-I{folder} -include {folder / 'prelude.h'}"
    script = (
        "import runpy, setuptools, sys\n"
        "setup, sys.argv = setuptools.setup, ['setup.py', *sys.argv[1:]]\n"
        "def setup_of_one(**given):\n"
        f"    setup(**{{**given, 'ext_modules': [e for e in given['ext_modules'] "
        f"if e.name == {CLOSING!r}]}})\n"
        "setuptools.setup = setup_of_one\n"
        "runpy.run_path('setup.py')\n"
    )
    shutil.rmtree(build, ignore_errors=True)
    command = [sys.executable, "-c", script, "-q", "build_ext", "--build-lib", str(build),
               "--build-temp", str(build / "temp")]  # fmt: skip
    subprocess.run(command, cwd=HOME.parent, env={**os.environ, "CFLAGS": flags}, check=True)
    (found,) = build.rglob("_closing*.so")
    return found
