"""Impacts with friction: impulses at all contacts that touch.

Newton's law of restitution for the rates of the gaps and Coulomb's for the impulses (Moreau 1988;
Glocker & Pfeiffer 1995, Nonlinear Dynamics 7), one complementarity problem: w+ + e w >= 0,
p >= 0, their product 0, and |p_t| <= mu p, opposite to the slip after the impact where that is not
0.  Newton's law with friction may give energy (Kane & Levinson 1985); then the restitution is
taken as much smaller as keeps it from that.  With e = 0 it never does: p^T w+ <= 0.

Poisson's law has two such problems (Glocker & Pfeiffer, the same).  Compression is that of e = 0,
with the impulses c.  Expansion has p = e c + x, x >= 0 and w+ >= 0, their product 0, and friction
within mu p.  With one e for all it never gives energy: compression takes c^T A c / 2 and more, e c
with e c_t give at most e^2 of it, and what x and the friction of expansion add has p^T w+ <= 0.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import combinations
from typing import Any, NamedTuple

import numpy as np

from mechc.native._events import impulses
from mechc.simulation.contact.laws import Mask
from mechc.simulation.contact.modes import (
    EXACT,
    MOST_MODES,
    Answer,
    Inconsistent,
    Problem,
    State,
    TooManyContactsError,
    choices_of,
    consistent,
)
from mechc.simulation.contact.place import Place
from mechc.system.parameters import Array

HALVINGS = 52  # of the restitution
GIVEN = 1e-13  # of the energy exchanged: rounding
SETTLED = 1e-12  # of the largest rate or slip: one so small is 0


class Impact(NamedTuple):
    """What an impact does.

    ``change`` along rows R (nu,); ``struck`` (n,): the contacts that have an impulse; ``kept``: the
    part of the restitution that counted, so that no energy was given.
    """

    change: Array
    struck: Mask
    kept: float = 1.0


def after_impact(
    place: Place, touching: Mask, restitution: Array, has_friction: Mask, poisson: bool = False
) -> Impact:
    """The impulses at the contacts that touch (n,).

    Raises
    ------
    Inconsistent, TooManyContactsError
        Where there are none, or too many contacts.
    """
    numbers = place.numbers
    own = np.flatnonzero(touching)
    if not has_friction[own].any():
        rows = place.normal[own]
        given = rows @ rows.T, numbers.rate[own], restitution[own]
        try:
            found: Array = impulses(*map(np.ascontiguousarray, given), poisson)
        except ArithmeticError:
            raise Inconsistent(several=False) from None
        return Impact(found @ rows, _among(own, found, len(touching)))
    problem = Problem(
        place.normal[own], place.tangent[own], numbers.rate[own], numbers.slip[own],
        numbers.friction[own], numbers.friction[own], np.ones(len(own), bool),
    )  # fmt: skip
    law = _by_poisson if poisson else _by_newton
    change, pressed, kept = law(problem, restitution[own], has_friction[own])
    return Impact(change, _among(own, pressed, len(touching)), kept)


def _among(own: Any, pressed: Array, count: int) -> Mask:
    struck = np.zeros(count, bool)
    struck[own] = pressed > 0.0
    return struck


# -- Newton's law ----------------------------------------------------------------------------------


def _by_newton(
    problem: Problem, restitution: Array, has_friction: Mask
) -> tuple[Array, Array, float]:
    """The change, the normal impulses, and the largest part of the restitution that gives no
    energy."""
    best, low = _impulses(problem, restitution, has_friction), 1.0
    if _gives_energy(problem, best):
        best, low = _without_gain(problem, restitution, has_friction)
    return best.along, best.forces[:, 0], low


def _without_gain(problem: Problem, restitution: Array, has_friction: Mask) -> tuple[Answer, float]:
    low, high = 0.0, 1.0
    best = _impulses(problem, 0.0 * restitution, has_friction)
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        found = _impulses(problem, middle * restitution, has_friction)
        if _energy(problem, found) > 0.0:
            high = middle
        else:
            low, best = middle, found
    return best, low


def _impulses(problem: Problem, restitution: Array, has_friction: Mask) -> Answer:
    """Of all solutions the one that leaves the least energy."""
    kept = replace(problem, closing=(1.0 + restitution) * problem.closing)
    n = len(restitution)
    every = np.ones(n, bool)
    choices = choices_of(every, every, np.zeros(n), every, has_friction)
    return _least(problem, consistent(kept, choices, every, every))


def _least(problem: Problem, answers: Iterator[Answer]) -> Answer:
    found = list(answers)
    if not found:
        raise Inconsistent(several=False)
    return min(found, key=lambda answer: _energy(problem, answer))


def _energy(problem: Problem, answer: Answer) -> float:
    """What the impulses give, J."""
    forces = answer.forces
    work = forces[:, 0] @ problem.closing + forces[:, 1] @ problem.slipping
    return float(work + 0.5 * answer.along @ answer.along)


def _exchanged(problem: Problem, forces: Array) -> float:
    """The size of what the impulses give and take, J."""
    normal, along = np.abs(forces[:, 0] * problem.closing), np.abs(forces[:, 1] * problem.slipping)
    return float(normal.sum() + along.sum())


def _gives_energy(problem: Problem, answer: Answer) -> bool:
    return _energy(problem, answer) > GIVEN * _exchanged(problem, answer.forces)


# -- Poisson's law ---------------------------------------------------------------------------------


def _by_poisson(
    problem: Problem, restitution: Array, has_friction: Mask
) -> tuple[Array, Array, float]:
    """As :func:`_by_newton`; where different restitutions give energy the least counts for all."""
    pressing = _impulses(problem, 0.0 * restitution, has_friction)
    if not restitution.any():
        return pressing.along, pressing.forces[:, 0], 1.0
    for e in (restitution, np.full(len(restitution), restitution.min())):
        parting = _expansion(problem, pressing, e, has_friction)
        given = _energy(problem, pressing) + _energy(_after(problem, pressing), parting)
        if given <= GIVEN * _exchanged(problem, pressing.forces):
            break
    change = pressing.along + parting.along
    return change, pressing.forces[:, 0] + parting.forces[:, 0], 1.0


def _after(problem: Problem, answer: Answer) -> Problem:
    """The problem with the rates that impulses leave; what is rounding of them is 0."""
    closing, slipping = (
        np.where(np.abs(rates) <= SETTLED * problem.size, 0.0, rates) for rates in answer.after
    )
    return replace(problem, closing=closing, slipping=slipping)


def _expansion(
    problem: Problem, pressing: Answer, restitution: Array, has_friction: Mask
) -> Answer:
    """The impulses that follow compression.

    Of all solutions one with the fewest contacts that press more than is restored, as with much
    friction they may without need (Painleve); of these the one that leaves the least energy.
    """
    restored = restitution * np.maximum(pressing.forces[:, 0], 0.0)
    begun = replace(_after(problem, pressing), restored=restored)
    n = len(restored)
    if 6.0 ** np.count_nonzero(has_friction) * 2.0 ** np.count_nonzero(~has_friction) > MOST_MODES:
        raise TooManyContactsError
    for count in range(n + 1):
        sets = [np.isin(np.arange(n), some) for some in combinations(range(n), count)]
        found = [answer for own in sets for answer in _expansions(begun, own, has_friction)]
        if found:
            return _least(begun, iter(found))
    raise Inconsistent(several=False)


def _expansions(problem: Problem, pressed: Mask, has_friction: Mask) -> Iterator[Answer]:
    """All solutions in which these contacts press more than is restored."""
    assert problem.restored is not None
    n, limit = len(problem.closing), problem.friction * problem.restored
    every, friction = np.ones(n, bool), np.where(pressed, problem.friction, limit)
    part = replace(problem, has_gap=pressed, friction=friction, static=friction)
    rubs = has_friction & (pressed | (limit > 0.0))
    choices = choices_of(every, every, np.zeros(n), pressed, rubs)
    shut = [tuple(s for s in states if s is not State.OPEN) for states in choices]
    for answer in consistent(part, shut, every, every):
        if (answer.after[0] >= -EXACT * problem.size).all():
            yield answer
