"""The moving four-bar of the start page, simulated when the site is built."""

from __future__ import annotations

from typing import Any

import numpy as np
from docutils import nodes
from docutils.parsers.rst import Directive

import mechc


class StartPageAnimation(Directive):
    """The animation of the four-bar through its change points."""

    def run(self) -> list[nodes.Node]:
        model = mechc.load("four_bar")
        sol = model.simulate(8, model.assemble({"theta_0": np.radians(85)}))
        return [nodes.raw("", sol.animate()._repr_html_(), format="html")]


def setup(app: Any) -> dict[str, Any]:
    app.add_directive("start-page-animation", StartPageAnimation)
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}
