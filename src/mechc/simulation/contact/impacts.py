"""Impacts with friction: impulses at all contacts that touch.

Newton's law of restitution for the rates of the gaps and Coulomb's for the impulses (Moreau 1988;
Glocker & Pfeiffer 1995, Nonlinear Dynamics 7), one complementarity problem: w+ + e w >= 0,
p >= 0, their product 0, and |p_t| <= mu p, opposite to the slip after the impact where that is not
0.  Newton's law with friction may give energy (Kane & Levinson 1985); then the restitution is
taken as much smaller as keeps it from that.  With e = 0 it never does: p^T w+ <= 0.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from mechc.native._events import impulses
from mechc.simulation.contact.laws import Mask
from mechc.simulation.contact.modes import Answer, Inconsistent, Problem, choices_of, consistent
from mechc.simulation.contact.place import Place
from mechc.system.parameters import Array

HALVINGS = 52  # of the restitution
GIVEN = 1e-13  # of the energy exchanged: rounding


def after_impact(
    place: Place, touching: Mask, restitution: Array, has_friction: Mask
) -> tuple[Array, Mask]:
    """The change along rows R (nu,) by the impulses at the contacts that touch (n,), and which of
    these have one.

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
            found: Array = impulses(*map(np.ascontiguousarray, given))
        except ArithmeticError:
            raise Inconsistent(several=False) from None
        return found @ rows, _among(own, found, len(touching))
    problem = Problem(
        place.normal[own], place.tangent[own], numbers.rate[own], numbers.slip[own],
        numbers.friction[own], numbers.friction[own], np.ones(len(own), bool),
    )  # fmt: skip
    answer = _without_gain(problem, restitution[own], has_friction[own])
    return answer.along, _among(own, answer.forces[:, 0], len(touching))


def _among(own: Any, pressed: Array, count: int) -> Mask:
    struck = np.zeros(count, bool)
    struck[own] = pressed > 0.0
    return struck


def _without_gain(problem: Problem, restitution: Array, has_friction: Mask) -> Answer:
    """The impulses with the largest part of the restitution with which no energy is given."""
    best = _impulses(problem, restitution, has_friction)
    if not _gives_energy(problem, best):
        return best
    low, high = 0.0, 1.0
    best = _impulses(problem, 0.0 * restitution, has_friction)
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        found = _impulses(problem, middle * restitution, has_friction)
        if _energy(problem, found) > 0.0:
            high = middle
        else:
            low, best = middle, found
    return best


def _impulses(problem: Problem, restitution: Array, has_friction: Mask) -> Answer:
    """Of all solutions the one that leaves the least energy."""
    kept = replace(problem, closing=(1.0 + restitution) * problem.closing)
    n = len(restitution)
    every = np.ones(n, bool)
    choices = choices_of(every, every, np.zeros(n), every, has_friction)
    found = list(consistent(kept, choices, every, every))
    if not found:
        raise Inconsistent(several=False)
    return min(found, key=lambda answer: _energy(problem, answer))


def _energy(problem: Problem, answer: Answer) -> float:
    """What the impulses give, J."""
    forces = answer.forces
    work = forces[:, 0] @ problem.closing + forces[:, 1] @ problem.slipping
    return float(work + 0.5 * answer.along @ answer.along)


def _gives_energy(problem: Problem, answer: Answer) -> bool:
    forces = answer.forces
    exchanged = np.abs(forces[:, 0] * problem.closing).sum()
    exchanged += np.abs(forces[:, 1] * problem.slipping).sum()
    return _energy(problem, answer) > GIVEN * float(exchanged)
