"""Where figures go: a folder of JSON files, each valid JSON, one a script."""

from __future__ import annotations

import json
import math
import os
from pathlib import Path
from typing import Any

FOLDER = Path(__file__).resolve().parent
A_CLONE = (FOLDER.parent / "pyproject.toml").exists()  # or installed
SET_BY_THE_SUITE = "MECHC_BENCH_OUT"  # in the environment of the scripts that it starts


def default_folder() -> Path:
    """``benchmarks/out`` in a clone, ``mechc_bench`` where one is when mechc is installed."""
    return FOLDER / "out" if A_CLONE else Path.cwd() / "mechc_bench"


OUT = Path(os.environ.get(SET_BY_THE_SUITE) or default_folder())


def write(name: str, data: Any, out: Path | None = None) -> None:
    """``NAME.json`` in the folder; numbers that are not finite become null.

    The file is there whole or not at all: an interrupted run leaves the one before.
    """
    out = OUT if out is None else out
    out.mkdir(parents=True, exist_ok=True)
    text = json.dumps(finite(data), indent=1, allow_nan=False)
    unfinished = out / f"{name}.json.unfinished"
    unfinished.write_text(text + "\n", "utf-8")
    unfinished.replace(out / f"{name}.json")


def finite(data: Any) -> Any:
    """The same data as JSON has it: plain numbers, and None for infinities and NaN."""
    if isinstance(data, dict):
        return {str(key): finite(value) for key, value in data.items()}
    if isinstance(data, (list, tuple)):
        return [finite(value) for value in data]
    if hasattr(data, "tolist"):  # NumPy's arrays and numbers
        return finite(data.tolist())
    return None if isinstance(data, float) and not math.isfinite(data) else data
