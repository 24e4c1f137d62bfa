"""The curves beside the motion: coordinates by their units, and energies.

Input: a sampled Run.  Output: panels as plain values for JSON.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from mechc.errors import MechcError
from mechc.results.sampling import Run, clean_text, pretty_name, shown_unit
from mechc.results.view.motion import encoded
from mechc.system.parameters import Array

MOST_LINES: Final = 24
TITLES: Final = {"angle": "Angles", "position": "Positions", "value": "Coordinates"}


def panels(run: Run) -> list[dict[str, Any]]:
    """Coordinates, a panel for each unit, and the energies where they are known."""
    return [*_coordinates(run), *_energies(run)]


def _coordinates(run: Run) -> list[dict[str, Any]]:
    found: dict[str, dict[str, Any]] = {}
    for column, name in enumerate(run.model.coordinates):
        unit = shown_unit(run.model, name)
        title = TITLES.get(unit.quantity, "Coordinates")
        panel = found.setdefault(
            unit.label, {"title": title, "unit": unit.label, "lines": [], "untold": 0}
        )
        if len(panel["lines"]) < MOST_LINES:
            panel["lines"].append(_line(pretty_name(name), unit.factor * run.y[:, column]))
        else:
            panel["untold"] += 1
    return list(found.values())


def _energies(run: Run) -> list[dict[str, Any]]:
    model = run.model
    try:
        lines = [
            _line("kinetic", run.evaluate(model.kinetic_energy)),
            _line("potential", run.evaluate(model.potential_energy)),
            _line("total", run.evaluate(model.energy)),
        ]
    except MechcError:
        return []
    return [{"title": "Energy", "unit": "J", "lines": lines, "untold": 0}]


def _line(name: str, values: Array) -> dict[str, Any]:
    return {"name": clean_text(name), "values": encoded(np.nan_to_num(values))}
