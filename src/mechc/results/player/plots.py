"""The curves beside the motion: coordinates by their units, and energies.

Input: a sampled Run.  Output: panels as plain values for JSON.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

import numpy as np

from mechc.errors import MechcError
from mechc.results.curves import line_styles
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
TITLES: Final = {"angle": "Angles", "position": "Positions", "value": "Coordinates"}


def panels(run: Run) -> list[dict[str, Any]]:
    """Coordinates, a panel for each unit, and the energies where they are known."""
    units = {name: shown_unit(run.system, name) for name in run.system.coordinates}
    columns = {name: units[name].factor * run.y[:, k] for k, name in enumerate(units)}
    coordinates = [
        _panel(title, unit, {pretty_name(name): columns[name] for name in names})
        for title, unit, names in by_unit(units)
    ]
    return [*coordinates, *_energies(run)]


def by_unit(units: Mapping[str, ShownUnit]) -> list[tuple[str, str, list[str]]]:
    """Title and unit of each panel of coordinates, and their names."""
    groups: dict[str, tuple[str, str, list[str]]] = {}
    for name, unit in units.items():
        title = TITLES.get(unit.quantity, "Coordinates")
        groups.setdefault(unit.label, (title, unit.label, []))[2].append(name)
    return list(groups.values())


def _energies(run: Run) -> list[dict[str, Any]]:
    try:
        return [_panel("Energy", "J", energies(run))]
    except MechcError:
        return []


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
