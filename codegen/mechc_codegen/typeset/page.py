"""A mechanism's derivation as one HTML page or as a LaTeX document.

Input: a :class:`Derivation` with parameter values.  Output: text.  Invariant: both documents print
the same formulas, tables and sentences; templates escape all that is not markup; no term is lost
where a line is broken or a matrix is split into its entries.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from itertools import groupby
from pathlib import Path
from typing import Any, NamedTuple

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup
from sympy import MatrixBase

from mechc_codegen.typeset.formula import (
    Formula,
    formula,
    latex,
    latex_text,
    mathml,
    sum_of,
    terms,
    visible,
    width,
)
from mechc_codegen.typeset.sections import Derivation, Item, Section, derivation
from mechc_codegen.typeset.tables import all_values, value_tables

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
    tables = value_tables(mechanism, values)
    remarks = mechanism.notes(values) if mechanism.notes else []
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


# -- equations in lines that fit on a page, grouped by their labels -------------------------------

LINE = 84  # characters, roughly


class Equation(NamedTuple):
    """An equation: ``left`` equals the sum of the ``lines``."""

    left: Formula
    lines: list[Formula]


def equation_groups(
    items: tuple[Item, ...], splits: Callable[[Any], bool]
) -> list[tuple[str, list[Equation]]]:
    """Label and equations of each group; ``splits``: which wide matrices go entry by entry."""
    fitted = [part for item in items for part in _whole_or_entries(item, splits)]
    groups = groupby(fitted, key=lambda item: item.label)
    return [
        (label, [Equation(item.left, _lines(item)) for item in group]) for label, group in groups
    ]


def _lines(item: Item) -> list[Formula]:
    """The right-hand side, in several lines if it is a long sum."""
    room = LINE - width(item.left)
    lines: list[list[str]] = [[]]
    for term in terms(item.right):
        if lines[-1] and sum(map(width, lines[-1])) + width(term) > room:
            lines.append([])
        lines[-1].append(term)
    return [sum_of(lines[0]), *(Formula(" ".join(line)) for line in lines[1:])]


def _whole_or_entries(item: Item, splits: Callable[[Any], bool]) -> list[Item]:
    """The item, or its entries where it is a matrix wider than a line that may be split."""
    if not (isinstance(item.right, MatrixBase) and splits(item.right)):
        return [item]
    columns = [
        [width(formula(entry)) for entry in item.right[:, k]] for k in range(item.right.cols)
    ]
    return _elements(item) if sum(map(max, columns)) + width(item.left) > LINE else [item]


def _elements(item: Item) -> list[Item]:
    """The entries of a matrix as equations of their own, once each if it is symmetric."""
    matrix = item.right
    symmetric = matrix.rows == matrix.cols > 1 and matrix == matrix.T
    return [
        Item(Formula(f"{item.left}_{{{place}}}"), matrix[row, column], item.label)
        for row in range(matrix.rows)
        for column in range(row if symmetric else 0, matrix.cols)
        for place in [f"{row + 1}" if matrix.cols == 1 else f"{row + 1},{column + 1}"]
    ]
