"""Cycles and branches in words and pictures."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import cycle as cycle_through
from typing import TYPE_CHECKING, Any

import numpy as np

from mechc.results.answer import shown_quantity, value_lines
from mechc.results.figures import new_figure
from mechc.results.mathtext import plain, typeset
from mechc.results.panels import COLOURS, QUIET
from mechc.system.names import name_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SAMPLES = 800
MARKS = {"fold": "s", "period doubling": "D", "branching": "^", "torus": "o"}


def cycle_in_words(cycle: Any) -> str:
    """Period, start, multipliers, notes."""
    kind = "stable" if cycle.stable else "unstable"
    closes = f"closed to {cycle.closure:.1g}"
    rows = [f"cycle of {cycle.model.name}: period {cycle.period:.12g} s, {kind}, {closes}"]
    grown = {name: f", grows by {by * shown_quantity(cycle.model, name)[1]:.6g}"
             for name, by in cycle.advances.items()}  # fmt: skip
    rows += value_lines(cycle, grown)
    rows += [f"  multiplier   {_number(one)}" for one in cycle.multipliers]
    return "\n".join([*rows, *cycle.notes])


def _number(value: complex) -> str:
    if value.imag == 0.0:
        return f"{value.real:14.9g}"
    return f"{value.real:14.9g} {value.imag:+.9g}i, of size {abs(value):.9g}"


def branch_in_words(branch: Any) -> str:
    """A row for each cycle, with the special points at the end."""
    rows = [f"{branch.parameter:>14} {'period (s)':>14} {'largest multiplier':>20}"]
    for value, cycle in zip(branch.values, branch.cycles, strict=True):
        largest = np.abs(cycle.multipliers).max(initial=0.0)
        told = "" if cycle.stable else "  unstable"
        rows.append(f"{value:14.8g} {cycle.period:14.9g} {largest:20.8g}{told}")
    return "\n".join([*rows, *map(str, branch.special), f"ended: {branch.ended}"])


def _label(cycle: Any, name: str) -> str:
    unit, _ = shown_quantity(cycle.model, name)
    return typeset(name) + (plain(f" ({unit})") if unit else "")


def draw_branches(branches: Sequence[Any], quantity: Any) -> Figure:
    """The largest value of a quantity in each cycle over the parameter."""
    cycle = branches[0][0]
    name = cycle.model.coordinates[0] if quantity is None else name_of(quantity)
    with new_figure((6.4, 4.0)) as figure:
        axes = figure.subplots()
        for branch, colour in zip(branches, cycle_through(COLOURS), strict=False):
            heights = np.array([_largest(each, name) for each in branch])
            for of, style in ((branch.stable, "-"), (~branch.stable, "--")):
                shown = of | np.append(of[1:], False)  # with a line to the first of them
                axes.plot(branch.values, np.where(shown, heights, np.nan), style, color=colour)
            for point in branch.special:
                height, mark = _largest(point.cycle, name), MARKS[point.kind]
                axes.plot(point.value, height, mark, color=QUIET, label=point.kind, zorder=3)
        axes.set_xlabel(typeset(branches[0].parameter))
        axes.set_ylabel(f"largest {_label(cycle, name)}")
        handles, names = axes.get_legend_handles_labels()
        if handles:
            once = dict(zip(names, handles, strict=True))
            axes.legend(once.values(), once.keys())
    return figure


def _largest(cycle: Any, name: str) -> float:
    return float(
        cycle.samples(SAMPLES)[:, cycle.model.state_index(name)].max()
        * shown_quantity(cycle.model, name)[1]
    )
