"""The map of a sweep as a picture, with failed members and change points marked; histograms.

Input: a batch, and of a map its plan.  Output: figures; PNG and SVG files, one a reduction.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from mechc.batch.reductions import read_reduction
from mechc.native._codes import NOT_ASSEMBLED
from mechc.results.figures import new_figure, save_figure
from mechc.results.mathtext import plain, typeset
from mechc.results.sampling import clean_text
from mechc.system.parameters import Array
from mechc.system.quantity import shown_in

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from mechc.batch.results import Batch
    from mechc.batch.sweeps.sweep import Plan

MOST_MAPS = 12
Members: TypeAlias = "np.ndarray[Any, np.dtype[np.intp]]"
WIDE = 1e3  # ratio of values beyond which the colour scale is logarithmic
CANNOT, FAILED, CROSSING = "#d1d5db", "#dc2626", "#111827"


def save_maps(batch: Batch, chosen: Plan, folder: Path) -> list[Path]:
    """Write ``map_0.png`` and ``.svg`` for the first reduction, and so on; the paths."""
    written: list[Path] = []
    for i, text in enumerate(batch.recipe.reductions):
        written += save_figure(draw_map(batch, chosen, text), folder, f"map_{i}")
    return written


def draw_map(batch: Batch, chosen: Plan, text: str) -> Figure:
    """One reduction against what varies: a line for one, a map for two, several for more.

    A grid of more than two has a map of the first two for each value of the others, twelve at most.
    Members that cannot be assembled are grey, failed ones red crosses, and members that met a
    change point black.
    """
    reduction = read_reduction(batch.system, text)
    unit, factor = shown_in(reduction.kind, reduction.unit)
    values = np.where(batch.ok, batch[text], np.nan) * factor
    shown = clean_text(reduction.text, 60)
    label = plain(f"{shown} [{unit}]" if unit else shown)
    with new_figure((7.4, 5.2)) as figure:
        draw = _draw_line if len(chosen.variations) == 1 else _draw_maps
        draw(figure, batch, chosen, values, label)
        _explain(figure, batch, values)
        figure.suptitle(plain(f"{batch.system.title}, 0 to {batch.recipe.span[1]:g} s"))
    return figure


def _axis(batch: Batch, chosen: Plan, i: int) -> tuple[Array, str]:
    """Values of the i-th variation in units for display, and the label."""
    name = chosen.variations[i].name
    quantity = batch.system.quantities[name]
    unit, factor = shown_in(quantity.kind, quantity.unit)
    return chosen.columns[name] * factor, f"{typeset(name)} [{plain(unit)}]"


def _draw_line(figure: Figure, batch: Batch, chosen: Plan, values: Array, label: str) -> None:
    from matplotlib.colors import LogNorm, SymLogNorm

    axes = figure.add_subplot()
    x, name = _axis(batch, chosen, 0)
    order = np.argsort(x, kind="stable")
    axes.plot(x[order], values[order], marker=".", markersize=3, color="#2563eb")
    axes.set_xlabel(name)
    axes.set_ylabel(label)
    finite = values[np.isfinite(values)]
    norm = _normalisation(finite) if finite.size else None
    if isinstance(norm, LogNorm):
        axes.set_yscale("log")
    elif isinstance(norm, SymLogNorm):
        axes.set_yscale("symlog", linthresh=norm.linthresh)
    status, crossing = batch["status"], batch["change_points"] > 0
    for where in x[status == NOT_ASSEMBLED]:
        axes.axvline(where, color=CANNOT, linewidth=1, zorder=0)
    axes.plot(x[crossing], values[crossing], "o", color=CROSSING, markersize=4)


def _draw_maps(figure: Figure, batch: Batch, chosen: Plan, values: Array, label: str) -> None:
    maps = _maps(batch, chosen)
    colours, extend = _colours(batch, values)
    columns = math.ceil(math.sqrt(len(maps)))
    places = figure.subplots(
        math.ceil(len(maps) / columns), columns, sharex=True, sharey=True, squeeze=False
    ).ravel()
    for axes, (title, members) in zip(places, maps, strict=False):
        drawn = _draw_plane(axes, batch, chosen, values, members, colours)
        if title:
            axes.set_title(title, fontsize="small")
    for empty in range(len(maps), len(places)):
        places[empty].set_visible(False)
        places[empty - columns].tick_params(labelbottom=True)
    figure.colorbar(drawn, ax=list(places[: len(maps)]), label=label, extend=extend)


def _maps(batch: Batch, chosen: Plan) -> list[tuple[str, Members]]:
    """Title and members of each map."""
    everyone = np.arange(len(chosen))
    if chosen.shape is None or len(chosen.shape) == 2:
        return [("", everyone)]
    by_others = everyone.reshape(*chosen.shape[:2], -1)
    count = by_others.shape[2]
    shown = np.unique(np.linspace(0, count - 1, min(count, MOST_MAPS)).round().astype(int))
    return [(_others(batch, chosen, by_others[0, 0, k]), by_others[:, :, k]) for k in shown]


def _others(batch: Batch, chosen: Plan, member: int) -> str:
    """A text of what varies besides the two axes of a map, with its values."""
    told = []
    for i, variation in enumerate(chosen.variations[2:], start=2):
        values, _ = _axis(batch, chosen, i)
        quantity = batch.system.quantities[variation.name]
        unit = shown_in(quantity.kind, quantity.unit)[0]
        told.append(f"{typeset(variation.name)} = {values[member]:.4g} {plain(unit)}")
    return ", ".join(told)


def _draw_plane(
    axes: Axes, batch: Batch, chosen: Plan, values: Array, members: Members, colours: Any
) -> Any:
    """One map of some members, with marks of failed ones and of those that met a change point;
    what its colours belong to."""
    (x, x_name), (y, y_name) = _axis(batch, chosen, 0), _axis(batch, chosen, 1)
    axes.set(xlabel=x_name, ylabel=y_name)
    axes.label_outer()
    axes.grid(visible=False)
    axes.set_facecolor(CANNOT)
    grid = chosen.shape[:2] if chosen.shape is not None and min(chosen.shape[:2]) > 1 else None
    drawn: Any
    if grid is not None:
        drawn = axes.pcolormesh(
            *(a[members].reshape(grid) for a in (x, y, values)),
            shading="nearest", cmap="viridis", norm=colours, rasterized=True,
        )  # fmt: skip
    else:
        axes.set_facecolor("white")
        lost = members[batch["status"][members] == NOT_ASSEMBLED]
        axes.scatter(x[lost], y[lost], s=9, color=CANNOT, linewidths=0)
        drawn = axes.scatter(
            x[members], y[members], c=values[members], s=9, cmap="viridis", norm=colours,
            linewidths=0, rasterized=True,
        )  # fmt: skip
    members, size = members.ravel(), 4.0 if grid is None else 2.0
    lost = batch["status"][members] == NOT_ASSEMBLED
    failed = members[np.logical_not(batch.ok[members] | lost)]
    axes.plot(x[failed], y[failed], "x", color=FAILED, markersize=4)
    crossing = members[batch["change_points"][members] > 0]
    axes.plot(x[crossing], y[crossing], "s", color=CROSSING, markersize=size, markeredgewidth=0)
    return drawn


def _colours(batch: Batch, values: Array) -> tuple[Any, str]:
    """The range of the colours, and at which ends values exceed it.

    Reactions grow without bound at a change point: those members, which are marked, would leave one
    colour for all others.
    """
    from matplotlib.colors import Normalize

    finite = np.isfinite(values)
    ordinary = values[finite & (batch["change_points"] == 0)]
    span = ordinary if len(ordinary) else values[finite]
    if not len(span):
        return Normalize(0.0, 1.0), "neither"
    low, high = span.min(), span.max()
    below, above = bool((values[finite] < low).any()), bool((values[finite] > high).any())
    extend = {(0, 0): "neither", (1, 0): "min", (0, 1): "max", (1, 1): "both"}[below, above]
    return _normalisation(span), extend


def _normalisation(span: Array) -> Any:
    """The scale of some finite values: logarithmic from three decades on.

    With zeros or both signs among them it is linear about zero, up to the median size, where the
    largest exceeds that by three decades.
    """
    from matplotlib.colors import LogNorm, Normalize, SymLogNorm

    low, high, sizes = span.min(), span.max(), np.abs(span[span != 0.0])
    if low > 0.0 and high > WIDE * low:
        return LogNorm(low, high)
    if low <= 0.0 and sizes.size and sizes.max() > WIDE * np.median(sizes):
        return SymLogNorm(float(np.median(sizes)), vmin=low, vmax=high)
    return Normalize(low, high)


def _explain(figure: Figure, batch: Batch, values: Array) -> None:
    """A legend of the marks that occur."""
    from matplotlib.lines import Line2D

    lost = batch["status"] == NOT_ASSEMBLED
    empty = np.isnan(values) & batch.ok
    grey = [text for some, text in ((lost, "cannot be assembled"), (empty, "has no value"))
            if some.any()]  # fmt: skip
    marks = [
        (bool(grey), "s", CANNOT, " or ".join(grey)),
        (
            (np.logical_not(batch.ok) & np.logical_not(lost)).any(),
            "x",
            FAILED,
            "did not reach the end",
        ),
        ((batch["change_points"] > 0).any(), "s", CROSSING, "met a change point"),
    ]
    handles = [
        Line2D([], [], linestyle="", marker=marker, color=color, markersize=5, label=text)
        for shown, marker, color, text in marks
        if shown
    ]
    if handles:
        figure.legend(handles=handles, loc="outside lower center", ncols=3)
