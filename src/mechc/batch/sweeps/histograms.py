"""How the results of a batch are distributed, as pictures."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from mechc.batch.reductions import read_reduction
from mechc.results.figures import new_figure
from mechc.results.mathtext import plain
from mechc.results.sampling import clean_text
from mechc.system.quantity import shown_in

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def draw_histograms(batch: Any, names: Sequence[str]) -> Figure:
    """How many members have which value, of reductions and of coordinates and speeds at the end."""
    system, columns = batch.system, math.ceil(math.sqrt(len(names)))
    states = (*system.coordinates, *system.speeds)
    with new_figure((3.8 * columns, 0.6 + 2.6 * math.ceil(len(names) / columns))) as figure:
        for i, name in enumerate(names):
            end = name in states
            values = np.asarray(batch.y)[:, states.index(name)] if end else batch[name]
            meaning: Any = system.quantities[name] if end else read_reduction(system, name)
            unit, factor = shown_in(meaning.kind, meaning.unit)
            shown = np.where(batch.ok, values, np.nan) * factor
            axes = figure.add_subplot(math.ceil(len(names) / columns), columns, i + 1)
            axes.hist(shown[np.isfinite(shown)], bins="auto", color="#2563eb")
            told = f"{name} at the end" if end else clean_text(meaning.text, 60)
            axes.set_xlabel(plain(f"{told} [{unit}]" if unit else told))
            axes.set_ylabel("members")
        words = ", ".join(f"{count} {what}" for what, count in batch.counts.items())
        figure.suptitle(plain(f"{system.title}: {words}"))
    return figure
