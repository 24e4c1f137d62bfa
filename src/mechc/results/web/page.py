"""The module around a mechanism's WebAssembly, and the page that simulates with it.

Input: the WebAssembly, and what is told of it.  Output: texts.  Invariant: both load nothing from
elsewhere; user text is in them only as escaped JSON and an escaped title; the page's policy names
its script and its style by their hashes.
"""

from __future__ import annotations

import base64
from collections.abc import Mapping
from importlib import resources
from string import Template
from typing import Any, Final

from mechc.results.animation import attribute_text, content_hash, json_for_script, page_style
from mechc.results.sampling import clean_text, pretty_name

MOST_LETTERS: Final = 100


def module_text(wasm: bytes, about: Mapping[str, Any]) -> str:
    """The ES module: a class around the WebAssembly, which is in it as base64."""
    encoded = base64.b64encode(wasm).decode("ascii")
    kinds = ("coordinates", "speeds", "parameters")
    names = [*(each["name"] for kind in kinds for each in about[kind]), *about["inputs"]]
    about = {**about, "labels": {name: pretty_name(name) for name in names}}
    return Template(_template("module.js")).substitute(about=json_for_script(about), wasm=encoded)


def live_page(module: str, title: str) -> str:
    """A page that simulates with a module while it plays, with a slider for each of its values."""
    script, style = module + _template("page.js"), page_style() + _template("page.css")
    return Template(_template("page.html")).substitute(
        title=attribute_text(clean_text(title, MOST_LETTERS)),
        style=style,
        style_hash=content_hash(style),
        script=script,
        script_hash=content_hash(script),
    )


def _template(name: str) -> str:
    return resources.files("mechc.results.web").joinpath("templates", name).read_text("utf-8")
