"""The curves beside the motion: coordinates by their units, and energies.

Input: a sampled Run.  Output: panels as plain values for JSON, at times of their own: curves are
the dense output, not the frames.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import Any, Final

import numpy as np

from mechc.errors import MechcError
from mechc.results.curves import line_styles
from mechc.results.player.following import followed
from mechc.results.player.page import base64_floats
from mechc.results.sampling import (
    Run,
    ShownUnit,
    clean_text,
    energies,
    pretty_name,
    shown_unit,
)
from mechc.system.parameters import Array

MOST_LINES: Final = 24
MOST_TIMES: Final = 6000
SAG: Final = 0.003  # of a panel's range: a dot of a plot
ROUNDING: Final = 1e-6  # of the values, as the page's axes have it
ENERGIES: Final = ("kinetic", "potential", "total")
TITLES: Final = {"angle": "Angles", "position": "Positions", "value": "Coordinates"}


def curves(run: Run) -> dict[str, Any]:
    """Coordinates, a panel for each unit, and the energies where they are known.

    Values are those at ``times``, s from the start: between two of them a straight line is the
    curve, to a three-hundredth of its panel's range.
    """
    units = {name: shown_unit(run.system, name) for name in run.system.coordinates}
    labels = [unit.label for unit in units.values()]
    t, values = followed(run, _values, lambda x: SAG * _ranges(x, labels), MOST_TIMES)
    shown = {name: units[name].factor * values[:, k] for k, name in enumerate(units)}
    panels = [
        _panel(title, unit, {pretty_name(name): shown[name] for name in names})
        for title, unit, names in by_unit(units)
    ]
    if values.shape[1] > len(units):
        panels.append(_panel("Energy", "J", dict(zip(ENERGIES, values.T[-3:], strict=True))))
    return {"times": base64_floats(t - run.t[0]), "panels": panels}


def _ranges(values: Array, units: Sequence[str]) -> Array:
    """The range of the panel of each curve."""
    panel = np.array([*units, *["Energy"] * (values.shape[1] - len(units))], dtype=object)
    ranges = np.zeros(len(panel))
    for name in dict.fromkeys(panel):
        own = values[:, panel == name]
        ranges[panel == name] = max(np.ptp(own), ROUNDING * np.abs(own).max())
    return ranges


def _values(run: Run) -> Array:
    """Coordinates and, where they are known, energies: (times, curves)."""
    columns = [run.y[:, : len(run.system.coordinates)]]
    with suppress(MechcError):
        columns += [column[:, None] for column in energies(run).values()]
    return np.nan_to_num(np.concatenate(columns, axis=1))


def by_unit(units: Mapping[str, ShownUnit]) -> list[tuple[str, str, list[str]]]:
    """Title and unit of each panel of coordinates, and their names."""
    groups: dict[str, tuple[str, str, list[str]]] = {}
    for name, unit in units.items():
        title = TITLES.get(unit.quantity, "Coordinates")
        groups.setdefault(unit.label, (title, unit.label, []))[2].append(name)
    return list(groups.values())


def _panel(title: str, unit: str, columns: dict[str, Array]) -> dict[str, Any]:
    """Lines by their names; those that coincide have dashes that alternate."""
    shown = list(columns.items())[:MOST_LINES]
    values = np.nan_to_num(np.stack([column for _, column in shown], axis=-1))
    lines = [  # dash: start, length and gap in widths of a line; nothing for a whole line
        {
            "name": clean_text(name),
            "values": base64_floats(column),
            "dash": [] if style == "-" else [style[0], *style[1]],
        }
        for (name, _), column, style in zip(shown, values.T, line_styles(values), strict=True)
    ]
    return {"title": title, "unit": unit, "lines": lines, "untold": len(columns) - len(shown)}
