"""The picture of a design: the linkage with its curve, or targets over the driven coordinate."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from mechc.results.figures import new_figure
from mechc.results.mathtext import plain, typeset
from mechc.results.panels import COLOURS, QUIET
from mechc.system.quantities import values_of
from mechc.system.quantity import Kind, shown_in

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def draw_design(design: Any) -> Figure:
    """A panel in the plane for the points, and one for every other target."""
    targets = design.problem.targets.each
    points = [one for one in targets if one.quantities[0].output == "points"]
    others = [one for one in targets if one.quantities[0].output != "points"]
    count = bool(points or not others) + len(others)
    with new_figure((5.2 * count, 4.6)) as figure:
        panels = list(figure.subplots(1, count, squeeze=False)[0])
        if points or not others:
            _draw_plane(panels.pop(0), design, points)
        for axes, one in zip(panels, others, strict=True):
            _draw_values(axes, design, one)
    return figure


def _draw_plane(axes: Any, design: Any, points: Any) -> None:
    problem, sweep = design.problem, design.sweep
    system, curve = problem.system, sweep.points
    picture = system.picture
    shown = np.linspace(0, len(design.q) - 1, min(len(design.q), 3)).round().astype(int)
    for k, place in enumerate(shown):
        at = picture.points(problem.states(design.q[place]), sweep.p, problem.t)
        for _, names in picture.skeleton:
            x, y = at[[picture.point_names.index(name) for name in names], :2].T
            axes.plot(x, y, "o-", color=QUIET, alpha=0.9 if k == 0 else 0.3, markersize=3)
    for one, colour in zip(points, COLOURS, strict=False):
        place = one.quantities[0].entry // 3
        axes.plot(curve[:, place, 0], curve[:, place, 1], color=colour, label=f"path of {one.name}")
        axes.plot(one.values[:, 0], one.values[:, 1], "x", color="#222222", label="asked for")
    axes.set_aspect("equal", "datalim")
    axes.set_xlabel("x (m)")
    axes.set_ylabel("y (m)")
    if points:
        axes.legend(fontsize=8)


def _draw_values(axes: Any, design: Any, one: Any) -> None:
    problem, sweep, system = design.problem, design.sweep, design.problem.system
    unit, factor = shown_in(one.kind, one.unit)
    across = system.quantities[problem.driven]
    driven_unit, driven_factor = shown_in(across.kind, across.unit)
    y = problem.states(sweep.q)
    lines = values_of(one.quantities, system, y, sweep.p, problem.t)
    lines = lines - design.zeros.get(one.name, 0.0)
    for column in range(lines.shape[1]):
        asked = one.values[:, column]
        line = lines[:, column]
        if one.kind is Kind.ANGLE:  # whole turns from what was asked for
            order = np.argsort(sweep.values)
            apart = asked - np.interp(design.driven, sweep.values[order], line[order])
            line = line + 2 * np.pi * np.round(np.nanmedian(apart) / (2 * np.pi))
        axes.plot(driven_factor * sweep.values, factor * line, color=COLOURS[column])
        axes.plot(driven_factor * design.driven, factor * asked, "x", color="#222222")
    axes.set_xlabel(typeset(problem.driven) + plain(f" ({driven_unit})"))
    axes.set_ylabel(typeset(one.name) + plain(f" ({unit})" if unit else ""))
