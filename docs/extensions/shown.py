"""Values of code in a page: a figure, an animation, a view, a page that simulates.

The directive `shown` runs the Python blocks of its page up to its place, then its own lines, whose
names do not reach later blocks, and puts the value of the last of them into the page: what displays
itself in a notebook (`_repr_html_`) as it does there, a figure of matplotlib as SVG, the path of a
page as that page.  With `alone` the blocks of the page are not run: they are no whole program.
Nothing is shown where the package that it `needs` is missing.
"""

from __future__ import annotations

import ast
import contextlib
import html
import io
import re
import tempfile
from importlib.util import find_spec
from pathlib import Path
from typing import Any, ClassVar

import matplotlib
from docutils import nodes
from docutils.parsers.rst import directives
from matplotlib.figure import Figure
from sphinx.util.docutils import SphinxDirective

BLOCK = re.compile(r"^```python\n(.*?)^```", re.S | re.M)


class Shown(SphinxDirective):
    """The value of code in a page."""

    has_content = True
    option_spec: ClassVar = {
        "alone": directives.flag,
        "height": directives.nonnegative_int,
        "caption": directives.unchanged,
        "needs": directives.unchanged,
    }

    def run(self) -> list[nodes.Node]:
        if find_spec(self.options.get("needs", "mechc")) is None:
            return []
        code = "\n".join(self.content)
        shown = evaluate(code, dict(self._names()))
        if "height" in self.options:
            shown = re.sub(r'height="\d+"', f'height="{self.options["height"]}"', shown, count=1)
        found: list[nodes.Node] = [
            nodes.raw("", f'<div class="shown">{shown}</div>', format="html")
        ]
        if "caption" in self.options:
            words, _ = self.parse_inline(self.options["caption"])
            found.append(nodes.paragraph("", "", *words, classes=["caption"]))
        return found

    def _names(self) -> dict[str, Any]:
        """The names that the blocks of the page before this one have made."""
        if "alone" in self.options:
            return {}
        known = self.env.temp_data.setdefault("names of the page", {})
        text = Path(self.env.doc2path(self.env.docname)).read_text("utf-8")
        blocks = list(BLOCK.finditer(text))
        lines = [text.count("\n", 0, block.start()) for block in blocks]
        done = self.env.temp_data.get("blocks that were run", 0)
        here = sum(line < self.lineno for line in lines)
        for block in blocks[done:here]:
            evaluate(f"{block[1]}\nNone", known)  # whose last value is not shown
        self.env.temp_data["blocks that were run"] = here
        return known


def evaluate(code: str, names: dict[str, Any]) -> str:
    """Run the code in an empty folder, in silence; its last line's value as a part of a page."""
    body = ast.parse(code).body
    last = body.pop() if isinstance(body[-1], ast.Expr) else None
    silent = contextlib.redirect_stdout(io.StringIO())
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder), silent:
        exec(compile(ast.Module(body, []), "page", "exec"), names)
        if last is None:
            return ""
        return as_html(eval(compile(ast.Expression(last.value), "page", "eval"), names))


def as_html(value: Any) -> str:
    """What displays itself in a notebook, a figure, or the path of a page of its own."""
    if isinstance(value, Path):
        text = html.escape(value.read_text("utf-8"))
        return (
            '<iframe sandbox="allow-scripts" title="A mechanism that this page simulates" '
            f'width="100%" height="640" style="border:0" srcdoc="{text}"></iframe>'
        )
    if not isinstance(value, Figure):
        return str(value._repr_html_()) if hasattr(value, "_repr_html_") else ""
    drawn = io.StringIO()
    with matplotlib.rc_context({"svg.hashsalt": "mechc"}):
        value.savefig(drawn, format="svg", metadata={"Date": None}, bbox_inches="tight")
    return drawn.getvalue()[drawn.getvalue().index("<svg") :]


def setup(app: Any) -> dict[str, Any]:
    app.add_directive("shown", Shown)
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}
