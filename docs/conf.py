"""The documentation site.

`python -m sphinx -W docs build/site` builds it: the pages here, the reference from the docstrings,
and the gallery by running the scripts of `examples/gallery`.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path

import mechc

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE / "extensions"))

SECTIONS = ("library", "linkages", "robots", "rolling", "contact", "driven")


def repository() -> str | None:
    """The page of the repository that this clone came from, if it came from the web."""
    if not shutil.which("git"):
        return None
    command = ["git", "remote", "get-url", "origin"]
    told = subprocess.run(command, cwd=HERE, capture_output=True, text=True, check=False).stdout
    found = re.fullmatch(r"(?:https://|git@)([\w.-]+)[:/]([\w./-]+?)(?:\.git)?/?", told.strip())
    return f"https://{found[1]}/{found[2]}" if found else None


project = "mechc"
author = "the mechc developers"
copyright = f"{author}, BSD-3-Clause"
version = release = mechc.__version__

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx.ext.viewcode",
    "sphinx_copybutton",
    "math_in_pages",
    "sphinx_gallery.gen_gallery",
    "shown",
]
exclude_patterns = ["extensions"]
source_suffix = {".md": "markdown", ".rst": "restructuredtext"}
myst_enable_extensions = ["dollarmath", "deflist"]
myst_heading_anchors = 3

default_role = "code"  # as in the docstrings: `y`
autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_typehints_format = "short"
suppress_warnings = ["ref.python"]  # attributes of several classes are named q or t
napoleon_google_docstring = False

sphinx_gallery_conf = {
    "examples_dirs": str(HERE.parent / "examples" / "gallery"),
    "gallery_dirs": "gallery",
    "subsection_order": [f"../examples/gallery/{each}" for each in SECTIONS],
    "nested_sections": False,
    "filename_pattern": r"\.py$",
    "image_scrapers": ("moving_pictures.scrape",),
    "capture_repr": ("_repr_html_",),
    "abort_on_example_error": True,
    "download_all_examples": False,
    "show_signature": False,
    "min_reported_time": 3600,
    "remove_config_comments": True,
}

html_theme = "furo"
html_copy_source = False  # 40 MB, for the gallery's views are in its sources
html_math_renderer = "mathml"
html_title = "mechc"
html_favicon = "_static/favicon.svg"
html_static_path = ["_static"]
html_css_files = ["pages.css"]
html_theme_options = {"light_css_variables": {"color-brand-primary": "#1f6feb"}}
if home := repository():
    html_theme_options["footer_icons"] = [
        {"name": name, "url": url, "html": name, "class": ""}
        for name, url in (("Source", home), ("Issues", f"{home}/issues"))
    ]
