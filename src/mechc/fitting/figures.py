"""The picture of a fit: data over the fitted motion, and the residuals below."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from mechc.results.figures import new_figure
from mechc.results.mathtext import plain, typeset
from mechc.results.panels import COLOURS, QUIET
from mechc.results.sampling import clean_text
from mechc.system.parameters import Array
from mechc.system.quantity import shown_in

if TYPE_CHECKING:
    from matplotlib.figure import Figure


MOST: Final = 4  # recordings in one picture
SAMPLES: Final = 800


def draw_fit(result: Any) -> Figure:
    """A figure with a column for each recording, four at most, and rows for each quantity."""
    problem = result.problem
    shown = range(min(MOST, len(problem.recordings)))
    rows = len(problem.measured)
    with new_figure((max(7.4, 4.6 * len(shown)), 0.6 + 3.2 * rows)) as figure:
        panels = figure.subplots(
            2 * rows, len(shown), squeeze=False, sharex="col",
            gridspec_kw={"height_ratios": [3.0, 1.2] * rows},
        )  # fmt: skip
        for place in shown:
            for k, one in enumerate(problem.measured):
                _draw_data(panels[2 * k, place], result, place, k)
                _draw_residuals(panels[2 * k + 1, place], result, place, k)
                if place == 0:
                    unit, _ = shown_in(one.quantity.kind, one.quantity.unit)
                    told = f" ({unit})" if unit else ""
                    panels[2 * k, 0].set_ylabel(typeset(one.name) + plain(told))
                    panels[2 * k + 1, 0].set_ylabel(plain("fit - data" + told), fontsize=8)
            panels[-1, place].set_xlabel("time (s)")
            if len(shown) > 1:
                panels[0, place].set_title(f"recording {place}")
        figure.suptitle(plain(_title(result, len(shown))), x=0.01, ha="left")
        _legend(figure, panels[0, 0], panels[1, 0])
    return figure


def _title(result: Any, shown: int) -> str:
    problem = result.problem
    left = len(problem.recordings) - shown
    more = f", {left} more recordings not shown" if left else ""
    names = ", ".join(clean_text(name) for name in result.names[:5])
    names += " ..." if len(result.names) > 5 else ""
    return f"{clean_text(result.model.title, 60)}: fit of {names}{more}"


def _legend(figure: Figure, *panels: Any) -> None:
    handles: list[Any] = []
    names: list[str] = []
    for axes in panels:
        some, told = axes.get_legend_handles_labels()
        handles += some
        names += told
    figure.legend(handles, names, loc="outside upper right", ncols=len(names), fontsize=8)


def _draw_data(axes: Any, result: Any, place: int, k: int) -> None:
    problem, one = result.problem, result.problem.measured[k]
    _, factor = shown_in(one.quantity.kind, one.quantity.unit)
    recording, sol = problem.recordings[place], result.solutions[place]
    t = np.linspace(sol.span[0], sol.span[1], SAMPLES)
    line = one.quantity.values(sol.system, sol(t), sol.params, t)
    line = line + _turns(result, place, k)
    known = recording.valid[:, k]
    axes.plot(
        recording.t[known], factor * recording.values[known, k], "o", markersize=_dot(known),
        color=QUIET, alpha=0.6, markeredgewidth=0, label="data",
    )  # fmt: skip
    axes.plot(t, factor * line, color=COLOURS[0], label="fit")


def _turns(result: Any, place: int, k: int) -> float:
    """Whole turns by which the data of an angle differ from the motion as it is assembled."""
    recording, sol = result.problem.recordings[place], result.solutions[place]
    one = result.problem.measured[k]
    own = one.quantity.values(sol.system, sol.y, sol.params, sol.t)
    left = result.residuals[place][:, k] + recording.values[:, k] - own
    return float(left[recording.valid[:, k]][0])


def _dot(known: Array) -> float:
    return 4.0 if np.count_nonzero(known) < 200 else 2.5


def _draw_residuals(axes: Any, result: Any, place: int, k: int) -> None:
    one, recording = result.problem.measured[k], result.problem.recordings[place]
    _, factor = shown_in(one.quantity.kind, one.quantity.unit)
    known = recording.valid[:, k]
    left = factor * result.residuals[place][known, k]
    if np.isfinite(one.sigma):
        band = 2 * factor * one.sigma
        axes.axhspan(-band, band, color=COLOURS[5], alpha=0.18, linewidth=0, label="2 sigma")
    axes.axhline(0.0, color=QUIET, linewidth=0.8)
    axes.plot(
        recording.t[known], left, "o", markersize=_dot(known), color=COLOURS[1], markeredgewidth=0
    )
    largest = float(np.abs(left).max(initial=0.0))
    if largest:
        axes.set_ylim(-1.15 * largest, 1.15 * largest)
