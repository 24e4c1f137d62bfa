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

    Raises :class:`UnknownNameError` for a name that is none of a parameter, coordinate, speed or
    input; :class:`ValueOutOfBoundsError` for a range that is none.

    Parameters
    ----------
    about
        The data of the mechanism.
    start
        Its own start: coordinates and speeds by name.
    """
    states = [each["name"] for kind in ("coordinates", "speeds") for each in about[kind]]
    parameters = [each["name"] for each in about["parameters"]]
    own = [name for name in states if name in start]
    chosen: Sliders = wanted if wanted is not None else ()
    if wanted is None:  # parameters that do not follow from others; coordinates of the start
        free = [name for i, name in enumerate(parameters) if i not in {*about["follows"]}]
        coordinates = [each["name"] for each in about["coordinates"] if each["name"] in own]
        chosen = [*free[:MOST_PARAMETERS], *coordinates[:MOST_COORDINATES]]
    ends = chosen if isinstance(chosen, Mapping) else {}
    ranges = {str(n): checked_range(n, ends[n]) if n in ends else None for n in chosen}
    known = (*states, *parameters, *about["inputs"])
    for name in ranges:
        if name not in known:
            raise UnknownNameError("parameter, coordinate, speed or input", name, known)
    return ranges, [name for name in states if name in own or name in ranges]
