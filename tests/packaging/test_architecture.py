"""The map leads to places that exist."""

import re

import pytest

from tests.support import ROOT

PAGE = (ROOT / "docs" / "architecture.md").read_text("utf-8")
ROOTS = [ROOT, *(ROOT / p for p in ("codegen/mechc_codegen", "src/mechc"))]
FOLDERS = [*ROOTS, ROOT / "codegen/mechc_codegen/runtime"]


def _exists(path):
    return any((root / path).exists() for root in FOLDERS)


@pytest.mark.parametrize("path", sorted(set(re.findall(r"`([\w/]+/(?:[\w.]*))`", PAGE))))
def test_a_path_on_the_map_exists(path):
    assert _exists(path)


def test_places_that_answer_a_question_define_what_they_are_said_to():
    rows = re.findall(r"^\|[^|]*\| `([\w/.]+)`: `(\w+)`(.*)\|$", PAGE, re.M)
    assert len(rows) >= 3
    for path, function, others in rows:
        text = next(root / path for root in FOLDERS if (root / path).exists()).read_text("utf-8")
        for name in (function, *re.findall(r"^(?:, `(\w+)`)", others)):
            assert re.search(rf"\b{name}\(", text), f"{path} has no {name}"


def test_every_folder_of_the_sources_is_on_the_map():
    for root in ROOTS[1:]:
        for folder in sorted(
            p for p in root.iterdir() if p.is_dir() and not p.name.startswith("_")
        ):
            assert f"`{folder.name}/`" in PAGE, folder
