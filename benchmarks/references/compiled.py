"""C beside a module, compiled at its first use."""

from __future__ import annotations

import ctypes
import subprocess
import tempfile
from functools import cache
from pathlib import Path
from typing import Any

from mechc.compilation.toolchain import compiler

from ..problems.problem import Array


@cache
def library(module: str) -> Any:
    """The functions of the C file named as the module (its ``__file__``)."""
    source = Path(module).with_suffix(".c")
    target = Path(tempfile.mkdtemp()) / f"{source.stem}.so"
    command = [*compiler(), "-O3", "-shared", "-fPIC", "-o", str(target), str(source), "-lm"]
    subprocess.run(command, check=True)
    return ctypes.CDLL(str(target))


def pointer(a: Array) -> Any:
    """To the numbers of a contiguous array of float64."""
    return a.ctypes.data_as(ctypes.POINTER(ctypes.c_double))
