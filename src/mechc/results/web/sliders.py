"""The values of a mechanism that have sliders on its page."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, Final

from mechc.errors import UnknownNameError
from mechc.results.player.sliders import checked_range

MOST_PARAMETERS: Final = 8
MOST_COORDINATES: Final = 4

Sliders = Iterable[str] | Mapping[str, tuple[float, float]]


def chosen_sliders(
    about: Mapping[str, Any], start: Mapping[str, float], wanted: Sliders | None
) -> tuple[dict[str, tuple[float, float] | None], list[str]]:
    """The ranges of the sliders by name, None where the page chooses, and the coordinates and
    speeds that keep their values while loops are closed.

    Parameters
    ----------
    about
        The data of the mechanism.
    start
        Its own start: coordinates and speeds by name.

    Raises
    ------
    UnknownNameError
        For a name that is none of a parameter, coordinate, speed or input.
    ValueOutOfBoundsError
        For a range that is none.
    """
    states = [each["name"] for kind in ("coordinates", "speeds") for each in about[kind]]
    parameters = [each["name"] for each in about["parameters"]]
    own = [name for name in states if name in start]
    chosen = _usual(about, parameters, own) if wanted is None else wanted
    ends = chosen if isinstance(chosen, Mapping) else {}
    ranges = {str(n): checked_range(n, ends[n]) if n in ends else None for n in chosen}
    known = (*states, *parameters, *about["inputs"])
    for name in ranges:
        if name not in known:
            raise UnknownNameError("parameter, coordinate, speed or input", name, known)
    return ranges, [name for name in states if name in own or name in ranges]


def _usual(about: Mapping[str, Any], parameters: list[str], own: list[str]) -> list[str]:
    """Parameters that do not follow from others; coordinates of the start."""
    follows = {*about["follows"]}
    free = [name for i, name in enumerate(parameters) if i not in follows]
    coordinates = [each["name"] for each in about["coordinates"] if each["name"] in own]
    return [*free[:MOST_PARAMETERS], *coordinates[:MOST_COORDINATES]]
