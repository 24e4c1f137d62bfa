"""What the compiler emits for the four-bar does not change unnoticed.

Written anew by ``pytest tests/golden --update-golden``; read the difference before committing it.
"""

from __future__ import annotations

import difflib
from functools import cache
from pathlib import Path

import pytest
import sympy
from mechc_codegen import Build, build_scene, shipped_mechanism

GOLDEN = Path(__file__).parent / "four_bar"
FILES = {"scene_program.h": "scene_program.txt", "scene_sizes.h": "scene_sizes.txt"}
MADE_WITH = GOLDEN / "sympy_version.txt"


def sympy_series() -> str:
    """Which SymPy orders terms and subexpressions: 1.14.0 -> 1.14."""
    return ".".join(sympy.__version__.split(".")[:2])


@cache
def built() -> Build:
    return build_scene(shipped_mechanism("four_bar"))


@pytest.mark.parametrize("name", FILES)
def test_emitted_text_is_the_golden_one(name: str, request: pytest.FixtureRequest) -> None:
    path, text = GOLDEN / FILES[name], built().texts[name]
    if request.config.getoption("--update-golden"):
        GOLDEN.mkdir(exist_ok=True)
        path.write_text(text, "utf-8")
        MADE_WITH.write_text(sympy_series() + "\n", "utf-8")
    golden = path.read_text("utf-8")
    made_with = MADE_WITH.read_text("utf-8").strip()
    if text != golden and made_with != sympy_series():
        pytest.skip(f"the golden files are of SymPy {made_with}, which orders terms otherwise")
    difference = "\n".join(
        difflib.unified_diff(golden.splitlines(), text.splitlines(), "golden", "emitted", "", "", 1)
    )
    assert not difference, f"{difference}\nif this is meant: pytest tests/golden --update-golden"
