"""A slider as the data of a page: a label, a unit, a range."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from mechc.errors import ValueOutOfBoundsError, brief
from mechc.results.sampling import ShownUnit, clean_text, pretty_name


def slider_data(
    name: str,
    unit: ShownUnit,
    ends: Sequence[float] | None,
    description: str = "",
    suffix: str = "",
) -> dict[str, Any]:
    """A slider between the ends, in units of the API; None: the page chooses them.

    ``description``: the quantity in words, which stand before its name.
    """
    low, high = ends or (None, None)
    words = f"{clean_text(description, 100)}, " if description else ""
    return {
        "name": name, "label": words + pretty_name(name) + suffix, "title": clean_text(name),
        "low": low, "high": high, "factor": unit.factor, "unit": unit.label,
    }  # fmt: skip


def checked_range(name: str, given: Any) -> tuple[float, float]:
    """The lowest and the highest value of a slider.

    Raises :class:`ValueOutOfBoundsError` if they are not two numbers in this order.
    """
    try:
        low, high = (float(x) for x in given)
    except (TypeError, ValueError):
        low = high = math.nan
    if not (math.isfinite(high - low) and low < high):
        raise ValueOutOfBoundsError(
            f"the range of {name} is (lowest, highest), two numbers, not {brief(given)}"
        )
    return low, high
