"""The documentation site builds without a warning, and with it every scene of the gallery runs."""

import os
import re
import shutil
import subprocess
import sys

import pytest

from mechc.compilation.toolchain import packaged_compiler
from tests.support import ROOT
from tests.support.compilers.compilation import compiler_at

pytestmark = pytest.mark.thorough


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """The built site, its scenes compiled with less optimisation; nothing is put into the tree."""
    pytest.importorskip("sphinx", reason="the site is built with mechc[docs]")
    root = tmp_path_factory.mktemp("site")
    ignored = shutil.ignore_patterns("__pycache__", "generated")
    shutil.copytree(ROOT / "docs", root / "docs", ignore=ignored)
    shutil.copytree(ROOT / "examples", root / "examples", ignore=ignored)
    shutil.copy(ROOT / "README.md", root)  # of which the start page has parts
    command = [sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", "docs", "built"]
    environment = {**os.environ, "CC": compiler_at("-O1", root)}
    run = subprocess.run(command, cwd=root, env=environment, capture_output=True, text=True)
    assert run.returncode == 0, run.stderr[-4000:]
    return root / "built"


def test_every_scene_has_a_moving_picture_and_an_animation(site):
    gallery = ROOT / "examples" / "gallery"
    scenes = sorted(path.relative_to(gallery) for path in gallery.rglob("*.py"))
    assert len(scenes) >= 24
    index = (site / "gallery" / "index.html").read_text("utf-8")
    for scene in scenes:
        assert f"sphx_glr_{scene.stem}_thumb.gif" in index
        page = (site / "gallery" / scene.with_suffix(".html")).read_text("utf-8")
        assert 'sandbox="allow-scripts"' in page


def test_links_between_pages_lead_somewhere(site):
    lost = []
    for page in site.rglob("*.html"):
        for target in re.findall(r'href="([^"#:?]+)(?:#[^"]*)?"', page.read_text("utf-8")):
            if not target.startswith("//") and not (page.parent / target).exists():
                lost.append((page.name, target))
    assert lost == []


def test_pages_show_what_their_code_makes(site):
    kinds = {"<svg": 0, 'sandbox="allow-scripts"': 0}
    for page in (ROOT / "docs").rglob("*.md"):
        asked = page.read_text("utf-8").count("```{shown}\n:")
        built = (site / page.relative_to(ROOT / "docs").with_suffix(".html")).read_text("utf-8")
        parts = built.split('<div class="shown">')[1:]
        assert len(parts) == asked - (page.stem == "index" and packaged_compiler() is None)
        for part in parts:
            kinds[next(kind for kind in kinds if kind in part[:200])] += 1
    assert all(kinds.values())


def test_the_start_page_moves_and_loads_nothing_from_elsewhere(site):
    page = (site / "index.html").read_text("utf-8")
    assert 'sandbox="allow-scripts"' in page
    assert re.findall(r'<script[^>]+src="https?:', page) == []


def test_the_start_page_simulates_where_the_compiler_was_there(site):
    if packaged_compiler() is None:
        pytest.skip("the package ziglang is not installed")
    page = (site / "index.html").read_text("utf-8")
    assert "WebAssembly.instantiate" in page
    assert "wasm-unsafe-eval" in page
