"""The scene's default start, and how given values replace it.

A given value replaces the default of the same name.  The other defaults are kept as far as there
are degrees of freedom for them; otherwise they are dropped, and those of coordinates become a guess
near which the loops are closed, unless the mechanism has a preferred assembly.  A default start of
all coordinates is such a guess itself: digits that it lacks open no loop.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from mechc.errors import UnknownNameError, ValueOutOfBoundsError, brief
from mechc.system.description import Description
from mechc.system.system import System
from mechc.system.units import in_si

LARGEST = math.sqrt(sys.float_info.max)
Values = Mapping[str, Any]  # numbers; columns of them, in a batch


@dataclass(frozen=True)
class Assembly:
    """Starts that are assembled member by member, each with its own parameters.

    Attributes
    ----------
    coordinates
        Values to keep (rad, m), by name or symbol: numbers, or arrays (n,) with one a member; the
        others are solved for, to the configuration that ``model.assemble`` prefers: elbow up for a
        planar loop.
    speeds
        Values to keep (rad/s, m/s); the others are made consistent.
    guess
        Coordinates near the configuration wanted, instead of the preferred one.

    Members that cannot be assembled get the status ``"not assembled"``.
    """

    coordinates: Values
    speeds: Values = field(default_factory=dict)
    guess: Mapping[str, float] = field(default_factory=dict)


def filled_start(
    system: System, coordinates: Values, speeds: Values, guess: Values
) -> tuple[dict[str, Any], dict[str, Any], dict[str, Any]]:
    """Coordinates, speeds and a guess to assemble from; the scene's defaults if none is given."""
    own = {n: v for n, v in system.start.items() if n in system.coordinates and n not in guess}
    own_speeds = {n: v for n, v in system.start.items() if n in system.speeds}
    chosen, chosen_guess = dict(coordinates), dict(guess)
    if not coordinates and not guess:
        whole = system.scene.holonomic and own.keys() >= {*system.coordinates}
        chosen, chosen_guess = ({}, own) if whole else (own, {})
    elif coordinates:
        chosen = _together(own, coordinates, closed_freedoms(system, {**own, **coordinates}))
        chosen_guess = guess_of_start(system, chosen) | chosen_guess
    freedoms = len(system.speeds) - len(system.constraint_names)
    chosen_speeds = _together(own_speeds, speeds, freedoms) if speeds else own_speeds
    return chosen, chosen_speeds, chosen_guess


def closed_freedoms(system: System, given: Collection[str]) -> int:
    """The number of coordinates that can be given before the loops determine the others, where
    these are: a quaternion of which no component is given has length one."""
    free = [i for i, name in enumerate(system.coordinates) if name not in given]
    lengths = len(system.attitudes.within(free))
    return int(len(system.coordinates) - len(system.states) - lengths - system.scene.holonomic)


def guess_of_start(system: System, given: Values) -> dict[str, Any]:
    """The coordinates of the default start as a guess, where no assembly is preferred."""
    if "preference" in system.scene.outputs:
        return {}
    return {n: v for n, v in system.start.items() if n in system.coordinates and n not in given}


def _together(own: Values, given: Values, freedoms: int) -> dict[str, Any]:
    """The values of both mappings, if there are degrees of freedom for both."""
    both = {**own, **given}
    return both if len(both) <= freedoms else dict(given)


def checked_numbers(
    system: Description, values: Values, known: Sequence[str], kind: str
) -> dict[str, float]:
    """Name -> finite number in SI units, each name known.

    Raises :class:`UnknownNameError`, :class:`ValueOutOfBoundsError` for an unknown name, for a
    value that is not a finite number, and for one whose square overflows.
    """
    checked = {}
    for name, value in values.items():
        if name not in known:
            raise UnknownNameError(kind, name, known)
        number = in_si(value, system.quantities[name])
        try:
            checked[name] = float(number)
        except (TypeError, ValueError, OverflowError):
            raise ValueOutOfBoundsError(f"{name} must be a number, not {brief(value)}") from None
        if not np.isfinite(checked[name]):
            raise ValueOutOfBoundsError(f"{name} = {checked[name]} is not a finite number")
        if abs(checked[name]) > LARGEST:
            raise ValueOutOfBoundsError(f"{name} = {checked[name]}: its square overflows a double")
    return checked
