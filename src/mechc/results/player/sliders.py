"""A slider as the data of a page: a label, a unit, a range."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from mechc.results.sampling import ShownUnit, clean_text, pretty_name


def slider_data(
    name: str, unit: ShownUnit, ends: Sequence[float] | None, suffix: str = ""
) -> dict[str, Any]:
    """A slider between the ends, in units of the API; None: the page chooses them."""
    low, high = ends or (None, None)
    return {
        "name": name, "label": pretty_name(name) + suffix, "title": clean_text(name),
        "low": low, "high": high, "factor": unit.factor, "unit": unit.label,
    }  # fmt: skip
