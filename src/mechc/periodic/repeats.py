"""What repeats by itself: motions that begin later, and angles by whole turns."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from mechc.errors import ValueOutOfBoundsError
from mechc.periodic.shooting import Place, Shooting
from mechc.system.kinds import ANGULAR
from mechc.system.parameters import Array

TURN = 2.0 * np.pi
SAME = 1e-6  # of the sizes: motions that differ by less are one
SMALL = 1e-3  # rad or lengths: motions of less are measured by it


def is_later_the_same(problem: Shooting, place: Place, delay: float) -> bool:
    """Whether the motion from a place is the same where it begins later by a delay, s."""
    ends = []
    for asked in (problem, replace(problem, t0=problem.t0 + delay)):
        sol = asked.simulate(place)
        if not sol.status.ok:
            return False
        ends.append(sol.record.ends()[1][1])
    return bool((np.abs(ends[1] - ends[0]) < SAME * problem.size).all())


def refuse_other_periods(problem: Shooting, place: Place) -> None:
    """Raise :class:`ValueOutOfBoundsError` if a driven motion is another one a period later."""
    if not (problem.autonomous or is_later_the_same(problem, place, place.period)):
        raise ValueOutOfBoundsError(
            f"what drives the motion does not repeat after {place.period:.9g} s: give a whole "
            "number of its periods; where a parameter determines it, as an expression, "
            "period='2*pi/Omega'"
        )


def whole_turns(sol: Any) -> list[int]:
    """The angles whose whole turns change nothing along a motion."""
    system, found = sol.system, []
    t, y = (part[:: max(1, len(part) // 8)] for part in sol.record.states())
    known = system.rates(y, sol.params, t)
    for i, name in enumerate(system.coordinates):
        turned = y + TURN * np.eye(y.shape[1])[i]
        same = np.allclose(system.rates(turned, sol.params, t), known, rtol=SAME, atol=SAME)
        if system.quantities[name].kind in ANGULAR and same:
            found.append(i)
    return found


def sizes_in(sol: Any) -> Array:
    """Sizes of coordinates and of speeds in a motion (nq + nu,), from those of the mechanism."""
    nq, size = len(sol.system.coordinates), np.array(sol.system.scale(sol.params))
    states = sol.record.states()[1] / size
    size[:nq] *= np.clip(np.ptp(states[:, :nq], axis=0).max(initial=0.0), SMALL, 1.0)
    size[nq:] *= np.abs(states[:, nq:]).max(initial=0.0) or 1.0
    return size
