"""The samples of signals by name: ``"F[3]"`` is value 3 of the signal F, ``"F"`` all of them."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from mechc.errors import MechcError, ValueOutOfBoundsError
from mechc.inputs.bind import InputSlot
from mechc.inputs.signals import DEGREES, Signal
from mechc.system.parameters import Array
from mechc.system.system import System

INDEXED = re.compile(r"(.+)\[(\d+)\]\Z", re.DOTALL)


def signal_of(system: System, name: str) -> Signal | None:
    """The signal of a name that stands for one or all of its values; None for other names.

    Raises :class:`MechcError` for a value of an input that is no signal, and for signals without
    samples of their own; :class:`ValueOutOfBoundsError` for a sample that there is not.
    """
    own = input_of(name, system)
    if own is None or system.driven is None:
        return None
    held = system.driven.given.get(own)
    if not isinstance(held, Signal):
        if name == own:
            return None
        raise MechcError(
            f"{name} is a value of a sampled signal, but {own} is given as {type(held).__name__}: "
            f"ask for sensitivities by {own!r}, or give mechc.Signal(times, values)"
        )
    if held.kind not in DEGREES:
        raise MechcError(
            f"the derivative by {name} needs samples, and {own} is an interpolant, whose values "
            "between its knots do not follow from those at them: give mechc.Signal(times, values)"
        )
    if name != own:
        index_of(system, name)
    return held


def signals_among(system: System, names: Sequence[str]) -> dict[str, Signal]:
    """Input -> its signal with breaks at all samples, of those whose values are among the names."""
    found = {input_of(name, system): signal_of(system, name) for name in names}
    return {n: each.broken_at_samples() for n, each in found.items() if n and each is not None}


def cardinal(signal: Signal, index: int) -> tuple[Array, Array]:
    """Knots (n,) and coefficients (n, degree + 1) of a sample's cardinal function, without the
    pieces beyond which it is zero."""
    unit = np.zeros(len(signal.times))
    unit[index] = 1.0
    one = Signal(signal.times, unit, signal.kind, outside=signal.outside)
    knots, coefficients = one.pieces
    own = np.flatnonzero(coefficients.any(axis=1))
    kept = slice(max(own[0] - 1, 0), own[-1] + 2)
    return np.ascontiguousarray(knots[kept]), np.ascontiguousarray(coefficients[kept])


def input_of(name: str, system: System) -> str | None:
    """The input that a name belongs to."""
    if name in system.inputs:
        return name
    found = INDEXED.match(name) if system.inputs and isinstance(name, str) else None
    return found[1] if found and found[1] in system.inputs else None


def index_of(system: System, name: str) -> int:
    found = INDEXED.match(name)
    assert found is not None
    assert system.driven is not None
    index, count = int(found[2]), len(system.driven.given[found[1]].times)
    if index >= count:
        raise ValueOutOfBoundsError(f"{name}: {found[1]} has {count} samples, 0 to {count - 1}")
    return index


def places_of_values(system: System, name: str | None) -> tuple[tuple[int, int], ...]:
    """The places of an input's value and rates among those of all inputs, and their orders."""
    slots = [InputSlot.from_metadata(data) for data in system.data["inputs"]]
    every = [(slot.name, order) for slot in slots for order in slot.orders]
    return tuple((place, order) for place, (own, order) in enumerate(every) if own == name)
