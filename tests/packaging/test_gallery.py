"""The scripts of the gallery run as they stand, and what they assert of their motions holds."""

import re
import runpy

import pytest

from mechc.results.solution import Solution
from tests.support import ROOT

GALLERY = ROOT / "examples" / "gallery"
# A minute each; what they ask is asked of smaller ones too, and the site draws them.
LONGEST = ("linkages/dwell.py", "robots/delta.py", "robots/hexapod_6rss.py", "robots/leg.py")
SCRIPTS = sorted(path.relative_to(GALLERY).as_posix() for path in GALLERY.rglob("*.py"))


@pytest.mark.slow(cases=len(SCRIPTS))
@pytest.mark.parametrize(
    "script",
    [
        pytest.param(script, marks=pytest.mark.thorough) if script in LONGEST else script
        for script in SCRIPTS
    ],
)
def test_what_it_asserts_holds(script, monkeypatch):
    """Of the picture at its end only that it is asked for: the site draws it."""
    drawn = []
    for picture in ("animate", "view"):
        monkeypatch.setattr(Solution, picture, lambda sol, **_: drawn.append(sol))
    path = GALLERY / script
    assert re.search(r"^\s*assert ", path.read_text("utf-8"), re.M)
    monkeypatch.chdir(path.parent)
    runpy.run_path(str(path), run_name="__main__")
    assert drawn
