"""Curves over time, and their legends.

Input: axes, times and columns of values.  Output: lines in the axes.
Invariant: of curves that coincide each shows: their dashes alternate.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from mechc.system.parameters import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes

COINCIDENT: Final = 0.004  # of the range of all curves: about the width of a line
DASH: Final = 8.0  # widths of a line
COMPARED: Final = 200  # times
LEGEND_ROWS: Final = 12  # for all panels above each other
LEGEND_COLUMNS: Final = 2


def draw_curve(axes: Axes, t: Array, values: Array, colour: Any, **style: Any) -> Any:
    """One curve; a dot where there is one time only."""
    style.setdefault("marker", "o" if len(t) == 1 else "")
    return axes.plot(t, values, color=colour, markersize=4, **style)[0]


def draw_curves(axes: Axes, t: Array, values: Array, colours: Sequence[Any]) -> list[Any]:
    """The columns of ``values`` (n, curves), those that coincide in alternating dashes."""
    styles = line_styles(values)
    return [
        draw_curve(axes, t, column, colour, linestyle=style)
        for column, colour, style in zip(values.T, colours, styles, strict=True)
    ]


def line_styles(values: Array) -> list[Any]:
    """A style for each column, "-" or (start, dashes): dashes of those that coincide alternate."""
    styles: dict[int, Any] = {}
    for group in _coincident(values):
        count = len(group)
        for place, column in enumerate(group):
            gap = DASH * (count - 1)
            start = -DASH * place % (DASH * count)
            styles[column] = "-" if count == 1 else (start, (DASH, gap))
    return [styles[column] for column in sorted(styles)]


def _coincident(values: Array) -> list[list[int]]:
    """The columns in groups, each of curves that cannot be told from its first."""
    rows = np.linspace(0, len(values) - 1, min(len(values), COMPARED)).astype(int)
    few = np.where(np.isfinite(values[rows]), values[rows], 0.0)
    near = COINCIDENT * float(np.ptp(few)) if few.size else 0.0
    groups: list[list[int]] = []
    for column in range(values.shape[1]):
        for group in groups:
            if np.abs(few[:, column] - few[:, group[0]]).max(initial=0.0) <= near:
                group.append(column)
                break
        else:
            groups.append([column])
    return groups


def legend_layout(count: int, panels: int) -> tuple[int, dict[str, Any]]:
    """The number of ``count`` entries that fit beside one of some panels, and their layout.

    Up to a column's length in one column of the usual size, then all in two small ones, and of
    more than fit so again one column.
    """
    rows = max(3, LEGEND_ROWS // panels)
    if count <= rows or count > LEGEND_COLUMNS * rows:
        return min(count, rows), {}
    small = {"fontsize": 7.0, "labelspacing": 0.25, "columnspacing": 1.0, "handletextpad": 0.4}
    return count, {"ncols": LEGEND_COLUMNS, **small}
