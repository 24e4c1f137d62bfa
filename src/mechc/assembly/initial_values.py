"""The scene's own start, and how what is given of another one replaces it.

A value given replaces the scene's own for the same name.  The scene's other values stay as far as
there are freedoms for them; where there are not, they give way, and those of coordinates become a
guess near which the loops are closed, unless the mechanism prefers an assembly of its own.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mechc.model import Model

Values = Mapping[str, Any]  # numbers; columns of them, in a batch


def filled_start(
    model: Model, coordinates: Values, speeds: Values, guess: Values
) -> tuple[dict[str, Any], dict[str, Any], dict[str, Any]]:
    """Coordinates, speeds and a guess to assemble from; the scene's own where nothing is given."""
    own = {n: v for n, v in model.start.items() if n in model.coordinates and n not in guess}
    own_speeds = {n: v for n, v in model.start.items() if n in model.speeds}
    freedoms = len(model.coordinates) - len(model.states) - model._scene.holonomic
    chosen, chosen_guess = dict(coordinates), dict(guess)
    if not coordinates and not guess:
        chosen = own
    elif coordinates:
        chosen = _together(own, coordinates, freedoms)
        if "preference" not in model._scene.outputs:
            chosen_guess = {n: v for n, v in own.items() if n not in chosen} | chosen_guess
    freedoms = len(model.speeds) - len(model.constraint_names)
    chosen_speeds = _together(own_speeds, speeds, freedoms) if speeds else own_speeds
    return chosen, chosen_speeds, chosen_guess


def _together(own: Values, given: Values, freedoms: int) -> dict[str, Any]:
    """Both, if there are freedoms for both."""
    both = {**own, **given}
    return both if len(both) <= freedoms else dict(given)
