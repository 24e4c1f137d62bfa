"""Columns by the values of sampled signals: ``"F[3]"`` is value 3 of the signal F, ``"F"`` all.

With one value more by 1 a signal changes by its cardinal function: the signal of the same kind
that is 1 at this sample and 0 at the others.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from mechc.errors import MechcError
from mechc.inputs.samples import cardinal, index_of, input_of, places_of_values, signal_of
from mechc.inputs.signals import polynomials_at
from mechc.native._inputs import Caller, Inputs, Shapes
from mechc.system.parameters import Array
from mechc.system.system import System


@dataclass(frozen=True)
class Sample:
    """One value of a signal: its column and its cardinal function, and the places of the input's
    values among all, each with its order of derivative."""

    column: int
    pieces: tuple[Array, Array]
    places: tuple[tuple[int, int], ...]


@dataclass(frozen=True)
class Samples:
    """The columns that are by values of signals; ``parameters``: how many stand before inputs."""

    samples: tuple[Sample, ...]
    parameters: int

    @cached_property
    def shapes(self) -> Shapes:
        """The columns and their signals as compiled code reads them."""
        each = [(k, s.column, *place) for k, s in enumerate(self.samples) for place in s.places]
        signals, columns, places, orders = zip(*each, strict=True)
        sources = list(zip(signals, orders, strict=True))
        pieces = [sample.pieces for sample in self.samples]
        factors = Inputs(pieces, sources, Caller([None] * len(each), 0, 0))
        placed = np.array(places, np.intc) + np.intc(self.parameters)
        return Shapes(factors, placed, np.array(columns, np.intc), len(self.samples))

    def add(self, slopes: Array, t: Any, found: Array) -> None:
        """Add derivatives by samples to ``found`` (n, rows, k), from slopes (n, rows, inputs)."""
        times = np.broadcast_to(np.asarray(t, dtype=np.float64), slopes.shape[:1])
        for sample in self.samples:
            for place, order in sample.places:
                factors = polynomials_at(*sample.pieces, times, order)
                found[..., sample.column] += slopes[..., place] * factors[:, None]

    def behind(self, first: int) -> Samples:
        """A copy whose columns are numbered from ``first`` on."""
        moved = (replace(s, column=first + k) for k, s in enumerate(self.samples))
        return replace(self, samples=tuple(moved))


def samples_of(system: System, places: Mapping[str, int | slice]) -> Samples | None:
    """The columns that are by values of signals; None where there are none.

    Raises :class:`MechcError` for a signal that was made of an interpolant: its values are no
    samples of its own.
    """
    found: list[Sample] = []
    for name, place in places.items():
        signal = signal_of(system, name)
        if signal is None:
            continue
        which = range(len(signal.times)) if isinstance(place, slice) else [index_of(system, name)]
        first = place.start if isinstance(place, slice) else place
        entries = places_of_values(system, input_of(name, system))
        for k, index in enumerate(which):
            found.append(Sample(first + k, cardinal(signal, index), entries))
    return Samples(tuple(found), len(system.parameters)) if found else None


def width(system: System, name: str) -> int | None:
    """The number of columns of a name that stands for all values of a signal; None for others."""
    signal = signal_of(system, name)
    return len(signal.times) if signal is not None and name in system.inputs else None


def check_steps(system: System, names: Sequence[str], times: Array) -> None:
    """Raise :class:`MechcError` where steps, which end at these times, pass over samples."""
    for name in names:
        signal = signal_of(system, name)
        if signal is None:
            continue
        knots, (low, high) = signal.pieces[0], sorted((times[0], times[-1]))
        for knot in knots[(knots > low) & (knots < high)]:  # at which steps must end
            if np.abs(times - knot).min() > 8 * np.spacing(max(abs(knot), np.abs(times).max())):
                raise MechcError(
                    f"the run steps over samples of {input_of(name, system)}, at {knot:.9g} s, "
                    f"where its derivative by {name} has a kink: give the signal as "
                    "mechc.Signal(..., breaks='samples')"
                )
