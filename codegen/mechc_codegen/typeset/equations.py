"""Items of a section -> equations in lines that fit on a page, grouped by their labels.

Input: the items of one section.  Output: formulas.  Invariant: no term is lost where a line is
broken or a matrix is split into its entries.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import groupby
from typing import Any, NamedTuple

from sympy import MatrixBase

from mechc_codegen.typeset.formula import Formula, formula, sum_of, terms, width
from mechc_codegen.typeset.sections import Item

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
