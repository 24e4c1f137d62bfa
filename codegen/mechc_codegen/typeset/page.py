"""A mechanism's derivation as one HTML page or as a LaTeX document.

Input: a :class:`Derivation` with parameter values.  Output: text.  Invariant: both documents print
the same formulas, tables and sentences; templates escape all that is not markup.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

from mechc_codegen.typeset.equations import equation_groups
from mechc_codegen.typeset.formula import Formula, latex, latex_text, mathml, visible
from mechc_codegen.typeset.sections import Derivation, Item, Section, derivation
from mechc_codegen.typeset.tables import all_values, notes, value_tables

__all__ = ["Derivation", "Item", "Section", "derivation", "html_page", "latex_document"]

_COMMON: dict[str, Any] = {
    "loader": FileSystemLoader(Path(__file__).parent / "templates"),
    "undefined": StrictUndefined,
    "trim_blocks": True,
    "lstrip_blocks": True,
    "keep_trailing_newline": True,
}
_HTML = Environment(
    **_COMMON,
    autoescape=True, finalize=lambda value: value if _is_markup(value) else visible(str(value)),
)  # fmt: skip
_HTML.filters["mathml"] = lambda formula: Markup(mathml(formula))
_LATEX = Environment(
    **_COMMON,
    block_start_string="<%", block_end_string="%>",
    variable_start_string="<<", variable_end_string=">>",
    finalize=lambda value: value if _is_markup(value) else latex_text(str(value)),
)  # fmt: skip
_LATEX.filters["latex"] = lambda formula: Markup(latex(formula))


for _environment in (_HTML, _LATEX):
    _environment.tests["formula"] = lambda cell: isinstance(cell, Formula)


def _is_markup(value: Any) -> bool:
    return isinstance(value, Markup)


def html_page(derivation: Derivation, values: Mapping[str, float] | None = None) -> str:
    """One self-contained HTML page: MathML, no script, nothing loaded from elsewhere.

    Parameters
    ----------
    values
        Parameter values (SI units) by printed name, for the table and the notes; defaults of
        the mechanism by default.
    """
    parts = _parts(derivation, values, lambda matrix: bool(matrix.cols == 1))
    return _HTML.get_template("derivation.html").render(parts)


def latex_document(derivation: Derivation, values: Mapping[str, float] | None = None) -> str:
    """A complete LaTeX article, with amsmath as the only package; ``values`` as above."""
    return _LATEX.get_template("derivation.tex").render(_parts(derivation, values, lambda _: True))


def _parts(derivation: Derivation, given: Mapping[str, float] | None, splits: Any) -> Any:
    """The data of the templates."""
    mechanism = derivation.mechanism
    values = all_values(mechanism, given)
    tables, remarks = value_tables(mechanism, values), notes(mechanism, values)
    own = [section.title for section in derivation.sections]
    return {
        "title": mechanism.title,
        "titles": ["Scene", *["Symbols"] * bool(tables), *own, *["Notes"] * bool(remarks)],
        "scene": derivation.scene,
        "tables": tables,
        "sections": [
            (section.title, section.sentence, equation_groups(section.items, splits))
            for section in derivation.sections
        ],
        "notes": remarks,
    }
