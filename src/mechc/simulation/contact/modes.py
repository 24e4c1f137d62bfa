"""Modes of contact: which gaps are open, held, sliding or sticking, and the forces that they need.

A mode is consistent where gaps press and do not pull, friction stays within its limit and opposes
the sliding, and open gaps open: a complementarity problem on accelerations (Glocker & Pfeiffer
1995, Nonlinear Dynamics 7; in the plane).  Its solutions are found by trying the modes, so that
it is known where there is none, or more than one (Painleve 1895).
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from enum import IntEnum
from functools import cached_property
from itertools import product
from typing import Any

import numpy as np

from mechc.simulation.contact.laws import Mask
from mechc.simulation.contact.place import DEPENDENT, Free, Place
from mechc.system.parameters import Array

EXACT = 1e-9  # of the largest acceleration: one so small is 0
DIFFERENT = 1e-6  # of the largest: accelerations of two modes farther apart are two motions
MOST_MODES = 4096  # that are tried
ROUND = 1e-11  # of what a force is compared with


class State(IntEnum):
    """Of one contact.  A sliding one says which way; without friction it is held or open."""

    OPEN = 0
    HELD = 1
    STICKS = 2
    SLIDES_ON = 3
    SLIDES_BACK = 4

    @property
    def way(self) -> float:
        """1 or -1 where it slides, else 0."""
        return {State.SLIDES_ON: 1.0, State.SLIDES_BACK: -1.0}.get(self, 0.0)


WORDS = {
    State.OPEN: "open", State.HELD: "held", State.STICKS: "sticks",
    State.SLIDES_ON: "slides +", State.SLIDES_BACK: "slides -",
}  # fmt: skip
Mode = tuple[State, ...]


@dataclass(frozen=True)
class Problem:
    """Forces sought at one state, or impulses, which follow the same law.

    Attributes
    ----------
    normal, tangent : (n, nu)
        Rows R of gaps and slips.
    closing, slipping : (n,)
        What of gaps and slips is to be made 0 where they are held: accelerations, or speeds.
    friction, static : (n,)
        Coefficients, or forces in N where ``has_gap`` is false.
    restored : (n,)
        Of an impact's expansion: normal impulses that it has besides those sought; None elsewhere.
    """

    normal: Array
    tangent: Array
    closing: Array
    slipping: Array
    friction: Array
    static: Array
    has_gap: Mask
    restored: Array | None = None

    @classmethod
    def of_forces(cls, place: Place, free: Free, has_gap: Mask) -> Problem:
        numbers = place.numbers
        return cls(
            place.normal, place.tangent, free.normal, free.tangent, numbers.friction,
            numbers.static, has_gap,
        )  # fmt: skip

    @cached_property
    def size(self) -> float:
        """The largest of what is to be made 0, and of what given forces do."""
        largest = max(np.abs(self.closing).max(initial=0.0), np.abs(self.slipping).max(initial=0.0))
        limits = np.where(self.has_gap, 0.0, self.static) * (self.tangent**2).sum(axis=1)
        if self.restored is not None:
            limits = np.maximum(limits, self.restored * (self.normal**2).sum(axis=1))
        return float(max(largest, limits.max(initial=0.0))) or 1.0

    def answer(self, mode: Mode) -> Answer:
        """The forces of a mode, and what they do; whether it is consistent is another question."""
        rows, columns, owners, targets = [], [], [], []
        given = self._given(mode)
        for k, state in enumerate(mode):
            if self.has_gap[k] and state is not State.OPEN:
                slope = state.way * self.friction[k]
                rows.append(self.normal[k])
                columns.append(self.normal[k] - slope * self.tangent[k])
                owners.append((k, 0))
                targets.append(self.closing[k])
            if state is State.STICKS:
                rows.append(self.tangent[k])
                columns.append(self.tangent[k])
                owners.append((k, 1))
                targets.append(self.slipping[k])
            elif not self.has_gap[k]:
                given -= state.way * self.friction[k] * self.tangent[k]
        width = len(given)
        a, b = (np.array(x).reshape(-1, width) for x in (rows, columns))
        return Answer(
            self, mode, tuple(owners), a @ b.T, -(np.array(targets) + a @ given), b, given
        )

    def _given(self, mode: Mode) -> Array:
        """What the impulses that are restored do, with the friction of those that slide."""
        if self.restored is None:
            return np.zeros(self.normal.shape[1])
        way = np.array([state.way for state in mode]) * np.where(self.has_gap, self.friction, 0.0)
        return np.asarray(self.restored @ (self.normal - way[:, None] * self.tangent))


@dataclass(frozen=True)
class Answer:
    """The forces x of one mode, G x = aim.

    Attributes
    ----------
    owners
        Of each unknown the contact, and 0: its normal force, or 1: its friction while it sticks.
    """

    problem: Problem
    mode: Mode
    owners: tuple[tuple[int, int], ...]
    matrix: Array
    aim: Array
    columns: Array
    given: Array

    @cached_property
    def _solved(self) -> tuple[Array, int]:
        if not len(self.owners):
            return np.zeros(0), 0
        if len(self.owners) == 1 and self.matrix[0, 0] != 0.0:
            return self.aim / self.matrix[0, 0], 1
        found, _, rank, _ = np.linalg.lstsq(self.matrix, self.aim, rcond=DEPENDENT)
        return np.asarray(found, np.float64), int(rank)

    @property
    def unknowns(self) -> Array:
        return self._solved[0]

    @property
    def is_redundant(self) -> bool:
        """Whether the forces are not unique."""
        return self._solved[1] < len(self.owners)

    @property
    def solves(self) -> bool:
        off = self.matrix @ self.unknowns - self.aim
        return bool((np.abs(off) <= EXACT * self.problem.size).all())

    @cached_property
    def along(self) -> Array:
        """The change that all forces make, along rows R (nu,)."""
        return self.given + self.unknowns @ self.columns

    @cached_property
    def after(self) -> tuple[Array, Array]:
        """Accelerations, or speeds, of gaps and of slips (n,)."""
        problem = self.problem
        return (
            problem.closing + problem.normal @ self.along,
            problem.slipping + problem.tangent @ self.along,
        )

    @cached_property
    def forces(self) -> Array:
        """Normal forces and frictions (n, 2), N."""
        found = np.zeros((len(self.mode), 2))
        for (k, kind), x in zip(self.owners, self.unknowns, strict=True):
            found[k, kind] = x
        if self.problem.restored is not None:
            found[:, 0] += self.problem.restored
        for k, state in enumerate(self.mode):
            if state.way:
                pressed = found[k, 0] if self.problem.has_gap[k] else 1.0
                found[k, 1] = -state.way * self.problem.friction[k] * pressed
        return found

    @cached_property
    def stiffness(self) -> float:
        """The determinant of the sliding contacts, 1 without friction: at 0 and below, normal
        forces do not keep gaps from closing (Painleve)."""
        sliding = [i for i, (k, kind) in enumerate(self.owners) if not kind and self.mode[k].way]
        if not sliding:
            return 1.0
        own = self.problem.normal[[self.owners[i][0] for i in sliding]]
        size = float((own**2).sum(axis=1).prod())
        if len(sliding) == 1:
            return float(self.matrix[sliding[0], sliding[0]]) / size
        return float(np.linalg.det(self.matrix[np.ix_(sliding, sliding)])) / size

    # -- is it consistent? ----------------------------------------------------------------------

    def limits(self) -> list[tuple[str, int, Array, float]]:
        """What has to stay above 0, of each: its kind, the contact, and c, d of c . x + d."""
        found = []
        place = {owner: i for i, owner in enumerate(self.owners)}
        for k, state in enumerate(self.mode):
            unit = np.zeros((2, len(self.owners)))
            for kind in (0, 1):
                if (k, kind) in place:
                    unit[kind, place[k, kind]] = 1.0
            if state is State.STICKS:
                limit, restored = self.problem.static[k], self.problem.restored
                known = 0.0 if restored is None else limit * restored[k]
                most, fixed = (limit * unit[0], known) if self.problem.has_gap[k] else (0.0, limit)
                found += [
                    ("release", k, most - unit[1], fixed),
                    ("release", k, most + unit[1], fixed),
                ]
            elif state is not State.OPEN and self.problem.has_gap[k]:
                found.append(("lift", k, unit[0], 0.0))
        return found

    def margin(self) -> float:
        """The least of the limits, m/s^2; the largest that there is where forces are not unique."""
        limits = self.limits()
        if not limits:
            return np.inf
        c, d = np.array([x[2] for x in limits]), np.array([x[3] for x in limits])
        scale = self._of_one_newton[[x[1] for x in limits]]
        if not self.is_redundant:
            return float((scale * (c @ self.unknowns + d)).min())
        return self._largest_margin(scale[:, None] * c, scale * d)

    @cached_property
    def sizes(self) -> Array:
        """Of forces at each contact (n,), N: what makes the largest acceleration there."""
        one = self._of_one_newton
        return np.divide(self.problem.size, one, out=np.zeros(len(one)), where=one > 0.0)

    @cached_property
    def _of_one_newton(self) -> Array:
        rows = self.problem.normal, self.problem.tangent
        return np.asarray(np.maximum(*((row**2).sum(axis=1) for row in rows)))

    def _largest_margin(self, c: Array, d: Array) -> float:
        """Of all forces with G x = aim the largest least limit: a linear program."""
        from scipy.optimize import linprog

        left, sizes, _ = np.linalg.svd(self.matrix)
        own = left[:, sizes > DEPENDENT * sizes[0]].T
        count, size = len(self.owners), self.problem.size
        found = linprog(
            np.append(np.zeros(count), -1.0),
            A_ub=np.hstack([-c, np.ones((len(c), 1))]), b_ub=d / size,
            A_eq=np.hstack([own @ self.matrix, np.zeros((len(own), 1))]),
            b_eq=own @ self.aim / size,
            bounds=[*[(None, None)] * count, (None, 1.0)], method="highs",
        )  # fmt: skip
        return float(-found.fun * size) if found.status == 0 else -np.inf

    def is_consistent(self, closed: Mask, still: Mask) -> bool:
        """``closed``, ``still`` (n,): gaps that are to keep closed or to open, and contacts
        without slip, where one that begins to slide does so its way."""
        small = EXACT * self.problem.size
        if not self.solves or self.margin() < -small:
            return False
        opening, sliding = self.after
        for k, state in enumerate(self.mode):
            if state is State.OPEN and closed[k] and opening[k] < -small:
                return False
            if state.way and still[k] and state.way * sliding[k] < -small:
                return False
        return True


def consistent(
    problem: Problem, choices: Sequence[tuple[State, ...]], closed: Mask, still: Mask
) -> Iterator[Answer]:
    """The answers of all consistent modes, in the order of the choices; ``closed`` and ``still``
    as of :meth:`Answer.is_consistent`.

    Raises
    ------
    TooManyContactsError
        Where there are too many modes to try.
    """
    if np.prod([float(len(states)) for states in choices]) > MOST_MODES:
        raise TooManyContactsError
    for mode in product(*choices):
        answer = problem.answer(mode)
        if answer.is_consistent(closed, still):
            yield answer


class TooManyContactsError(Exception):
    """More modes than can be tried; internal."""


class Inconsistent(Exception):  # noqa: N818
    """No mode of contact is consistent, or several are; internal.  ``several``: which."""

    def __init__(self, several: bool) -> None:
        super().__init__()
        self.several = several


def decided(
    problem: Problem,
    choices: Sequence[tuple[State, ...]],
    closed: Mask,
    still: Mask,
    left: Collection[tuple[int, State]] = (),
) -> Answer:
    """The mode in which the motion goes on; ``left``: contacts with states that they have just come
    to the limit of, which are taken only where nothing else is consistent.

    Sticking comes before sliding where both are consistent, as they are with a larger static
    friction.

    Raises
    ------
    Inconsistent, TooManyContactsError
    """
    found = list(consistent(problem, choices, closed, still))
    found = [answer for answer in found if not _is_left(answer.mode, left)] or found
    if not found:
        raise Inconsistent(several=False)
    for other in found[1:]:
        change = np.abs(np.stack(other.after) - np.stack(found[0].after)).max()
        by_static = _by_static_friction(problem, found[0].mode, other.mode)
        if change > DIFFERENT * problem.size and not by_static:
            raise Inconsistent(several=True)
    return found[0]


def _is_left(mode: Mode, left: Collection[tuple[int, State]]) -> bool:
    return any(mode[k] is state for k, state in left)


def _by_static_friction(problem: Problem, first: Mode, other: Mode) -> bool:
    """Whether two modes differ by contacts that stick in one, with more friction than sliding."""
    more = problem.static > problem.friction * (1.0 + ROUND)
    return all(
        a is b or (State.STICKS in (a, b) and State.OPEN not in (a, b) and more[k])
        for k, (a, b) in enumerate(zip(first, other, strict=True))
    )


def choices_of(
    closed: Mask, still: Mask, slip: Array, has_gap: Mask, has_friction: Mask
) -> list[tuple[State, ...]]:
    """The states that each contact may be in: closed gaps, of these still or sliding ones.

    What neither presses nor opens is open, so that no force is sought that is rounding.
    """
    found = []
    for k in range(len(closed)):
        ways: tuple[State, ...] = (State.HELD,)
        if has_friction[k]:
            ways = (State.SLIDES_ON if slip[k] > 0 else State.SLIDES_BACK,)
            if still[k]:
                ways = (State.STICKS, State.SLIDES_ON, State.SLIDES_BACK)
        if has_gap[k]:
            ways = (State.OPEN, *ways) if closed[k] else (State.OPEN,)
        found.append(ways)
    return found


def told(mode: Mode, numbers: Sequence[int], count: int) -> tuple[str, ...]:
    """The states in words, of each of ``count`` events; "" of those that are no contacts."""
    words: list[Any] = [""] * count
    for number, state in zip(numbers, mode, strict=True):
        words[number] = WORDS[state]
    return tuple(words)
