"""The examples of the guide run as they stand, page by page."""

import re

import pytest

from tests.support import ROOT

DOCS = ROOT / "docs"
PAGES = (
    "differentiable.md",
    "fitting.md",
    "hybrid.md",
    "inputs.md",
    "library.md",
    "mechanism.md",
    "outputs.md",
    "positions.md",
)  # whose examples are whole programs


@pytest.mark.slow
@pytest.mark.parametrize("page", PAGES)
def test_the_examples_of_a_page_run(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = (DOCS / page).read_text("utf-8")
    names = {}
    for block in re.findall(r"^```python\n(.*?)^```", text, re.S | re.M):
        exec(compile(block, page, "exec"), names)
    assert names
