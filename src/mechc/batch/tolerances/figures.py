"""The picture of tolerances: for each result a tornado of its parts and a histogram."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from mechc.results.figures import new_figure
from mechc.results.mathtext import plain, typeset
from mechc.results.panels import COLOURS, QUIET
from mechc.results.sampling import clean_text
from mechc.system.parameters import Array
from mechc.system.quantity import shown_in

if TYPE_CHECKING:
    from matplotlib.figure import Figure


MOST = 12  # parts in a tornado, those of the largest effects


def draw_tolerances(found: Any) -> Figure:
    """A row for each result: the effects of parts, the largest on top, and the drawn motions."""
    rows = len(found.results)
    with new_figure((9.6, 0.8 + 2.9 * rows)) as figure:
        panels = figure.subplots(rows, 2, squeeze=False)
        for i, one in enumerate(found.reductions):
            unit, factor = shown_in(one.kind, one.unit)
            label = plain(clean_text(one.text, 60) + (f" ({unit})" if unit else ""))
            _tornado(panels[i, 0], found.names, factor * found.effects[i], label)
            _histogram(
                panels[i, 1], factor * found.drawn[:, i], factor * found.nominal[i],
                factor * found.sigma[i], label,
            )  # fmt: skip
        figure.suptitle(
            plain(f"{clean_text(found.model.title, 60)}: {found.distribution} tolerances"),
            x=0.01, ha="left",
        )  # fmt: skip
    return figure


def _tornado(axes: Any, names: Any, effects: Array, label: str) -> None:
    order = np.argsort(np.nan_to_num(np.abs(effects)), kind="stable")[-MOST:]
    places = np.arange(len(order))
    axes.barh(places, 2 * np.abs(effects[order]), left=-np.abs(effects[order]), color=COLOURS[0])
    axes.axvline(0.0, color=QUIET, linewidth=0.8)
    axes.use_sticky_edges = False
    known = np.isfinite(effects)
    axes.set_yticks(places, [typeset(names[k]) if known[k] else f"{typeset(names[k])}: none"
                             for k in order])  # fmt: skip
    axes.set_ylim(-0.6, len(order) - 0.4)
    axes.grid(axis="y", visible=False)
    _mark_few(axes)
    axes.set_xlabel(plain("change of ") + label)


def _mark_few(axes: Any) -> None:
    """Few marks, with a power of ten apart where numbers are long."""
    axes.locator_params(axis="x", nbins=5)
    axes.ticklabel_format(axis="x", scilimits=(-2, 4), useMathText=True)


def _histogram(axes: Any, values: Array, nominal: float, sigma: float, label: str) -> None:
    values = values[np.isfinite(values)]
    axes.hist(values, bins="auto", density=True, color=COLOURS[5], alpha=0.6, label="drawn")
    if np.isfinite(sigma) and sigma > 0.0:
        x = nominal + sigma * np.linspace(-4.0, 4.0, 201)
        curve = np.exp(-0.5 * ((x - nominal) / sigma) ** 2) / (sigma * np.sqrt(2.0 * np.pi))
        axes.plot(x, curve, color=COLOURS[1], label="first order")
    axes.axvline(nominal, color=QUIET, linewidth=0.8)
    axes.set_yticks([])
    _mark_few(axes)
    axes.set_xlabel(label)
    axes.legend(fontsize=8)
