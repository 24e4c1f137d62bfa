"""The package's face for reading: a mechanism's derivation as one HTML page or as LaTeX.

Input: a :class:`Mechanism`, then its :class:`Derivation` with parameter values.  Output: text.
Invariant: both documents print the same boxes, tables and sentences; names are escaped for each.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from itertools import groupby
from pathlib import Path
from string import Template
from typing import Any

from sympy import MatrixBase

from mechc_codegen.typeset.boxes import (
    Box,
    Row,
    Scripts,
    Term,
    Word,
    layout,
    signed_row,
    terms,
    width,
)
from mechc_codegen.typeset.markup import html_text, latex, latex_text, mathml
from mechc_codegen.typeset.sections import Derivation, Item, Section, derivation
from mechc_codegen.typeset.tables import Cell, ValueTable, all_values, notes, value_tables

__all__ = ["Derivation", "Item", "Section", "derivation", "html_page", "latex_document"]

TEMPLATES = Path(__file__).parent / "templates"
LINE = 84.0
_EQUALS = Word("=", "operator")


def html_page(derivation: Derivation, values: Mapping[str, float] | None = None) -> str:
    """One self-contained HTML page: MathML, no script, nothing fetched from anywhere.

    Parameters
    ----------
    values
        Parameter values (SI units) by printed name, for the table and the notes; defaults of
        the mechanism if left out.
    """
    mechanism = derivation.mechanism
    known = all_values(mechanism, values)
    parts = [
        ("Scene", "".join(f"<p>{html_text(s)}</p>" for s in derivation.scene)),
        ("Symbols", "".join(map(_html_table, value_tables(mechanism, known)))),
        *((s.title, _html_section(s)) for s in derivation.sections),
        ("Notes", _html_notes(notes(mechanism, known))),
    ]
    numbered = [(k, *part) for k, part in enumerate(parts, 1) if part[1]]
    entry = '<li><a href="#s{0}">{1}</a></li>'
    body = '<section id="s{0}"><h2>{1}</h2>{2}</section>'
    return _template("derivation.html").substitute(
        title=html_text(mechanism.title),
        contents="".join(entry.format(k, html_text(title)) for k, title, _ in numbered),
        sections="\n".join(body.format(k, html_text(title), text) for k, title, text in numbered),
    )


def latex_document(derivation: Derivation, values: Mapping[str, float] | None = None) -> str:
    """A LaTeX article of its own, with amsmath as the only package; ``values`` as above."""
    mechanism = derivation.mechanism
    known = all_values(mechanism, values)
    parts = [
        ("Scene", "\n\n".join(map(latex_text, derivation.scene))),
        ("Symbols", "\n".join(map(_latex_table, value_tables(mechanism, known)))),
        *((s.title, _latex_section(s)) for s in derivation.sections),
        ("Notes", _latex_notes(notes(mechanism, known))),
    ]
    sections = [f"\\section{{{latex_text(title)}}}\n{text}" for title, text in parts if text]
    return _template("derivation.tex").substitute(
        title=latex_text(mechanism.title), sections="\n\n".join(sections)
    )


def _template(file: str) -> Template:
    return Template((TEMPLATES / file).read_text(encoding="utf-8"))


# Equations, line by line.


def _lines(item: Item) -> tuple[Box, list[Box]]:
    """Left-hand side and the lines of the right-hand side; long sums go over several."""
    left, parts = layout(item.left), terms(item.right)
    vanishes = item.right == 0 and len(terms(item.left)) > 1
    if vanishes:
        return Word("0", "number"), _broken(terms(item.left), LINE)
    return left, _broken(parts, LINE - width(left))


def _broken(parts: list[Term], room: float) -> list[Box]:
    lines: list[list[Term]] = [[]]
    used = 0.0
    for part in parts:
        wide = width(part[1]) + 2
        if lines[-1] and used + wide > room:
            lines.append([])
            used = 0.0
        lines[-1].append(part)
        used += wide
    return [signed_row(line, leading=k == 0) for k, line in enumerate(lines)]


def _elements(item: Item) -> list[Item]:
    """The entries of a matrix as equations of their own, once each if it is symmetric."""
    matrix, left = item.right, layout(item.left)
    symmetric = matrix.rows == matrix.cols > 1 and matrix == matrix.T
    return [
        Item(Scripts(left, sub=_index(matrix, row, column)), matrix[row, column], item.label)
        for row in range(matrix.rows)
        for column in range(row if symmetric else 0, matrix.cols)
    ]


def _index(matrix: Any, row: int, column: int) -> Box:
    numbers = [Word(str(row + 1), "number"), Word(",", "operator"), Word(str(column + 1), "number")]
    return numbers[0] if matrix.cols == 1 else Row(tuple(numbers))


def _fitted(items: tuple[Item, ...], apart: Callable[[Any], bool]) -> list[Item]:
    """``items`` with those matrices taken apart that are wider than a line."""
    found: list[Item] = []
    for item in items:
        matrix = isinstance(item.right, MatrixBase) and apart(item.right)
        wide = matrix and width(layout(item.right)) + width(layout(item.left)) > LINE
        found += _elements(item) if wide else [item]
    return found


# HTML.


def _html_section(section: Section) -> str:
    items = _fitted(section.items, lambda matrix: bool(matrix.cols == 1))
    groups = [
        _label(label, html_text) + "".join(map(_html_item, group))
        for label, group in groupby(items, key=lambda item: item.label)
    ]
    return f"<p>{html_text(section.sentence)}</p>{''.join(groups)}"


def _label(label: str, text: Callable[[str], str]) -> str:
    return f'<p class="label">{text(label)}</p>' if label else ""


def _html_item(item: Item) -> str:
    left, lines = _lines(item)
    rows = [
        f"<mtr><mtd>{mathml(left) + mathml(_EQUALS) if k == 0 else ''}</mtd>"
        f"<mtd>{mathml(line)}</mtd></mtr>"
        for k, line in enumerate(lines)
    ]
    table = f'<mtable class="lines" displaystyle="true">{"".join(rows)}</mtable>'
    return f'<div class="equation" tabindex="0">{_math(table, "block")}</div>\n'


def _math(inside: str, display: str) -> str:
    return f'<math xmlns="http://www.w3.org/1998/Math/MathML" display="{display}">{inside}</math>'


def _html_cell(cell: Cell) -> str:
    if isinstance(cell, str):
        return html_text(cell)
    return _math(f'<mstyle displaystyle="true">{mathml(cell)}</mstyle>', "inline")


def _html_table(table: ValueTable) -> str:
    head = "".join(f'<th scope="col">{word}</th>' for word in table.head)
    rows = [
        "<tr>" + "".join(f"<td>{_html_cell(cell)}</td>" for cell in row) + "</tr>"
        for row in table.rows
    ]
    return (
        f'<div class="table" tabindex="0"><table><caption>{table.title}</caption>'
        f"<thead><tr>{head}</tr></thead><tbody>{''.join(rows)}</tbody></table></div>"
    )


def _html_notes(notes: list[tuple[str, str]]) -> str:
    pairs = "".join(f"<dt>{html_text(k)}</dt><dd>{html_text(v)}</dd>" for k, v in notes)
    return f"<dl>{pairs}</dl>" if pairs else ""


# LaTeX.


def _latex_section(section: Section) -> str:
    items = _fitted(section.items, lambda matrix: True)
    groups = []
    for label, group in groupby(items, key=lambda item: item.label):
        title = f"\\noindent\\textit{{{latex_text(label)}}}\n" if label else ""
        lines = " \\\\\n".join(map(_latex_item, group))
        groups.append(f"{title}\\begin{{align*}}\n{lines}\n\\end{{align*}}")
    return "\n".join([latex_text(section.sentence), *groups])


def _latex_item(item: Item) -> str:
    left, lines = _lines(item)
    first, *others = map(latex, lines)
    return " \\\\\n".join([f"{latex(left)} &= {first}", *(f"&\\quad {o}" for o in others)])


def _latex_cell(cell: Cell) -> str:
    return latex_text(cell) if isinstance(cell, str) else f"\\({latex(cell)}\\)"


def _latex_table(table: ValueTable) -> str:
    rows = [" & ".join(map(_latex_cell, row)) + r" \\" for row in (table.head, *table.rows)]
    head, *body = rows
    lines = "\n".join([head, r"\hline", *body])
    columns = r"lp{0.36\textwidth}" + "l" * (len(table.head) - 2)
    return (
        f"\\paragraph{{{latex_text(table.title)}}}\\mbox{{}}\\\\[1ex]\n"
        f"\\begin{{tabular}}{{{columns}}}\n{lines}\n\\end{{tabular}}\n"
    )


def _latex_notes(notes: list[tuple[str, str]]) -> str:
    items = "\n".join(f"\\item[{{{latex_text(k)}}}] {latex_text(v)}" for k, v in notes)
    return f"\\begin{{description}}\n{items}\n\\end{{description}}" if items else ""
