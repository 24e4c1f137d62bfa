"""Items of a section -> equations in lines that fit on a page, grouped by their labels.

Input: the items of one section.  Output: boxes.  Invariant: no term is lost where a line is broken
or a matrix is split into its entries.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import groupby
from typing import Any, NamedTuple

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
from mechc_codegen.typeset.sections import Item

LINE = 84.0  # characters, roughly


class Equation(NamedTuple):
    """``left`` equals the sum of the ``lines``."""

    left: Box
    lines: list[Box]


def equation_groups(
    items: tuple[Item, ...], splits: Callable[[Any], bool]
) -> list[tuple[str, list[Equation]]]:
    """Label and equations of each group; ``splits``: which wide matrices go entry by entry."""
    fitted = [part for item in items for part in _fitted(item, splits)]
    groups = groupby(fitted, key=lambda item: item.label)
    return [(label, list(map(_equation, group))) for label, group in groups]


def _equation(item: Item) -> Equation:
    """Left-hand side and the lines of the right-hand side; long sums go over several."""
    left, parts = layout(item.left), terms(item.right)
    vanishes = item.right == 0 and len(terms(item.left)) > 1
    if vanishes:
        return Equation(Word("0", "number"), _broken(terms(item.left), LINE))
    return Equation(left, _broken(parts, LINE - width(left)))


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


def _fitted(item: Item, splits: Callable[[Any], bool]) -> list[Item]:
    """The item, or its entries where it is a matrix wider than a line that may be split."""
    matrix = isinstance(item.right, MatrixBase) and splits(item.right)
    wide = matrix and width(layout(item.right)) + width(layout(item.left)) > LINE
    return _elements(item) if wide else [item]
