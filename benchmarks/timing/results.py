"""The folder of figures: JSON files, one per script."""

from __future__ import annotations

import argparse
import json
import math
import os
from pathlib import Path
from typing import Any

HOME = Path(__file__).resolve().parents[1]  # of the benchmarks
A_CLONE = (HOME.parent / "pyproject.toml").exists()  # or installed
FOLDER_VARIABLE = "MECHC_BENCH_OUT"  # in the environment of the scripts that the suite starts


def folder() -> Path:
    """The suite's; else ``benchmarks/out`` in a clone, ``./mechc_bench`` of an installed mechc."""
    default = HOME / "out" if A_CLONE else Path.cwd() / "mechc_bench"
    return Path(os.environ.get(FOLDER_VARIABLE) or default)


def write(name: str, data: Any, out: Path | None = None) -> None:
    """``NAME.json`` in the folder; numbers that are not finite become null.

    The file is complete or absent: an interrupted run leaves the one before.
    """
    out = folder() if out is None else out
    out.mkdir(parents=True, exist_ok=True)
    text = json.dumps(finite(data), indent=1, allow_nan=False)
    unfinished = out / f"{name}.json.unfinished"
    unfinished.write_text(text + "\n", "utf-8")
    unfinished.replace(out / f"{name}.json")


def read(path: Path) -> Any:
    """The contents of a file of figures.

    Raises
    ------
    ValueError, OSError
        If it is none, or cannot be read.
    """
    try:
        found = json.loads(path.read_text("utf-8"))
    except (ValueError, RecursionError) as error:
        raise ValueError(f"{path} is no JSON file: {error}") from None
    if not isinstance(found, dict | list):
        raise ValueError(f"{path} holds no figures")
    return found


def command_parser(name: str, documentation: str | None) -> argparse.ArgumentParser:
    """The parser of ``mechc bench NAME``; its help is the documentation of the module."""
    return argparse.ArgumentParser(
        prog=f"mechc bench {name}", description=documentation,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip


def read_option(parser: argparse.ArgumentParser, path: Path | None) -> Any:
    """The contents of the file of an option, None without; a parser error if it is wrong."""
    if path is None:
        return None
    try:
        return read(path)
    except (OSError, ValueError) as error:
        return parser.error(str(error))


def finite(data: Any) -> Any:
    """The same data as JSON has it: plain numbers, and None for infinities and NaN."""
    if isinstance(data, dict):
        return {str(key): finite(value) for key, value in data.items()}
    if isinstance(data, (list, tuple)):
        return [finite(value) for value in data]
    if hasattr(data, "tolist"):  # NumPy's arrays and numbers
        return finite(data.tolist())
    return None if isinstance(data, float) and not math.isfinite(data) else data
