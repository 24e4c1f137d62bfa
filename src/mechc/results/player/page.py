"""A page that plays a motion: one document, one style, one set of scripts, and its data.

Input: data for JSON, the scripts that draw them.  Output: HTML text.
Invariant: the page loads nothing from elsewhere; its policy names its scripts and its style by
their hashes, so that nothing else runs; user text is in it only as escaped JSON, which the scripts
show as text, and an escaped title.
"""

from __future__ import annotations

import base64
import hashlib
import html
import json
from collections.abc import Iterable, Mapping
from functools import cached_property
from importlib import resources
from pathlib import Path
from string import Template
from typing import Any, Final

import numpy as np

from mechc.system.parameters import Array

PLAYER: Final = ("controls", "data", "forces", "theme", "player", "plots", "panel")
START: Final = "main"


class Page:
    """A page with a motion; a notebook displays it.

    Attributes
    ----------
    data
        What the page's script reads.
    """

    def __init__(self, data: Mapping[str, Any]) -> None:
        self.data = dict(data)

    def page(self, data: Mapping[str, Any]) -> str:
        """The page of such data."""
        raise NotImplementedError

    @cached_property
    def html(self) -> str:
        """The page; with ``#t=1.5`` after its address it opens at that time."""
        return self.page(self.data)

    def __repr__(self) -> str:
        kind = type(self).__name__.lower()
        return f"<mechc {kind}, {len(self.html) / 1024:.0f} KiB of HTML: save(path) writes it>"

    def _write(self, target: Path) -> Path:
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_text(self.html, encoding="utf-8", newline="\n")
        return target

    def _repr_html_(self) -> str:
        # Sandboxed: the page needs scripts, but no access to the notebook around it.
        return (
            f'<iframe sandbox="allow-scripts" allow="fullscreen" title="{type(self).__name__}" '
            'width="100%" height="640" style="border:0" '
            f'srcdoc="{html.escape(self.html, quote=True)}"></iframe>'
        )


def player_page(
    data: Mapping[str, Any], scripts: Iterable[str], *, library: str = "", source: str = ""
) -> str:
    """The page of a motion: its data, with a title, and the texts of the scripts that draw it.

    ``library``: the text of a script that they need; ``source``: what else the policy lets run.
    """
    style = template("player", "page.css") + template("player", "sliders.css")
    parts = [*(template("player", f"{name}.js") for name in PLAYER), *scripts]
    script = "\n".join([*parts, template("player", f"{START}.js")])
    hashes = [f"'{content_hash(text)}'" for text in (library, script) if text]
    title = html.escape(data["title"], quote=True)  # safe in a title or an attribute, ASCII only
    return Template(template("player", "page.html")).substitute(
        title=title.encode("ascii", "xmlcharrefreplace").decode("ascii"),
        style=style,
        style_hash=content_hash(style),
        script_sources=" ".join([*hashes, source]).strip(),
        library=f"<script>{library}</script>\n" if library else "",
        script=script,
        motion=json_for_script(data),
    )


def template(folder: str, name: str) -> str:
    """The text of a file of the pages."""
    return resources.files(f"mechc.results.{folder}").joinpath("templates", name).read_text("utf-8")


# --- data and escaping -----------------------------------------------------------------------


def base64_floats(values: Array) -> str:
    """Numbers for the scripts: base64 of their values in single precision, little-endian."""
    return base64.b64encode(np.ascontiguousarray(values, dtype="<f4").tobytes()).decode("ascii")


def json_for_script(value: Any) -> str:
    """JSON that is safe inside <script>: no markup character and nothing beyond ASCII."""
    text = json.dumps(value, ensure_ascii=True, allow_nan=False, separators=(",", ":"))
    for character in "<>&":
        text = text.replace(character, f"\\u{ord(character):04x}")
    return text


def content_hash(text: str) -> str:
    """A script or style as a content policy names it."""
    digest = hashlib.sha256(text.encode("utf-8")).digest()
    return "sha256-" + base64.b64encode(digest).decode("ascii")
