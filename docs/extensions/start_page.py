"""The moving four-bars of the start page: one that the page simulates, one that was simulated."""

from __future__ import annotations

import html
import tempfile
from typing import Any

import numpy as np
from docutils import nodes
from docutils.parsers.rst import Directive

import mechc
from mechc.compilation.toolchain import packaged_compiler

REGULAR = {"l_3": 3.5}  # the links come in line nowhere
SLIDERS = {
    "l_0": (0.5, 1.2), "l_1": (1.8, 3.0), "l_2": (2.5, 3.5), "l_3": (3.3, 3.9), "g": (0.0, 20.0),
    "theta_0": (0.5, 2.6),
}  # fmt: skip


class LiveFourBar(Directive):
    """The regular four-bar, simulated by the page; nothing without the compiler of WebAssembly."""

    def run(self) -> list[nodes.Node]:
        if packaged_compiler() is None:
            return []
        y0 = mechc.load("four_bar").assemble({"theta_0": np.radians(60)}, params=REGULAR)
        with tempfile.TemporaryDirectory() as folder:
            page = mechc.export_wasm("four_bar", folder, y0=y0, params=REGULAR, sliders=SLIDERS)[2]
            text = page.read_text("utf-8")
        frame = (
            '<iframe sandbox="allow-scripts" title="A four-bar that this page simulates" '
            f'width="100%" height="640" style="border:0" srcdoc="{html.escape(text)}"></iframe>'
        )
        told = "This page simulates it while you look: move a slider, and it starts anew."
        return [nodes.raw("", frame, format="html"), nodes.paragraph("", told)]


class StartPageAnimation(Directive):
    """The animation of the four-bar through its change points."""

    def run(self) -> list[nodes.Node]:
        model = mechc.load("four_bar")
        sol = model.simulate(8, model.assemble({"theta_0": np.radians(85)}))
        return [nodes.raw("", sol.animate()._repr_html_(), format="html")]


def setup(app: Any) -> dict[str, Any]:
    app.add_directive("live-four-bar", LiveFourBar)
    app.add_directive("start-page-animation", StartPageAnimation)
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}
