"""The search for the ends of a mode of contact, beside the events of a run."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from mechc.simulation.contact.laws import Mask
from mechc.simulation.contact.manifold import Forces
from mechc.simulation.contact.modes import State
from mechc.simulation.contact.place import EPS
from mechc.simulation.events.event import SMALLEST, Event, EventFinder, EventRecord, Side
from mechc.system.parameters import Array

ROUNDING = 64.0 * EPS  # of the terms of a slip, and of the forces at a contact


class ModeEnd(NamedTuple):
    """A function that stays above 0 while a mode lasts; ``side``: 1 where it may begin at 0."""

    kind: str
    contact: int
    function: Callable[[float, Array], float]
    side: float = 0.0


class ModeFinder(EventFinder):
    """An :class:`EventFinder` of the events of a run, and of the ends of the present mode.

    Attributes
    ----------
    own
        How many events the run has; the numbers of those that end a mode follow.
    ends
        The latter.
    """

    steps = 6

    def __init__(self, before: EventFinder) -> None:
        super().__init__(before.events, before.run, before.width, before.rtol)
        self.every, self.own = self.events, len(self.events)
        self.ends: Sequence[ModeEnd] = ()
        self.cleared: Mapping[int, float] = {}  # gaps that have just opened: how far
        self.kept, self.sizes = before.kept, before.sizes
        before.notes()  # of compiled code: read into these
        self.grazing, self.too_fast = before.grazing, before.too_fast

    def enter_mode(
        self, run: Any, ends: Sequence[ModeEnd], idle: Collection[int], sides: Sequence[Side]
    ) -> None:
        """Go on in a run in another mode, in which the events ``idle`` do not happen."""
        own = [
            replace(event, function=_one, reset=None) if number in idle else event
            for number, event in enumerate(self.every)
        ]
        self.ends, self.cleared = ends, {}
        self.events = own + [Event(end.function, -1.0, terminal=1) for end in ends]
        self.sizes = self.sizes[: self.own] + [0.0] * len(ends)
        self.enter(run, [*sides, *(Side(end.side) for end in ends)])

    def take_values(self, p: Array) -> None:
        super().take_values(p)
        self.every = [event.with_values(p) for event in self.every]

    def keep(self) -> None:
        self.found = self.found[: self.own]
        super().keep()

    def count(self, number: int) -> int:
        return super().count(number) if number < self.own else len(self.found[number])

    def _watch_grazing(self, number: int, points: list[tuple[float, float]]) -> None:
        """A gap that has just opened is known to be open."""
        if number in self.cleared and points[0][0] == self.start:
            clear = 2.0 * self.cleared[number]
            points = points[next((k for k, (_, gap) in enumerate(points) if gap > clear), 0) :]
        super()._watch_grazing(number, points)

    def notes(self) -> tuple[str, ...]:
        for found in (self.grazing, self.too_fast):
            for number in [number for number in found if number >= self.own]:
                del found[number]
        return super().notes()

    def records(self) -> tuple[EventRecord, ...]:
        return super().records()[: self.own]


def _one(t: float, y: Array) -> float:
    return 1.0


def ends_of_mode(forces: Forces, t: float, y: Array, still: Mask) -> list[ModeEnd]:
    """What ends the mode of these forces, that begins at the state y; ``still`` (n,): contacts
    that have no slip there."""
    answer = forces(t, y).answer
    found = [
        ModeEnd("halt", k, _slip(forces, k, state.way), float(still[k]))
        for k, state in enumerate(answer.mode)
        if state.way
    ]
    limits: list[tuple[str, int, Callable[[float, Array], float]]]
    if answer.is_redundant:
        limits = [("margin", -1, lambda s, x: forces(s, x).answer.margin())]
    else:
        limits = [
            (kind, k, _limit(forces, number))
            for number, (kind, k, _, _) in enumerate(forces(t, y).limits)
        ]
    limits += [
        ("negative", k, _friction(forces, k))
        for k, state in enumerate(answer.mode)
        if state.way or state is State.STICKS
    ]
    # at its limit, as far as that is known, a mode may begin: it ends at once where it goes beyond
    found += [ModeEnd(kind, k, left, float(left(t, y) <= 0.0)) for kind, k, left in limits]
    slides = any(state.way and forces.manifold.has_gap[k] for k, state in enumerate(answer.mode))
    if slides:
        found.append(ModeEnd("paradox", -1, lambda s, x: forces(s, x).answer.stiffness))
    return found


def _slip(forces: Forces, k: int, way: float) -> Callable[[float, Array], float]:
    """The slip, which counts as none where it is of the size of its rounding."""

    def slip(t: float, y: Array) -> float:
        numbers = forces(t, y).place.numbers
        rounding = ROUNDING * float(np.abs(numbers.rows[k]) @ np.abs(y[-len(numbers.rows[k]) :]))
        return way * float(numbers.slip[k]) + rounding

    return slip


def _friction(forces: Forces, k: int) -> Callable[[float, Array], float]:
    """The coefficients, or forces; 0 is one too."""

    def least(t: float, y: Array) -> float:
        found = forces(t, y)
        numbers, size = found.place.numbers, ROUNDING * float(found.answer.sizes[k])
        return float(min(numbers.friction[k], numbers.static[k])) + max(size, SMALLEST)

    return least


def _limit(forces: Forces, number: int) -> Callable[[float, Array], float]:
    """A force, or what is left to its limit; what is rounding counts as pressing."""

    def above_zero(t: float, y: Array) -> float:
        found = forces(t, y)
        _, k, c, d = found.limits[number]
        return float(c @ found.answer.unknowns + d) + ROUNDING * float(found.answer.sizes[k])

    return above_zero


def states_left(end: ModeEnd) -> set[tuple[int, State]]:
    """The states that the motion has come to the limit of."""
    k = end.contact
    if end.kind == "lift":
        return {(k, state) for state in State if state is not State.OPEN}
    if end.kind == "release":
        return {(k, State.STICKS)}
    return set()
